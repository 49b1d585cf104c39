"""What a speed's samples show by themselves: wild readings, repeated values, and how much changes from sample to sample."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from replay.arrays.runs import runs_of
from replay.arrays.sliding import median_within

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_LONG_HOLD_S = 5.0  # a command stays as long, but no reading of a wheel that rolls
_AROUND = 3  # samples on each side that a wild reading is compared with
_COARSE = 0.1  # of the readings of a moving wheel: as many that are far off are steps of a coarse encoder
_MOVES = 0.1  # of the usual top speed
_WILD_SHARE, _WILD_NOISE = 0.4, 12.0  # of the usual top speed; times the usual distance from the neighbours
_NEAR = 0.2  # of the usual top speed: so near to what the command explains nothing is wild
_LEAP = 0.75  # of that, from the last reading before and to the first one after that are not wild


class Samples(NamedTuple):
    """New samples of a speed.

    Attributes
    ----------
    step : NDArray[np.intp], shape (m,)
        Timeline step of each.
    value : Array, shape (m,)
        Readings [m/s]; NaN for wild ones.
    wild : Flags, shape (m,)
        Single readings far off those before and after.
    same : Flags, shape (m,)
        Whether a reading repeats the one before to the last digit.
    change : Array, shape (m,)
        Difference to the reading before [m/s].
    white : Array, shape (m,)
        Second difference, as the noise of one sample [m/s].
    """

    step: NDArray[np.intp]
    value: Array
    wild: Flags
    same: Flags
    change: Array
    white: Array


def samples_of(y: Array, fresh: Flags, band: tuple[Array, Array] | None = None) -> Samples:
    """New samples of a channel, with what is wild in them set aside.

    Parameters
    ----------
    y : Array, shape (n,)
        Readings [m/s]; NaN where not valid.
    fresh : Flags, shape (n,)
        Steps with a new sample.
    band : tuple[Array, Array] or None, each of shape (n,)
        Between what a command makes the speed be around that time [m/s]: what it explains is not wild.
    """
    step = np.flatnonzero(fresh & np.isfinite(y))
    value = y[step].astype(np.float64)
    wild = _wild(value)
    if band is not None and wild.any():
        near = _NEAR * float(np.quantile(np.abs(value), 0.9))
        wild &= ~((value >= band[0][step] - near) & (value <= band[1][step] + near))
    value = np.where(wild, np.nan, value)
    before = np.r_[np.nan, value[:-1]]
    change = value - before
    white = np.zeros(value.size)
    if value.size > 2:
        white[1:-1] = (value[2:] - 2.0 * value[1:-1] + value[:-2]) / np.sqrt(6.0)
    return Samples(step, value, wild, change == 0.0, change, np.nan_to_num(white))


def holds_of(samples: Samples, still: float, dt: float) -> Array:
    """How long a channel stays at one value of more than `still` [m/s], for each time that it does [s], the longest first.

    Shape (holds,).

    Parameters
    ----------
    samples : Samples
        Of the channel.
    still : float
        What counts as standstill [m/s].
    dt : float
        Step [s].
    """
    held = samples.same & (np.abs(samples.value) > still)
    edge = np.flatnonzero(np.diff(np.r_[False, held, False].astype(np.int8)))
    starts, stops = edge[::2], edge[1::2]
    length = (samples.step[stops - 1] - samples.step[np.maximum(starts - 1, 0)]) * dt
    return np.asarray(np.sort(length)[::-1], dtype=np.float64)


def without_holds(y: Array, samples: Samples, dt: float) -> Array:
    """Readings without those of times in which a moving speed is one value for long, NaN instead; shape of `y`.

    Parameters
    ----------
    y : Array, shape (n,)
        Readings [m/s].
    samples : Samples
        New samples of it.
    dt : float
        Step [s].
    """
    out = y.copy()
    held = samples.same & (samples.value != 0.0)
    for a, b in runs_of(held):
        first, last = int(samples.step[a]), int(samples.step[b - 1])
        if (last - first) * dt > _LONG_HOLD_S:
            out[first : last + 1] = np.nan
    return out


def _wild(value: Array) -> Flags:
    """Readings that lie far off both their neighbourhoods, which agree with each other."""
    if value.size < 2 * _AROUND + 1:
        return np.zeros(value.size, np.bool_)
    usual = median_within(value, _AROUND)
    off = np.abs(value - usual)
    top = float(np.quantile(np.abs(usual), 0.99))
    least = max(_WILD_SHARE * top, _WILD_NOISE * float(np.quantile(off, 0.75)), 1e-9)
    wild = np.asarray(off > least)
    wild &= _leaps(value, wild, least)
    moving = wild | (np.abs(usual) > _MOVES * top)
    return wild if np.count_nonzero(wild) < _COARSE * np.count_nonzero(moving) else np.zeros_like(wild)


def _leaps(value: Array, wild: Flags, least: float) -> Flags:
    """Whether readings leave, and are left, by leaps to one side: on a short start or stop that few readings show one lies between others."""
    good = np.flatnonzero(~wild)
    if not good.size:
        return wild
    at = np.searchsorted(good, np.arange(value.size))
    before, after = good[np.maximum(at - 1, 0)], good[np.minimum(at, good.size - 1)]
    rises, falls = value - value[before], value - value[after]
    return np.asarray((np.sign(rises) == np.sign(falls)) & (np.minimum(np.abs(rises), np.abs(falls)) > _LEAP * least))
