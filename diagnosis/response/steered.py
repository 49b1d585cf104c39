"""The only drive of a machine sits on a wheel that steers: it rolls along its own direction, faster than the body drives."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.evidence import MissionView
from diagnosis.response.tracking import estimate_lag

Array = NDArray[np.float64]

_MOST = 1.3  # rad: beyond that the wheel stands across, and its speed says nothing of the body's
_BETTER = 0.9  # of the misfit that is left without it
_LEAST_S = 10.0


def stretch_of(mission: MissionView, wheel: str) -> Array | None:
    """How much faster than the body the only wheel rolls, 1/cos φ by its measured steering angle, shape (n,); None where it does not steer.

    Parameters
    ----------
    mission : MissionView
        The mission.
    wheel : str
        Its wheel.
    """
    geometry = mission.machine.geometry
    if len(mission.machine.wheels) != 1 or geometry is None or wheel not in geometry.wheels:
        return None
    angle = f"steer.{geometry.wheels[wheel].axle}.phi"
    if geometry.wheels[wheel].axle == "fixed" or not mission.logged(angle):
        return None
    phi = np.nan_to_num(mission.values(angle))
    return np.asarray(1.0 / np.cos(np.clip(phi, -_MOST, _MOST)))


def stretched(y: Array, asked: Array, stretch: Array | None, driving_speed: float, dt: float) -> Array:
    """What is asked of a wheel: the command itself, or that of the body along the wheel, whichever its speed is nearer to; shape (n,).

    Parameters
    ----------
    y, asked : Array, shape (n,)
        Measured and commanded speed [m/s].
    stretch : Array or None, shape (n,)
        Of `stretch_of`.
    driving_speed : float
        Speed from which a drive is driving [m/s].
    dt : float
        Step [s].
    """
    if stretch is None or not np.isfinite(asked).any() or not np.isfinite(y).any():
        return asked
    lag = estimate_lag(y, asked, dt)
    left = []
    for x in (asked, asked * stretch):
        told = np.r_[np.full(lag, np.nan), x[: x.size - lag]]
        use = (
            np.isfinite(y) & (np.abs(np.nan_to_num(told)) > driving_speed) & (np.abs(np.nan_to_num(y)) > driving_speed)
        )
        if np.count_nonzero(use) * dt < _LEAST_S:
            return asked
        share = float(np.median(y[use] / told[use]))
        left.append(float(np.median(np.abs(y[use] - share * told[use]))))
    return np.asarray(asked * stretch) if left[1] < _BETTER * left[0] else asked
