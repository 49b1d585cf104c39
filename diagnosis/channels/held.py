"""What a reference was while a stepwise channel made and held its value (compiled): its mean and the range that it spanned."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.habit import Habit
from diagnosis.channels.sample_status import PAIR, SKIP
from replay.arrays.compiling import njit
from replay.arrays.numeric import bridged

Array = NDArray[np.float64]

_MADE, _MADE_AND_HELD = 1.0, 2.0  # holds: a value is the mean over one, and stands for another
_EARLY, _REPEATED = 0.8, 1.5  # holds since the last news after which a new value, and the same one again, are news


class Held(NamedTuple):
    """A reference as a stepwise channel sees it; all of shape (n,), in the reference's unit.

    Attributes
    ----------
    mean : Array
        Over the time in which the value that is read was made.
    spread : Array
        Half of the range over the time in which it was made and held.
    """

    mean: Array
    spread: Array


def held_reference(x: Array, habit: Habit, dt: float) -> Held:
    """A reference as a channel of some habit sees it; without one it is the reference itself. A gap of it is bridged.

    Parameters
    ----------
    x : Array, shape (n,)
        The reference; NaN where not known.
    habit : Habit
        Of the channel.
    dt : float
        Step [s].
    """
    out = Held(np.empty(x.size), np.empty(x.size))
    if not habit.stepwise:
        return Held(x, np.zeros(x.size))
    filled = bridged(x)
    total = np.concatenate(([0.0], np.cumsum(filled)))
    travel = np.concatenate(([0.0], np.cumsum(np.abs(filled) * dt)))
    window, timeout = (max(1, round(s / dt)) for s in (habit.window, habit.timeout))
    _scan(filled, total, travel, habit.travel, window, timeout, out)
    out.mean[~np.isfinite(x)] = np.nan
    return out


@njit(cache=True, nogil=True)
def _scan(x, total, travel, distance, window, timeout, out):  # type: ignore[no-untyped-def]
    """Two windows that end at every sample: by travel where there is a distance, no longer than the timeout allows."""
    mean, spread = out
    first, second = 0, 0
    low, high = np.empty(x.size, np.int64), np.empty(x.size, np.int64)  # monotonic queues of the range
    low_head, low_tail, high_head, high_tail = 0, 0, 0, 0
    for k in range(x.size):
        most = timeout if distance > 0.0 else window
        while first < k and (
            k + 1 - first > most
            or (distance > 0.0 and k + 1 - first > window and travel[k + 1] - travel[first + 1] >= _MADE * distance)
        ):
            first += 1
        while second < k and (
            k + 1 - second > _MADE_AND_HELD * most
            or (
                distance > 0.0
                and k + 1 - second > _MADE_AND_HELD * window
                and travel[k + 1] - travel[second + 1] >= _MADE_AND_HELD * distance
            )
        ):
            second += 1
        while low_tail > low_head and x[low[low_tail - 1]] >= x[k]:
            low_tail -= 1
        low[low_tail] = k
        low_tail += 1
        while high_tail > high_head and x[high[high_tail - 1]] <= x[k]:
            high_tail -= 1
        high[high_tail] = k
        high_tail += 1
        while low[low_head] < second:
            low_head += 1
        while high[high_head] < second:
            high_head += 1
        bottom, top = x[low[low_head]], x[high[high_head]]
        if distance > 0.0 and travel[k + 1] - travel[second] < _MADE_AND_HELD * distance:
            bottom, top = min(bottom, 0.0), max(top, 0.0)  # too slow for the sensor: it may read zero
        mean[k] = (total[k + 1] - total[first]) / (k + 1 - first)
        spread[k] = 0.5 * (top - bottom)


def news_alone(status: NDArray[np.int8], y: Array, hold: Array, dt: float) -> NDArray[np.int8]:
    """Status with `SKIP` for pairs that bring nothing new by the habit of the channel, shape (n,).

    Parameters
    ----------
    status : NDArray[np.int8], shape (n,)
        As in `diagnosis.channels.sample_status`.
    y : Array, shape (n,)
        Readings.
    hold : Array, shape (n,)
        Time between two updates at the speed of each sample [s].
    dt : float
        Step [s].
    """
    out = status.copy()
    _thin(out, y, hold / dt)
    return out


@njit(cache=True, nogil=True)
def _thin(status, y, hold):  # type: ignore[no-untyped-def]
    last, value = -1, np.nan
    for k in range(status.size):
        if status[k] != PAIR:
            continue
        if last >= 0:
            need = (_REPEATED if y[k] == value else _EARLY) * hold[k]
            if k - last < need and hold[k] > 1.0:
                status[k] = SKIP
                continue
        last, value = k, y[k]
