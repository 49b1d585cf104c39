"""Rigid-body parity: four wheel speeds and the steering angles agree on one motion of the body, unless a wheel slips.

A wheel whose speed breaks the parity while it obeys its own valve slips, as on ice; whether its sensor has lost gain
cannot be distinguished at that moment.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from replay.arrays.blocks import release
from replay.arrays.column_store import ColumnStore
from replay.arrays.numeric import without_nan
from replay.control.kinematics import low_pass
from replay.machine.geometry import Geometry

Array = NDArray[np.float64]

_SMOOTH_HZ = 1.5
_SHARE = 0.25
_DOUBTFUL_ANGLE = 0.15


@dataclass
class ParityState:
    """Low-passed speed [m/s], last angle [rad] and low-passed turning rate [rad/s] of each wheel in the block before."""

    speed: list[float]
    angle: list[float]
    rate: list[float]


def parity_residuals(
    v: Array,
    ratios: Array,
    wheel_angle: Array,
    geometry: Geometry,
    dt: float,
    state: ParityState | None = None,
) -> Array:
    """Speed of each wheel beyond what the body's motion asks of it.

    Parameters
    ----------
    v : Array, shape (n, wheels)
        Measured speeds [m/s].
    ratios : Array, shape (n, wheels)
        Wheel speed per speed of the body [1], by the measured steering angles.
    wheel_angle : Array, shape (n, wheels)
        Measured wheel angles [rad].
    geometry : Geometry
        Places of the wheels.
    dt : float
        Step [s].
    state : ParityState or None
        Carried from the block before, and updated; None: a whole mission.

    Returns
    -------
    Array, shape (n, wheels)
        Residuals [m/s], smoothed; NaN where a speed or an angle is missing.
    """
    if state is None:
        unknown = [np.nan] * v.shape[1]
        state = ParityState(list(unknown), [float(a) for a in wheel_angle[0]], list(unknown))
    smooth = np.stack([low_pass(v[:, i], dt, _SMOOTH_HZ, state.speed[i]) for i in range(v.shape[1])], axis=1)
    state.speed = [float(x) for x in smooth[-1]]
    for i, w in enumerate(geometry.wheels.values()):
        rate = np.diff(wheel_angle[:, i], prepend=state.angle[i]) / dt
        turning = low_pass(rate, dt, _SMOOTH_HZ, state.rate[i])
        smooth[:, i] += turning * w.offset  # the wheel rolls around its joint while it steers
        state.angle[i], state.rate[i] = float(wheel_angle[-1, i]), float(turning[-1])
    body = _median(smooth / ratios)
    out = smooth - ratios * body[:, None]
    out[~np.isfinite(v)] = np.nan
    return np.asarray(out)


def _median(rows: Array) -> Array:
    """Median of each row, NaN where one number is missing; of four by comparisons alone, which is ten times as fast."""
    if rows.shape[1] != 4:
        return np.asarray(np.median(rows, axis=1))
    a, b, c, d = rows.T
    low = np.maximum(np.minimum(a, b), np.minimum(c, d))
    high = np.minimum(np.maximum(a, b), np.maximum(c, d))
    return np.asarray((low + high) / 2)


def slipping(
    v: Array,
    axle_angle: Array,
    axle_command: Array,
    ratios: Array,
    wheel_angle: Array,
    geometry: Geometry,
    dt: float,
    least: float,
    store: ColumnStore | None = None,
) -> NDArray[np.bool_]:
    """Where a wheel breaks the parity; nowhere while a steering angle is in doubt.

    Parameters
    ----------
    v, wheel_angle : Array, shape (n, wheels)
        Measured speeds [m/s] and wheel angles [rad].
    axle_angle, axle_command : Array, shape (n, axles)
        Measured and commanded angles [rad]; an angle that is further than 0.15 rad from its command is in doubt.
    ratios : Array, shape (n, wheels)
        Wheel speed per speed of the body [1], by the measured angles.
    geometry : Geometry
        Places of the wheels.
    dt : float
        Step [s].
    least : float
        Smallest residual that counts [m/s].
    store : ColumnStore or None
        Where long columns stand; None: one of their own.

    Returns
    -------
    NDArray[np.bool_], shape (n, wheels)
        True where the wheel slips or its speed is wrong.
    """
    unknown = [np.nan] * v.shape[1]
    state = ParityState(list(unknown), [float(a) for a in wheel_angle[0]], list(unknown))
    store = store or ColumnStore()
    out = store.column(np.bool_, v.shape[1:])
    for part in store.blocks(len(v)):
        angle = axle_angle[part]
        residual = parity_residuals(v[part], ratios[part], wheel_angle[part], geometry, dt, state)
        limit = np.maximum(least, _SHARE * np.abs(without_nan(v[part])))
        doubtful = np.asarray((np.abs(angle - axle_command[part]) > _DOUBTFUL_ANGLE).any(axis=1))
        with np.errstate(invalid="ignore"):
            out.append((np.abs(residual) > limit) & ~doubtful[:, None])
        release(v, axle_angle, axle_command, ratios, wheel_angle)
    return out.finish()
