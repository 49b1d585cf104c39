"""Two files that hold the very same samples (a bridge that publishes what the PLC measured) tell the moment best.

Where values are equal to the last digit, noise included, only one shift of a sample or so makes them so.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from replay.clock_series import Series, Shared
from replay.clock_windows import Line, Readings

Array = NDArray[np.float64]

_WINDOW_S = 20.0
_MOST_WINDOWS = 40
_MOST_SAMPLES = 1000
_REACH_S = 0.006
_MOST_SHIFTS = 49
_SHARE = 0.3
_TIMES = 3.0
_CLOSE = 1e-9
_FEWEST = 5


def copied(shared: Sequence[Shared], line: Line) -> Readings | None:
    """Lags at which samples are equal, window by window.

    Parameters
    ----------
    shared : Sequence[Shared]
        Quantities in both files.
    line : Line
        Lag to within some milliseconds.

    Returns
    -------
    Readings or None
        None where fewer than five windows hold copies.
    """
    found: list[tuple[float, float, float, int]] = []
    for number, quantity in enumerate(shared):
        found += [(*reading, number) for reading in _of_one(quantity, line)]
    if len(found) < _FEWEST:
        return None
    t, lag, variance, signal = zip(*found, strict=True)
    return Readings(np.array(t), np.array(lag), np.array(variance), np.array(signal, np.int64))


def _of_one(shared: Shared, line: Line) -> list[tuple[float, float, float]]:
    """Times, lags and variances of the windows of one quantity in which values are equal at one shift alone."""
    faster = shared.reference if shared.reference.recorded <= shared.other.recorded else shared.other
    if faster.period > 1.01 * faster.recorded or faster.recorded > _REACH_S:
        return []  # means, or samples too rare to be better than what is known
    backwards = faster is shared.other
    slower = shared.reference if backwards else shared.other
    step = max(0.25 * faster.recorded, 2 * _REACH_S / (_MOST_SHIFTS - 1))
    shifts = np.arange(-np.ceil(_REACH_S / step), np.ceil(_REACH_S / step) + 1) * step
    first, last = float(slower.t[0]), float(slower.t[-1])
    count = max(1, int((last - first) / _WINDOW_S))
    width = (last - first) / count
    out = []
    for i in np.unique(np.linspace(0, count - 1, _MOST_WINDOWS).astype(int)).tolist():
        part = slower.within(first + i * width, first + (i + 1) * width)
        part = Series(part.t[:_MOST_SAMPLES], part.x[:_MOST_SAMPLES], part.period, part.recorded)
        if len(part.t) < 50:
            continue
        lag = line.lag(part.t - line.lag_s if backwards else part.t)
        at = part.t + (-lag if backwards else lag)
        delta = _shift(part.x, at, faster, shifts + step * (0.618 * (i + 1) % 1.0))  # windows do not share one rounding
        if delta is not None:
            middle = float(part.t.mean())
            known = float(lag.mean()) + (-delta if backwards else delta)
            out.append((middle - known if backwards else middle, known, step**2 / 12 + faster.recorded**2 / 12))
    return out


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
