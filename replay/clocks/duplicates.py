"""Two files that hold the very same samples (a bridge that publishes what the PLC measured) tell the moment best.

Where values are equal to the last digit, noise included, only one shift of a sample or so makes them so. If one file holds all
samples of the other, one by one and at a constant distance, that distance is the lag. Else the newest sample is repeated, by a
recorder of another rate, and is between none and one period old. At an equal rate either file may hold the repeats.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from replay.clocks.shared_series import Series, Shared
from replay.clocks.windows import Line, Readings

Array = NDArray[np.float64]

_WINDOW_S = 10.0
_MOST_WINDOWS = 40
_MOST_SAMPLES = 1000
_REACH_S = 0.006
_MOST_SHIFTS = 49
_SHARE = 0.3
_TIMES = 3.0
_CLOSE = 1e-9
_FEWEST = 5
_ALIKE = 1.01
NEWEST = 0.29  # a sample is up to a period old: standard deviation of its age, in periods
_EITHER = 0.58
PAIRED = 0.05
_EVEN = 0.02


@dataclass(frozen=True)
class _Window:
    """Time, lag, variance of a window; signal's number; how old samples may be [periods]; whether all are there one by one."""

    t: float
    lag: float
    variance: float
    signal: int
    age: float
    paired: bool


def copied(shared: Sequence[Shared], line: Line, reach_s: float = _REACH_S) -> tuple[Readings, float] | None:
    """Lags at which samples are equal, window by window.

    Parameters
    ----------
    shared : Sequence[Shared]
        Quantities in both files.
    line : Line
        Lag to within some milliseconds, or to within `reach_s`.
    reach_s : float
        How far from it samples are paired [s].

    Returns
    -------
    tuple[Readings, float] or None
        And the standard deviation of what they leave open in common, in periods of the faster file. None where fewer than
        five windows hold copies.
    """
    found = [w for number, quantity in enumerate(shared) for w in _of_one(quantity, line, number, reach_s)]
    pairs = [w for w in found if w.paired]
    paired = len(pairs) >= max(_FEWEST, 0.5 * len(found))
    found = pairs if paired else [w for w in found if not w.paired]
    if len(found) < _FEWEST:
        return None
    t, lag, variance = (np.array([getattr(w, k) for w in found]) for k in ("t", "lag", "variance"))
    return Readings(t, lag, variance, np.array([w.signal for w in found], np.int64)), (
        PAIRED if paired else max(w.age for w in found)
    )


def _of_one(shared: Shared, line: Line, number: int, reach_s: float) -> list[_Window]:
    """Windows of one quantity in which values are equal at one shift alone."""
    faster = shared.reference if shared.reference.recorded <= shared.other.recorded else shared.other
    if faster.period > 1.01 * faster.recorded:
        return []  # means
    backwards = faster is shared.other
    slower = shared.reference if backwards else shared.other
    alike = slower.recorded < _ALIKE * faster.recorded
    step = max(0.25 * faster.recorded, 2 * _REACH_S / (_MOST_SHIFTS - 1))
    shifts = np.arange(-np.ceil(_REACH_S / step), np.ceil(_REACH_S / step) + 1) * step
    first, last = float(slower.t[0]), float(slower.t[-1])
    count = max(1, int((last - first) / _WINDOW_S))
    width = (last - first) / count
    out = []
    for i in np.unique(np.linspace(0, count - 1, _MOST_WINDOWS).astype(int)).tolist():
        part = slower.within(first + i * width, first + (i + 1) * width)
        rows = slice(None, _MOST_SAMPLES) if i < 0.5 * count else slice(-_MOST_SAMPLES, None)
        part = Series(part.t[rows], part.x[rows], part.period, part.recorded)
        if len(part.t) < 50:
            continue
        lag = line.lag(part.t - line.lag_s if backwards else part.t)
        at = part.t + (-lag if backwards else lag)
        delta = _paired(part.x, at, faster, reach_s) if alike else None
        paired = delta is not None
        variance = (_EVEN * faster.recorded) ** 2
        if delta is None and faster.recorded <= _REACH_S:  # else samples are too rare to be better than what is known
            delta = _shift(part.x, at, faster, shifts + step * (0.618 * (i + 1) % 1.0))  # not all share one rounding
            variance = step**2 / 12 + faster.recorded**2 / 12
            if delta is not None and alike:
                delta -= 0.5 * faster.recorded
        if delta is not None:
            middle = float(part.t.mean())
            known = float(lag.mean()) + (-delta if backwards else delta)
            out.append(
                _Window(
                    middle - known if backwards else middle,
                    known,
                    variance,
                    number,
                    _EITHER if alike else NEWEST,
                    paired,
                )
            )
    return out


def _paired(x: Array, at: Array, faster: Series, reach_s: float) -> float | None:
    """Distance of the samples of the other file that hold these values one by one; None where there are none."""
    reach = int(np.ceil(reach_s / faster.recorded)) + 1
    start = int(np.searchsorted(faster.t, at[0]))
    index = start + np.arange(-reach, reach + 1)[:, None] + np.arange(len(x))
    inside = (index[:, 0] >= 0) & (index[:, -1] < len(faster.x))
    if not inside.any():
        return None
    index = index[inside]
    near = _CLOSE * float(np.abs(x).max())
    share = (np.abs(faster.x[index] - x) <= near).mean(axis=1)
    moving = np.count_nonzero(np.diff(x))
    best = int(np.argmax(share))
    others = np.delete(share, best)
    if moving < 50 or share[best] < 1.0 or (others.size and others.max() > 0.9):
        return None
    delta = faster.t[index[best]] - at
    middle = float(np.median(delta))
    return middle if float(np.abs(delta - middle).mean()) < _EVEN * faster.recorded else None


def _shift(x: Array, at: Array, faster: Series, shifts: Array) -> float | None:
    """Middle of the shifts at which the values are the faster recording's latest ones; None where that is no copy."""
    index = np.searchsorted(faster.t, at[None, :] + shifts[:, None], side="right") - 1
    values = faster.x[np.clip(index, 0, len(faster.x) - 1)]
    moving = np.ptp(values, axis=0) > 0
    if moving.sum() < 50:
        return None
    near = _CLOSE * float(np.abs(x).max())
    share = (np.abs(values - x) <= near)[:, moving].mean(axis=1)
    peak = int(np.argmax(share))
    if share[peak] < _SHARE or share[peak] < _TIMES * float(np.median(share)):
        return None
    equal = np.flatnonzero(share > 0.5 * share[peak])
    if equal[0] == 0 or equal[-1] == len(shifts) - 1 or equal[-1] - equal[0] > 0.5 * len(shifts):
        return None
    return float(np.average(shifts[equal], weights=share[equal]))
