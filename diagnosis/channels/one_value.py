"""Readings of one value to the last digit, far longer than the channel ever repeats another one."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from replay.arrays.quantiles import median_of

Array = NDArray[np.float64]

TURNS = 0.02  #: Of the largest speed: a wheel that turns.
_LEAST_S, _READINGS = 0.5, 20  # of one value, and readings at the channel's usual rate
_LONGER = 2.5  # times the longest other run of one value, that is not this value
_FREEZES, _PARTED = 12, 4.0  # other runs that may be a frozen sensor's, too; times the next one
_AGAIN = 2  # values at which it stays more than once
_FEW, _SECOND = 5, 6.0 * 0.455  # readings; median of the square of a second difference of unit noise
_OF_MOST = 0.97  # of its own largest: an end of its range
_BEFORE, _SMALLER = 400, 8  # steps before a run, and changes among them, of which each is smaller than the one before


class Frozen(NamedTuple):
    """Samples [start, stop) in which a speed stays at a value [m/s], and the longest other run of one value [s]."""

    start: int
    stop: int
    value: float
    usual_s: float


def frozen_of(y: Array, span: float, dt: float) -> list[Frozen]:
    """Runs of one value that are far longer than the channel's own.

    Parameters
    ----------
    y : Array, shape (n,)
        Speed [m/s]; NaN where unknown.
    span : float
        Largest plausible speed [m/s].
    dt : float
        Step [s].
    """
    same = y[1:] == y[:-1]
    edge = np.flatnonzero(np.diff(np.r_[False, same, False].astype(np.int8)))
    starts, stops = edge[::2], edge[1::2] + 1
    if not starts.size:
        return []
    value, length = y[starts], (stops - starts) * dt
    turns = np.abs(value) > TURNS * span
    usual = _usual(starts, stops, same.size) * dt
    out = []
    for k in np.flatnonzero(turns & (length >= max(_LEAST_S, _READINGS * usual))):
        beside = max(_largest(y[: starts[k]]), _largest(y[stops[k] :]))
        if np.abs(value[k]) >= _OF_MOST * beside >= 0.0 or _settles(y[max(0, starts[k] - _BEFORE) : starts[k] + 1]):
            continue  # the end of its range, or of a filter's way to what it is given
        other = turns & (value != value[k])
        longest = _habit(length[other], float(length[k]), usual, steps=_in_steps(value[other], length[other]))
        if longest is not None:
            out.append(Frozen(int(starts[k]), int(stops[k]), float(value[k]), longest))
    return out


def trembling(y: Array, least: float) -> tuple[float, float] | None:
    """Share of readings of a turning wheel that are not the one before [1], and their noise [m/s]; None where it stands.

    Noise by second differences, of which what toggles between two steps has less than one step.

    Parameters
    ----------
    y : Array, shape (n,)
        Readings [m/s]; NaN where unknown.
    least : float
        From here on a wheel turns [m/s].
    """
    y = y[np.isfinite(y)]
    turning = np.abs(y[:-1]) > least
    if y.size < _FEW or not turning.any():
        return None
    return float(np.mean(np.diff(y)[turning] != 0.0)), float(np.sqrt(median_of(np.diff(y, 2) ** 2) / _SECOND))


def _in_steps(value: Array, length: Array) -> bool:
    """Whether a channel comes back to values at which it stays [m/s], for so long [s]: it reads in steps, and none of these runs is a freeze."""
    _, count = np.unique(value[length >= _LEAST_S], return_counts=True)
    return int(np.count_nonzero(count > 1)) >= _AGAIN


def _habit(others: Array, length: float, usual: float, *, steps: bool = False) -> float | None:
    """Longest run of other values that is none of a frozen sensor; None where a run of this length [all s] is no longer than the habit.

    A sensor that freezes again and again has a few such runs, and far shorter ones after them; one that reads in `steps` has such runs by habit.
    """
    ranked = np.r_[np.sort(others)[::-1][: 1 if steps else _FREEZES + 1], usual]
    found = None
    for k in (0,) if steps else (0, *(1 + gaps_in(ranked, _PARTED, _LEAST_S))):
        longest = float(max(ranked[k], usual))
        if length >= (_LONGER if k == 0 else _PARTED) * longest:
            found = longest
    return found


def gaps_in(ranked: Array, times: float, least: float) -> NDArray[np.intp]:
    """Places behind which lengths [s], the longest first, leave a gap: it is so many `times` the next one, and no less than `least` [s].

    Shape (gaps,), increasing.
    """
    return np.flatnonzero(ranked[:-1] >= np.maximum(times * ranked[1:], least))


def _settles(before: Array) -> bool:
    """Whether readings come nearer to the last one by ever smaller changes, shape (n,): those of a filter whose counts do not change."""
    change = np.abs(np.diff(before))
    last = change[change > 0.0][-_SMALLER:]
    return last.size == _SMALLER and bool(np.all(np.diff(last) < 0.0))


def _usual(starts: NDArray[np.intp], stops: NDArray[np.intp], steps: int) -> float:
    """Median number of steps from one change to the next, where samples [start, stop) repeat one value; 1 where fewer than two change."""
    inside = (starts > 0) & (stops <= steps)  # a change on either side
    changes = steps - int((stops - starts - 1).sum())
    if changes < 2:
        return 1.0
    longer = np.sort((stops - starts)[inside])
    ones = changes - 1 - longer.size

    def at(k: int) -> int:
        return 1 if k < ones else int(longer[k - ones])

    return 0.5 * (at((changes - 2) // 2) + at((changes - 1) // 2))


def _largest(y: Array) -> float:
    """Largest size of what is known, without a copy; -1 where nothing is."""
    return max(float(np.fmax.reduce(y, initial=-1.0)), -float(np.fmin.reduce(y, initial=1.0)))
