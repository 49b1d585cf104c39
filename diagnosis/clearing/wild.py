"""Readings that stand out by themselves: a wheel's inertia forbids that its speed leaves both readings beside it at once."""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.habit import identify_habit
from diagnosis.clearing.cells import Array, Cells
from diagnosis.clearing.leaps import heights
from replay.arrays.blocks import release
from replay.arrays.quantiles import median_of
from replay.signals.resolution import rounding_step

_NOISES, _OF_TOP = 8.0, 0.1  # times the usual noise, and share of the top speed, from which on a reading is wild
_STEPS = 2.5  # of the reading: one more or less is how it is rounded
_TURNING = 20  # readings that tell its noise while it turns
_FEW = 3  # in a window: fewer are a recorder's


def wild_readings(cells: Cells, speed: Array, floor: float) -> Array:
    """Mean height of the wild readings of each wheel as a share of its speed; 0 where there are few, and in stated faults.

    Parameters
    ----------
    cells : Cells
        The mission.
    speed : Array, shape (cells, wheels)
        Mean speeds [m/s].
    floor : float
        Least speed of which the height is a share [m/s].

    Returns
    -------
    Array, shape (windows, wheels)
    """
    frame = cells.frame
    height, count = np.zeros(speed.shape), np.zeros(speed.shape)
    for i, wheel in enumerate(cells.machine.wheels):
        at, wild = wild_at(cells, f"wheel.{wheel}.v")
        cell = at // cells.width
        apart = cells.apart(wheel)
        height[:, i] = np.bincount(cell, wild, minlength=cells.size) * apart
        count[:, i] = np.bincount(cell, minlength=cells.size) * apart
    many = frame.sums(count)
    mean = frame.sums(height) / np.maximum(many, 1.0)
    return np.asarray(np.where(many >= _FEW, mean / np.maximum(np.nan_to_num(frame.rms(speed)), floor), 0.0))


def wild_at(cells: Cells, name: str) -> tuple[NDArray[np.intp], Array]:
    """Samples of a signal's wild readings, and their heights [m/s], each of shape (k,)."""
    return cells.once(f"wild {name}", partial(_wild, cells, name))


def _wild(cells: Cells, name: str) -> tuple[NDArray[np.intp], Array]:
    y = cells.timeline.get(name)
    at = np.zeros(0, dtype=np.intp) if y is None else np.flatnonzero(cells.timeline.fresh[name] & np.isfinite(y))
    if y is None or at.size < _FEW:
        return np.zeros(0, dtype=np.intp), np.zeros(0)
    v = y[at]
    release(y)
    before, after = v[1:-1] - v[:-2], v[1:-1] - v[2:]
    alone = heights(before, after)
    least = max(_NOISES * _usual(v, cells.machine.limits.driving_speed), _OF_TOP * cells.machine.max_speed)
    wild = alone > least
    if wild.any():
        tick = identify_habit(y, cells.timeline.fresh[name], cells.timeline.dt).tick
        beside = np.maximum(np.abs(v[:-2]), np.abs(v[2:]))
        wild &= alone > _STEPS * np.maximum(rounding_step(v), tick * beside**2)
    return at[1:-1][wild], np.asarray(alone[wild], dtype=np.float64)


def _usual(v: Array, driving_speed: float) -> float:
    """Usual noise of readings, shape (n,), while the wheel turns where it mostly stands, for a wheel that stands has none [m/s]."""
    second = np.abs(v[2:] + v[:-2] - 2.0 * v[1:-1])
    turns = np.minimum(np.abs(v[2:]), np.abs(v[:-2])) > driving_speed
    some = [second, second[turns]] if np.count_nonzero(turns) >= _TURNING else [second]
    return max(float(median_of(s)) for s in some) / 0.6745 / float(np.sqrt(6.0))
