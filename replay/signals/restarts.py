"""Positions that start anew, as an angle does after each turn and a counter at its end, continued before a speed is made of them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from replay.log.source_options import SignalSource
from replay.machine.quantities import UNITS
from replay.machine.units import known_unit

_TURN = 2.0 * np.pi
_COUNTERS = (16, 32)  # bits
_INSIDE = 0.995  # of the readings lie within one period: the rest is damage
_NEARLY = 0.25  # of the period: what a jump may differ from it
_MOST_STEP, _OFTEN = 0.4, 0.01  # of the period, share of the samples: faster motion hides how far it went


class Continued(NamedTuple):
    """A position without its restarts.

    Attributes
    ----------
    values : NDArray, shape (n,)
        As recorded where nothing starts anew; all missing where it moves too fast between two readings.
    note : str
        What was found; empty where nothing was.
    """

    values: NDArray[Any]
    note: str


def continued(position: NDArray[Any], origin: SignalSource) -> Continued:
    """Continue a recorded position over its restarts.

    Parameters
    ----------
    position : NDArray, shape (n,)
        As recorded, in order of time.
    origin : SignalSource
        Its unit and gain.
    """
    known = np.isfinite(position)
    x = position[known]
    if len(x) < 2:
        return Continued(position, "")
    steps = np.diff(x.astype(np.float64))
    for period in _periods(x, origin):
        again = np.abs(np.abs(steps) - period) < _NEARLY * period
        if not again.any() or not _within(x, period):
            continue
        rest = steps - np.where(again, np.sign(steps) * period, 0.0)
        times = f"{np.count_nonzero(again)} times" if np.count_nonzero(again) > 1 else "once"
        said = f"its position starts anew after {period:.6g} ({times})"
        out = np.full(len(position), np.nan)
        if np.mean(np.abs(rest) > _MOST_STEP * period) > _OFTEN:
            return Continued(out, f"{said}, and moves too far between two readings to tell its speed: it is not used")
        out[known] = float(x[0]) + np.r_[0.0, np.cumsum(rest)]
        return Continued(out, f"{said}, and was continued")
    return Continued(position, "")


def _periods(x: NDArray[Any], origin: SignalSource) -> Iterator[float]:
    """Yield what a position may start anew after, in recorded units: one turn, or the size of a counter."""
    quantity, factor = UNITS.get(known_unit(origin.unit) or "", ("", 1.0))
    if quantity == "angle" and origin.gain:
        yield _TURN / abs(factor * origin.gain)
    if x.dtype.kind in "iu" or bool((x == np.rint(x)).all()):
        yield from (2.0**bits for bits in _COUNTERS)


def _within(x: NDArray[Any], period: float) -> bool:
    """Whether a position stays within one period."""
    low, high = np.quantile(x.astype(np.float64), [0.5 * (1.0 - _INSIDE), 0.5 * (1.0 + _INSIDE)])
    return bool(high - low <= period)
