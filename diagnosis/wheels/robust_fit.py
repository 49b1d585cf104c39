"""Least trimmed squares over windows: coefficients that explain the best share of a mission's windows together.

Up to the trimmed share of the windows may hold faults of any size (Rousseeuw and Van Driessen's concentration steps, on
the windows' normal equations, so that a step costs no pass over samples).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from replay.arrays.compiling import njit
from replay.arrays.scipy_parts import part_of

Array = NDArray[np.float64]

_SMALL = 8  # windows that a start is drawn from
_STEPS_START, _STEPS_END = 3, 12


class Normal(NamedTuple):
    """Normal equations of n windows with p regressors.

    Attributes
    ----------
    gram : Array, shape (n, p, p)
    moment : Array, shape (n, p)
    power : Array, shape (n,)
        Sum of squares of what is explained.
    samples : Array, shape (n,)
        Their number.
    """

    gram: Array
    moment: Array
    power: Array
    samples: Array

    def part(self, chosen: NDArray[np.bool_] | NDArray[np.intp]) -> Normal:
        """Some of the windows. `chosen` are indices, shape (k,), or flags, shape (n,)."""
        return Normal(*(x[chosen] for x in self))


class Trimmed(NamedTuple):
    """What the best windows say.

    Attributes
    ----------
    values : Array, shape (p,)
        Coefficients.
    misfit : Array, shape (n,)
        Mean square that each window leaves, over its own mean square (at least `floor`²).
    chosen : NDArray[np.intp]
        The windows that explain each other best.
    score : float
        Mean misfit of those.
    """

    values: Array
    misfit: Array
    chosen: NDArray[np.intp]
    score: float


def normal_equations(x: Array, y: Array, use: NDArray[np.bool_], length: int) -> Normal:
    """Normal equations of windows of `length` samples; x (m, p), y and use (m,)."""
    n = y.size // length
    rows = x[: n * length].reshape(n, length, x.shape[1])
    kept = np.where(use[: n * length, None], x[: n * length], 0.0).reshape(rows.shape)
    there = np.where(use, y, 0.0)[: n * length].reshape(n, length)
    turned = np.ascontiguousarray(kept.transpose(0, 2, 1))
    return Normal(
        turned @ kept,
        (turned @ there[:, :, None])[:, :, 0],
        (there**2).sum(axis=1),
        use[: n * length].reshape(n, length).sum(axis=1).astype(np.float64),
    )


def solve(w: Normal, penalty: Array, prior: Array | None = None, chosen: NDArray[np.intp] | None = None) -> Array:
    """Coefficients that are not negative, by ridge regression towards `prior`; `penalty` (p, p) per sample.

    `chosen` are indices of the windows to use, shape (k,); None: all.
    """
    A, b = _system(w, np.arange(w.samples.size) if chosen is None else chosen, penalty, prior)
    L = np.linalg.cholesky(A)
    return np.asarray(part_of("scipy.optimize", "_nnls").nnls(L.T, np.linalg.solve(L, b))[0])


def _system(w: Normal, chosen: NDArray[np.intp], penalty: Array, prior: Array | None) -> tuple[Array, Array]:
    A, b = np.zeros(w.gram.shape[1:]), np.zeros(w.moment.shape[1])
    _add_chosen(w.gram.reshape(-1, A.size), chosen, A.reshape(-1))
    _add_chosen(w.moment, chosen, b)
    total = w.samples[chosen].sum() * penalty
    A += total
    if prior is not None:
        b = b + total @ prior
    return A + 1e-9 * max(float(np.trace(A)), 1e-12) * np.eye(len(A)), b


@njit(cache=True, nogil=True)
def _add_chosen(rows, chosen, out):  # type: ignore[no-untyped-def]
    """Add some rows (n, k) to `out` (k,), one after another and without a copy of them."""
    for n in chosen:
        row = rows[n]
        for i in range(out.size):
            out[i] += row[i]


def misfits(w: Normal, values: Array, floor: float) -> Array:
    """Mean square that each window leaves, over its own mean square, which counts as `floor`² at least; shape (n,).

    `floor` has the unit of the responses [m/s].
    """
    left = w.power - 2 * w.moment @ values + ((w.gram @ values) @ values)
    count = np.maximum(w.samples, 1.0)
    return np.asarray(np.maximum(left, 0.0) / count / np.maximum(w.power / count, floor**2))


def trimmed(
    w: Normal, penalty: Array, share: float, floor: float, starts: int, given: NDArray[np.intp] | None = None
) -> Trimmed:
    """Coefficients of the `share` of windows that they explain best.

    Parameters
    ----------
    w : Normal
        The windows.
    penalty : Array, shape (p, p)
        Ridge per sample.
    share : float
        Share of the windows that are believed.
    floor : float
        Least root mean square to compare a misfit with, in units of y.
    starts : int
        Random starts; the same in every run.
    given : NDArray[np.intp] or None
        Windows to start from besides.
    """
    n = w.samples.size
    keep = min(n, max(_SMALL, int(share * n)))
    rng = np.random.default_rng(0)
    seeds = [rng.choice(n, min(_SMALL, n), replace=False) for _ in range(starts)]
    if given is not None:
        seeds.append(given)
    best: tuple[float, NDArray[np.intp]] | None = None
    for chosen in seeds:
        for _ in range(_STEPS_START):
            values = np.asarray(np.linalg.solve(*_system(w, chosen, penalty, None)), np.float64)
            left = misfits(w, values, floor)
            chosen = np.argpartition(left, keep - 1)[:keep]
        score = float(left[chosen].mean())
        if best is None or score < best[0]:
            best = score, chosen
    assert best is not None
    chosen = best[1]
    for _ in range(_STEPS_END):
        values = solve(w, penalty, chosen=chosen)
        left = misfits(w, values, floor)
        new = np.argpartition(left, keep - 1)[:keep]
        same = np.array_equal(np.sort(new), np.sort(chosen))
        chosen = new
        if same:
            break
    return Trimmed(values, left, chosen, float(left[chosen].mean()))


def mode(values: Array) -> float:
    """Half-sample mode: the densest half, over and over, until a few values are left; their median.

    `values` of shape (n,), and the mode in their unit.
    """
    x = np.sort(values)
    while x.size > 4:
        half = (x.size + 1) // 2
        widths = x[half - 1 :] - x[: x.size - half + 1]
        k = int(np.argmin(widths))
        x = x[k : k + half]
    return float(np.median(x))
