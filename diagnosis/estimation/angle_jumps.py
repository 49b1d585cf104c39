"""Jumps of a steering angle: no axle turns quicker than it ever does for a while, so that what jumps is a reading."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from replay.arrays.blocks import blocks
from replay.arrays.quantiles import median_of, quantile_of

Array = NDArray[np.float64]

READINGS = 3  # from before a jump to after it; the middle of three is no spike
_COARSE_READINGS = 1  # the same of readings further apart than `_FINE_S`
LEAST_RAD, LARGEST_RAD = 0.06, 0.24  # of what a jump is a share: an offset counts whatever the angle
_FEW = 100  # readings
_OVERLAP_S = 0.5  # of blocks
_WRAP = 0.3  # rad: a jump of a whole turn, give or take, is none
_LASTING_S = 0.15  # for which a rate must last to be an axle's own
_QUICKER, _SLOWEST = 1.3, 0.1  # times that rate, and rad/s at least
_NOISES, _STEPS = 8.0, 2.0  # times the noise, and the smallest step, of readings
_BEYOND = 1.5  # times what an axle may turn meanwhile, and noise may add
_GAP = 1.5  # times the usual time between readings, over which nothing is said
_FINE_S, _COARSE_S = 0.03, 0.06  # readings further apart than the latter show no jumps
_MOVING = 0.02  # rad in `_LASTING_S`
_CARRIED_ON = 0.75  # of a move between readings far apart: as much as the moves before and after it make together is an axle on its way


class Jumps(NamedTuple):
    """Where an angle jumps.

    Attributes
    ----------
    size : Array, shape (m,)
        By how much [rad].
    of : Array, shape (m,)
        What that is a share of, from `LEAST_RAD` to `LARGEST_RAD` [rad].
    at_s : Array, shape (m,)
        When [s].
    """

    size: Array
    of: Array
    at_s: Array


def readings(y: Array, fresh: NDArray[np.bool_], dt: float) -> Iterator[tuple[Array, Array]]:
    """Times [s] and angles [rad] of an axle's readings, block by block; none of blocks with few, or rare, ones.

    Parameters
    ----------
    y : Array, shape (n,)
        Angle [rad]; NaN where unknown.
    fresh : NDArray[np.bool_], shape (n,)
        Steps with a new reading.
    dt : float
        Step [s].
    """
    beyond = round(_OVERLAP_S / dt)
    for part in blocks(y.size):
        first, stop = max(0, part.start - beyond), part.stop
        at = first + np.flatnonzero(fresh[first:stop] & np.isfinite(y[first:stop]))
        if at.size >= _FEW and float(median_of(np.diff(at))) * dt <= _COARSE_S:
            yield np.asarray(at * dt, dtype=np.float64), np.asarray(y[at], dtype=np.float64)


def quickest_of(read: Iterable[tuple[Array, Array]]) -> float | None:
    """Largest rate of an axle that lasts [rad/s]; None without readings. `read` are pairs of shape (n,) each [s, rad]."""
    return max((_quickest(t, y) for t, y in read), default=None)


def jumps_of(read: Iterable[tuple[Array, Array]], quickest: float) -> Jumps:
    """Where an angle jumps further than it can be turned.

    Parameters
    ----------
    read : Iterable[tuple[Array, Array]], each of shape (n,)
        From `readings` [s, rad].
    quickest : float
        Largest rate of the machine's axles [rad/s].
    """
    every = [_jumps(t, y, quickest) for t, y in read]
    return Jumps(*(np.concatenate([j[k] for j in every]) if every else np.zeros(0) for k in range(3)))


def _quickest(t: Array, y: Array) -> float:
    """Over two spans on end, in one of which a jump would be alone."""
    n = max(1, round(_LASTING_S / float(median_of(np.diff(t)))))
    rate = (y[n:] - y[:-n]) / (t[n:] - t[:-n])
    before, after = rate[:-n], rate[n:]
    both = np.where(before * after > 0.0, np.minimum(np.abs(before), np.abs(after)), 0.0)
    return float(both.max(initial=0.0))


def _held(t: Array, y: Array) -> float:
    """Time between readings that differ, while an axle turns [s]: a channel may repeat each of its readings."""
    changes = np.flatnonzero(np.diff(y) != 0.0) + 1
    if changes.size < 2:
        return float(median_of(np.diff(t)))
    apart, moved = np.diff(t[changes]), np.abs(np.diff(y[changes]))
    turning = (apart < _LASTING_S) & (moved > _MOVING * apart / _LASTING_S)
    return float(quantile_of(apart[turning], 0.95)) if turning.any() else float(median_of(np.diff(t)))


def _jumps(t: Array, y: Array, quickest: float) -> Jumps:
    usual, held = float(median_of(np.diff(t))), _held(t, y)
    apart = READINGS if usual <= _FINE_S else _COARSE_READINGS
    if y.size < apart + 4 or held > max(_COARSE_S, _BEYOND * usual):
        return Jumps(np.zeros(0), np.zeros(0), np.zeros(0))
    a, b, c = y[:-2], y[1:-1], y[2:]
    middle = np.maximum(np.minimum(a, b), np.minimum(np.maximum(a, b), c))
    before, after = middle[:-apart], middle[apart:]
    span = t[apart + 2 :] - t[: -apart - 2]
    moved = np.abs(after - before)
    moved = np.where(np.abs(moved - 2.0 * np.pi) < _WRAP, 0.0, moved)
    noise = float(median_of(np.abs(np.diff(y, 2)))) / 0.6745 / np.sqrt(6.0)
    steps = np.abs(np.diff(y))
    step = float(np.min(steps[steps > 0.0], initial=np.inf))
    step = step if np.isfinite(step) else 0.0
    lapse = held + (
        apart * usual if usual <= _FINE_S else 0.0
    )  # a reading is at most as old as the time to the one that differs
    may = max(_QUICKER * quickest, _SLOWEST) * lapse + max(_NOISES * noise, _STEPS * step)
    whole = span <= _GAP * (apart + 2) * usual
    jumps = whole & (moved > _BEYOND * may)
    if apart == _COARSE_READINGS:
        jumps &= ~_on_its_way(y)
    found = np.flatnonzero(jumps)
    size = np.clip(np.maximum(np.abs(before), np.abs(after))[found], LEAST_RAD, LARGEST_RAD)
    return Jumps(moved[found], size, t[found + 1 + (apart + 1) // 2])


def _on_its_way(y: Array) -> NDArray[np.bool_]:
    """Whether each move between two readings, but the first and the last, goes on in those beside it, shape (n - 3,).

    A servo makes its step in two or three readings that are far apart, quicker than it turns for a while; what jumps does so between two.
    """
    move = np.diff(y)
    way = np.sign(move[1:-1])
    beside = np.maximum(way * move[:-2], 0.0) + np.maximum(way * move[2:], 0.0)
    return np.asarray(beside > _CARRIED_ON * np.abs(move[1:-1]))
