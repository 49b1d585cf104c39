"""Speeds that tell no direction, as those of encoders that only count pulses: they are read with the direction of their command."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_REVERSED_S = 2.0  # commanded backwards, and moving: so long shows whether a speed has a sign
_BELOW = 0.005  # of the readings may be below 0, as noise at standstill is
_MOVES = 0.5  # of that time
_ALIKE = 0.35  # median misfit beside the command's size, of that size
_TURNS_S = 2.0  # within which a drive has stopped and turned round


def without_direction(y: Array, asked: Array, driving_speed: float, dt: float) -> bool:
    """Whether a speed is never below 0 although its command is, and it moves then as much as it is told to.

    Parameters
    ----------
    y, asked : Array, shape (n,)
        Measured and commanded speed [m/s].
    driving_speed : float
        Speed from which a drive is driving [m/s].
    dt : float
        Step [s].
    """
    known = np.isfinite(y) & np.isfinite(asked)
    late = round(_TURNS_S / dt)
    back = known & _held(np.nan_to_num(asked) < -driving_speed, late)
    if np.count_nonzero(back) * dt < _REVERSED_S:
        return False
    if np.mean(y[known] < -0.2 * driving_speed) > _BELOW or np.mean(y[back] > driving_speed) < _MOVES:
        return False
    size = np.abs(asked[back])
    return bool(np.median(np.abs(y[back] - size)) < _ALIKE * np.median(size))


def _held(there: Flags, steps: int) -> Flags:
    """Where something has held for some steps, shape (n,)."""
    since = np.arange(there.size) - np.maximum.accumulate(np.where(there, -1, np.arange(there.size)))
    return np.asarray(since > steps)


def directed(y: Array, asked: Array, dt: float) -> Array:
    """A speed that tells no direction with that of its command, shape (n,): it turns round where it is least after the command does.

    Parameters
    ----------
    y, asked : Array, shape (n,)
        Measured and commanded speed [m/s].
    dt : float
        Step [s].
    """
    told = np.sign(np.nan_to_num(asked))
    places = np.flatnonzero(told)
    if not places.size:
        return y
    sign, reach = np.ones(y.size), round(_TURNS_S / dt)
    now, since = told[places[0]], 0
    for k in places[1:][np.diff(told[places]) != 0.0].tolist():
        window = np.nan_to_num(np.abs(y[k : k + reach]), nan=np.inf)
        turn = k + int(np.argmin(window))
        sign[since:turn] = now
        now, since = told[k], turn
    sign[since:] = now
    return np.asarray(np.abs(y) * sign)
