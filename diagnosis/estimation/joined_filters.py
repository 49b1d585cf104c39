"""Several row filters stepped as one of filterpy's: its state is that of all, its matrices have theirs on the diagonal.

The filters know nothing of each other, and the zeros between them change no number; a step of sixteen costs about what a
step of two does.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.estimation.fault_models import CONSTANT, FIRST_NOISY, MISMATCH, ZERO, ModeModel
from diagnosis.estimation.filterpy_loading import kalman_filter
from diagnosis.estimation.row_filters import LOG_2PI, RowFilter

Array = NDArray[np.float64]

_TOGETHER = 16
_UNKNOWNS = 2


class Course(NamedTuple):
    """Samples that one row filter takes, one after the other.

    Attributes
    ----------
    m : int
        Place of the model in `ROW_OF_MODEL`.
    model : ModeModel
        Noise and prior of the channel.
    y, x : Array, shape (n,)
        Measured values and references [unit of the channel].
    """

    m: int
    model: ModeModel
    y: Array
    x: Array


def likelihoods(courses: Sequence[Course]) -> list[Array]:
    """Log-likelihood of each sample given those before it, as `RowFilter.step` gives it, for every course.

    Each of the shape (k,) of its course.
    """
    # those of like length beside one another: the shorter ones of a group wait for its longest
    order = sorted(range(len(courses)), key=lambda i: courses[i].y.size)
    out: list[Array] = [np.empty(0)] * len(courses)
    for first in range(0, len(order), _TOGETHER):
        group = order[first : first + _TOGETHER]
        for i, found in zip(group, _stepped([courses[i] for i in group]), strict=True):
            out[i] = found
    return out


def _stepped(courses: Sequence[Course]) -> Iterator[Array]:
    rows = [RowFilter(c.m, c.model) for c in courses]
    size, steps = len(rows), max(c.y.size for c in courses)
    kf = kalman_filter()(dim_x=_UNKNOWNS * size, dim_z=size)
    kf.F, kf.Q, kf.P = (_diagonal([getattr(row.kf, name) for row in rows]) for name in "FQP")
    kf.x = np.concatenate([row.kf.x for row in rows])
    noise = np.array([row.kf.R[0, 0] for row in rows])
    grows = np.array([row.grows for row in rows])
    still = all(row.still for row in rows)
    h, z = np.zeros((steps, size, _UNKNOWNS * size)), np.zeros((steps, size, 1))
    for i, c in enumerate(courses):
        h[: c.x.size, i, _UNKNOWNS * i : _UNKNOWNS * (i + 1)] = _readings_of(c)
        z[: c.y.size, i, 0] = c.y
    e, s, r = np.empty((steps, size)), np.empty((steps, size)), np.diag(noise)
    for k in range(steps):
        if not still:
            kf.predict()
        if grows.any():
            gain = kf.x[::_UNKNOWNS, 0]
            r = np.diag(np.where(grows, noise * np.maximum(1.0, gain * gain), noise))
        kf.update(z[k], R=r, H=h[k])
        e[k], s[k] = kf.y[:, 0], np.diagonal(kf.S)
    found = -0.5 * (e * e / s + np.log(s) + LOG_2PI)
    return (found[: c.y.size, i] for i, c in enumerate(courses))


def _readings_of(course: Course) -> Array:
    """H of every sample, shape (n, 2)."""
    m, x = course.m, course.x
    if m in (CONSTANT, ZERO):
        return np.tile([1.0 if m == CONSTANT else 0.0, 0.0], (x.size, 1))
    return np.column_stack([x, np.full(x.size, 1.0 if m == MISMATCH or m >= FIRST_NOISY else 0.0)])


def _diagonal(blocks: Sequence[Array]) -> Array:
    out = np.zeros((_UNKNOWNS * len(blocks), _UNKNOWNS * len(blocks)))
    for i, block in enumerate(blocks):
        part = slice(_UNKNOWNS * i, _UNKNOWNS * (i + 1))
        out[part, part] = block
    return out
