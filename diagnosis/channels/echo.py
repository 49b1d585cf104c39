"""A speed that is its command, to the last digit: odometry of some robots publishes what was asked for, and measures nothing.

What is measured has ramps, noise, and steps of its own; a copy of the command has none of them, and holds one value for as long as it is asked for.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.assessment import CODE, Assessment, Lack, Reason
from diagnosis.results.vocabulary import Tier
from replay.arrays.quantiles import median_of
from replay.faults import State
from replay.machine.config import Limits

Array = NDArray[np.float64]

_BEFORE_S, _AFTER_S = (
    2.0,
    0.3,
)  # a copy of a command is published so much later, and on the recorder's clock a little earlier
_SAME = 1e-5  # of the largest command: single precision, and a product with the radius
_NEARLY_ALL = 0.98  # of the readings in motion: a coarse sensor meets the command while it rests, and not in ramps
_LEAST, _LEAST_CHANGES = 40, 2  # readings in motion; times that a command changes meanwhile
_MANY = 5  # values of the command about one reading
_LOOKED_AT = 1000  # readings or values at a time
_FEW = 2  # speeds that are ever asked for: what is measured meets none of them for so long
REASON = Reason(
    "its readings are the commanded speeds themselves, to the last digit and without a ramp: it publishes what was asked for, or a simulation does, "
    "and measures nothing",
    Lack.ECHO,
)


def repeats_its_command(y: Array, fresh: NDArray[np.bool_], asked: Array, limits: Limits, dt: float) -> bool:
    """Whether a measured speed takes no value in motion but those that its command has about that time.

    Parameters
    ----------
    y, asked : Array, shape (n,)
        Measured and commanded speed [m/s]; NaN where not known.
    fresh : NDArray[np.bool_], shape (n,)
        Steps with a new sample of y.
    limits : Limits
        ``driving_speed``.
    dt : float
        Step [s].
    """
    at = np.flatnonzero(fresh & np.isfinite(y) & (np.abs(y) > limits.driving_speed))
    known = _held(asked)  # a command that came once holds
    largest = float(np.max(np.abs(known), initial=0.0))
    if at.size < _LEAST or largest <= 0.0:
        return False
    changes = np.diff(known, prepend=np.nan) != 0.0
    first = np.flatnonzero(changes)  # of each value that the command has
    if first.size <= _LEAST_CHANGES:
        return False
    own = known[first][np.abs(known[first]) > limits.driving_speed]
    if not own.size:
        return False
    if (
        np.unique(own[:_LOOKED_AT]).size <= _FEW  # where these are not few, all are not
        and (own := np.unique(own)).size <= _FEW
        and np.count_nonzero(np.diff(np.abs(y[fresh & np.isfinite(y)]) > limits.driving_speed)) >= _LEAST_CHANGES
    ):
        apart = np.min(
            np.abs(y[at, np.newaxis] - own), axis=1
        )  # of whatever of them it was told: another command may be its own
        return bool(np.mean(apart <= _SAME * largest) >= _NEARLY_ALL)
    early, late = (np.clip(at + round(s / dt), 0, known.size - 1) for s in (-_BEFORE_S, _AFTER_S))
    value = np.cumsum(changes) - 1  # which of them holds at a step
    start, stop = value[early], value[late]
    if median_of(stop - start) > _MANY and not _fine(y[at]):  # steps of both are the same, and any of them is met
        return False
    met = at.size
    for part in (slice(i, i + _LOOKED_AT) for i in range(0, at.size, _LOOKED_AT)):
        meets = np.zeros(at[part].size, np.bool_)
        for k in range(int((stop - start)[part].max()) + 1):
            there = np.minimum(start[part] + k, stop[part])
            meets |= np.abs(y[at[part]] - known[first[there]]) <= _SAME * largest
        met -= int(np.count_nonzero(~meets))
        if met / at.size < _NEARLY_ALL:
            return False
    return True


def _fine(y: Array) -> bool:
    """Whether a reading hardly ever comes back to a value that it had before."""
    ordered = np.sort(y)
    values = 1 + np.count_nonzero(ordered[1:] != ordered[:-1])
    return bool(values >= 0.5 * np.count_nonzero(np.diff(y)))


def _held(x: Array) -> Array:
    """Each value until the next one, 0 before the first, shape (n,)."""
    last = np.maximum.accumulate(np.where(np.isfinite(x), np.arange(x.size), -1))
    return np.where(last >= 0, x[np.maximum(last, 0)], 0.0)


def not_measured(y: Array, asked: Array, limits: Limits, name: str) -> tuple[Assessment, Assessment]:
    """Sensor and drive of a speed that measures nothing: neither is judged.

    Parameters
    ----------
    y, asked : Array, shape (n,)
        Measured and commanded speed [m/s].
    limits : Limits
        ``driving_speed``.
    name : str
        Of the channel.
    """
    moves = np.maximum(np.abs(np.nan_to_num(y)), np.abs(_held(asked))) > limits.driving_speed
    states = np.where(moves, CODE[State.NOT_ASSESSED], CODE[State.NOT_EXCITED]).astype(np.int8)
    states[~np.isfinite(y)] = CODE[State.NO_DATA]
    reasons = {State.NOT_EXCITED: "nothing is commanded", State.NO_DATA: "no samples"}
    note = f"{name} repeats its command to the last digit."
    both = Assessment(states, reasons, (), {}, Tier.TRACKING, (note,)).reasoned(State.NOT_ASSESSED, REASON)
    return both, both
