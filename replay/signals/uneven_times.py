"""Speeds that a driver divides by uneven times: even steps of the motion, each over the time at which its message happened to be handled.

A board counts at even times, and the driver on the computer divides each count by the time since it handled the last one. Early and late messages then
read as noise that no wheel makes. The stamps tell: a reading times its own interval is the step, and steps go on evenly where readings do not.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from replay.arrays.sliding import mean_within, median_within

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_SOME, _MOST = 1 << 16, 1 << 22  # samples that are looked at, and that are worked on at once
_LEAST = 40  # triples of readings of a motion
_AROUND = 15  # samples whose mean interval is the usual one
_PAUSE = 2.5  # times the median interval of them: what is longer is a pause
_UNEVEN = 0.1  # of the interval, by which the median one of a motion is early or late
_EVENER = 0.5  # times the unevenness of the readings: that of the steps
_MOVES = 0.1  # of the usual largest step
_LATE = 1.3  # times the usual interval: a message may have been lost meanwhile


class Evened(NamedTuple):
    """A speed as steps over the usual interval.

    Attributes
    ----------
    values : Array, shape (n,)
        As given where the readings are none of uneven times.
    note : str
        What was found; empty where nothing was.
    """

    values: Array
    note: str


def evened(stamps: NDArray[np.int64], values: Array) -> Evened:
    """Divide the steps behind a speed's readings by the usual interval, where the intervals of its stamps explain how uneven the readings are.

    A reading that repeats the one before to the last digit was divided by nothing, and stays; so does one after a pause which the step does not fill.

    Parameters
    ----------
    stamps : NDArray[np.int64], shape (n,)
        Strictly increasing [ns].
    values : Array, shape (n,)
        Speeds, in any unit per second; NaN where none was read.
    """
    if not _LEAST < values.size <= _MOST or not _by_uneven_times(stamps[:_SOME], values[:_SOME]):
        return Evened(values, "")
    interval, usual = _intervals(stamps)
    even = values[1:] * interval / usual
    level = _middle(np.nan_to_num(np.abs(even)))
    late = interval > _LATE * usual
    nearer = np.abs(np.abs(values[1:]) - level) < np.abs(np.abs(even) - level)
    keep = (values[1:] == values[:-1]) | (late & nearer)
    out = values.copy()
    out[1:] = np.where(keep, values[1:], even)
    note = (
        f"its readings are even steps divided by uneven times (every {np.median(usual) * 1e3:.3g} ms, mostly "
        f"{np.median(np.abs(interval / usual - 1.0)) * 100.0:.0f} % early or late), and were divided by the usual time instead"
    )
    return Evened(out, note)


def _by_uneven_times(stamps: NDArray[np.int64], values: Array) -> bool:
    """Whether steps go on evenly where readings do not."""
    if _even(np.diff(stamps)):
        return False
    interval, usual = _intervals(stamps)
    reading = np.abs(values[1:])
    step = reading * interval
    known = np.isfinite(step)
    if not known.any():
        return False
    moves = (
        known & (step > _MOVES * float(np.quantile(step[known], 0.95))) & (np.sign(values[1:]) == np.sign(values[:-1]))
    )
    triple = moves[2:] & moves[1:-1] & moves[:-2] & (np.diff(reading)[1:] != 0.0)
    if np.count_nonzero(triple) < _LEAST:
        return False
    if float(np.median(np.abs(interval / usual - 1.0)[1:-1][triple])) < _UNEVEN:
        return False
    return _roughness(step, triple) < _EVENER * _roughness(reading, triple)


def _even(interval: NDArray[np.int64]) -> bool:
    """Whether no interval, shape (n,), differs from any mean of others by as much as uneven times do."""
    return float(interval.max()) < (1.0 + _UNEVEN) * float(interval.min())


def _intervals(stamps: NDArray[np.int64]) -> tuple[Array, Array]:
    """Time before each sample but the first, and the usual one around it [s]; shape (n - 1,) each."""
    interval = np.diff(stamps) * 1e-9
    middle = _middle(interval)
    known = np.where(interval > _PAUSE * middle, middle, interval)
    return interval, mean_within(known, _AROUND, "edge")


def _middle(x: Array) -> Array:
    """Running median, shape of `x`."""
    return median_within(x, _AROUND // 2)


def _roughness(x: Array, triple: Flags) -> float:
    """Median second difference of the logarithm of what is positive in `triple`, shape (n - 2,) for x of shape (n,)."""
    with np.errstate(all="ignore"):
        log = np.log(x)
        bend = np.abs(log[2:] - 2.0 * log[1:-1] + log[:-2])
    return float(np.median(bend[triple]))
