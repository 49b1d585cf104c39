"""Speeds beside their second measurements: of two healthy instruments one is evened more and comes later, on all wheels of a machine alike."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from diagnosis.clearing.cells import Array, Cells
from diagnosis.clearing.measure import alone, behind, compared
from replay.arrays.quantiles import median_of, quantile_known

_LAGS_S = (0.0, 0.05, 0.1, 0.15, 0.2, 0.3)  # of one instrument behind the other
_FOLLOWED = 0.8  # quantile of the windows: lag shows where speeds change
_WHEELS = 2  # fewer do not tell a lag of the machine's from one of a part
#: Of the loss that counts, and times the others': a speed alone beside its second measurement. Of 17 healthy tuning missions of as many machines
#: the wheels' largest were alike within a factor of 1.9.
_LEAST_APART, _APART_ALONE = 0.3, 3.0
_EVEN_S, _SURE = 0.3, 0.05  # s apart are readings that count for a slope, whose standard error is at most that


def off_second(cells: Cells, speed: Array, second: Array, floor: float) -> Array:
    """How far speeds are off their second measurements in each window, as `Compared.off` has it, behind the lag that all wheels share.

    That lag, of either instrument, is the one by which most wheels are off least; a wheel that is later than the others stays off.

    Parameters
    ----------
    cells : Cells
        The mission.
    speed, second : Array, shape (cells, wheels)
        Both measurements [m/s]; NaN where unknown.
    floor : float
        As of `compared`.

    Returns
    -------
    Array, shape (windows, wheels)
    """
    count = speed.shape[1]
    if not count:
        return np.zeros((cells.frame.starts.size, 0))
    tried = [(lag, 0.0) for lag in _LAGS_S] + [(0.0, lag) for lag in _LAGS_S[1:]]
    both = (np.isfinite(speed) & np.isfinite(second)).any(axis=0)
    if np.count_nonzero(both) < _WHEELS:
        tried = tried[:1]
    best, least = np.zeros((cells.frame.starts.size, count)), np.inf
    for of_second, of_speed in tried:
        y, x = behind(speed, cells.dt, of_speed), behind(second, cells.dt, of_second)
        off = np.column_stack([compared(cells, y[:, i], x[:, i], floor).off for i in range(count)])
        known = [float(quantile_known(z, _FOLLOWED)) for z in off[:, both].T if np.isfinite(z).any()]
        left = float(median_of(known)) if known else np.inf
        if left < least or not (of_second or of_speed):
            best, least = off, left
    return less_at_starts(best)


def alone_apart(most: Sequence[float], i: int, clear_at: float) -> float:
    """By how much wheel `i` may be off its second measurement in a window [1]; `most` has by how much each wheel is, `clear_at` is the loss that counts."""
    return alone(most, i, clear_at, _LEAST_APART * clear_at, _APART_ALONE)


def less_at_starts(off: Array) -> Array:
    """Deviations in windows, where one borders on windows of rest no more than in the next one of driving; shape (windows, wheels).

    Such a window holds the first or last moment of a movement alone, in which the later of two instruments is far behind the other. NaN where a
    wheel rests.
    """
    edge = np.full((1, off.shape[1]), np.nan)
    before, after = np.concatenate([edge, off[:-1]]), np.concatenate([off[1:], edge])
    borders = np.isnan(before) ^ np.isnan(after)
    return np.asarray(np.where(np.isfinite(off) & borders, np.fmin(off, np.fmax(before, after)), off))


def slope_off(y: Array, x: Array, dt: float, least: float) -> float | None:
    """By how much y changes more or less than x over the mission, as a share, where both hardly move; None where they tell too little.

    Parameters
    ----------
    y, x : Array, shape (cells,)
        A channel and its second measurement, in one unit; NaN where unknown.
    dt : float
        Of a cell [s].
    least : float
        By which x varies, root mean square: less may be noise that both share.
    """
    known = np.flatnonzero(np.isfinite(y) & np.isfinite(x))
    if known.size < 2:
        return None
    a, b = y[known] - y[known].mean(), x[known] - x[known].mean()
    power, count = float(b @ b), known.size * dt / _EVEN_S
    if power <= least**2 * known.size or count < 2.0:
        return None
    slope = float(a @ b) / power
    error = float(np.sqrt(np.mean((a - slope * b) ** 2) / (np.mean(b**2) * count)))
    return abs(slope - 1.0) if error <= _SURE else None
