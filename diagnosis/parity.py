"""Rigid-body parity: four wheel speeds and the steering angles agree on one motion of the body, unless a wheel slips.

A wheel whose speed breaks the parity while it obeys its own valve slips, as on ice; whether its sensor has lost gain
cannot be told at that moment.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from replay.geometry import Geometry
from replay.kinematics import low_pass, speed_ratios

Array = NDArray[np.float64]

_SMOOTH_HZ = 1.5
_SHARE = 0.25
_DOUBTFUL_ANGLE = 0.15


def parity_residuals(v: Array, axle_angle: Array, wheel_angle: Array, geometry: Geometry, dt: float) -> Array:
    """Speed of each wheel beyond what the body's motion asks of it.

    Parameters
    ----------
    v : Array, shape (n, wheels)
        Measured speeds [m/s].
    axle_angle, wheel_angle : Array, shape (n, axles) and (n, wheels)
        Measured steering angles [rad].
    geometry : Geometry
        Places of the wheels.
    dt : float
        Step [s].

    Returns
    -------
    Array, shape (n, wheels)
        Residuals [m/s], smoothed; NaN where a speed or an angle is missing.
    """
    ratios = speed_ratios(axle_angle, geometry)
    smooth = np.stack([low_pass(v[:, i], dt, _SMOOTH_HZ) for i in range(v.shape[1])], axis=1)
    for i, w in enumerate(geometry.wheels.values()):
        turning = low_pass(np.diff(wheel_angle[:, i], prepend=wheel_angle[:1, i]) / dt, dt, _SMOOTH_HZ)
        smooth[:, i] += turning * w.offset  # the wheel rolls around its joint while it steers
    body = np.median(smooth / ratios, axis=1)
    out = smooth - ratios * body[:, None]
    out[~np.isfinite(v)] = np.nan
    return np.asarray(out)


def slipping(
    v: Array,
    axle_angle: Array,
    axle_command: Array,
    wheel_angle: Array,
    geometry: Geometry,
    dt: float,
    least: float,
) -> NDArray[np.bool_]:
    """Where a wheel breaks the parity; nowhere while a steering angle is in doubt.

    Parameters
    ----------
    v, wheel_angle : Array, shape (n, wheels)
        Measured speeds [m/s] and wheel angles [rad].
    axle_angle, axle_command : Array, shape (n, axles)
        Measured and commanded angles [rad]; an angle that is further than 0.15 rad from its command is in doubt.
    geometry : Geometry
        Places of the wheels.
    dt : float
        Step [s].
    least : float
        Smallest residual that counts [m/s].

    Returns
    -------
    NDArray[np.bool_], shape (n, wheels)
        True where the wheel slips or its speed is wrong.
    """
    residual = parity_residuals(v, axle_angle, wheel_angle, geometry, dt)
    limit = np.maximum(least, _SHARE * np.abs(np.nan_to_num(v)))
    doubtful = np.asarray((np.abs(axle_angle - axle_command) > _DOUBTFUL_ANGLE).any(axis=1))
    with np.errstate(invalid="ignore"):
        return np.asarray((np.abs(residual) > limit) & ~doubtful[:, None])
