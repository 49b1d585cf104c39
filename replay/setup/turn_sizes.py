"""How much a machine turns by its gyro beside what the wheels' difference makes over the track that the machine file gives."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from replay.machine.config import Machine
from replay.setup.places import measured_turns
from replay.signals.timeline import Timeline

Array = NDArray[np.float64]

_SMOOTH_S = 1.0  # noise of two wheels over a narrow track is no turn
_TURNS, _LEAST_TURN = 0.3, 0.05  # of the usual turn; [rad/s]
_LEAST_S = 10.0  # of turning
_LEAST_YAW, _LEAST_MADE = 0.2, 0.02  # rad/s: a bias of the gyro, and noise of the wheels, are less
_FITS = 0.2  # of the yaw rate: what one share of the wheels' turn may leave of it (median)
_MOST, _LEAST = 1.6, 0.2  # of the wheels' turn: tyres that slip make it less, nothing makes it more
_FAR_MORE = 3.0  # times the wheels' turn: no ground turns a machine further than its wheels
_ONE_VALUE = 0.98  # of the time, in which a dead gyro gives one value


def turn_size_doubt(line: Timeline, machine: Machine) -> str:
    """A sentence where the gyro turns otherwise than the wheels by more than tyres that slip make of it; empty where it does not, or little is known.

    Parameters
    ----------
    line : Timeline
        The mission.
    machine : Machine
        With the places of its wheels.
    """
    found = measured_turns(line, machine)
    if found is None:
        return ""
    made, yaw, track, dt = found
    made, yaw = (_smoothed(x, max(1, round(_SMOOTH_S / dt))) for x in (made, yaw))
    known = np.isfinite(made) & np.isfinite(yaw)
    made, yaw = made[known], yaw[known]
    if not made.size:
        return ""
    clear = np.abs(made) > max(_TURNS * float(np.quantile(np.abs(made), 0.9)), _LEAST_TURN)
    if np.count_nonzero(clear) * dt < _LEAST_S:
        return ""
    if float(np.mean(yaw == np.median(yaw))) > _ONE_VALUE:
        most = float(np.quantile(np.abs(made[clear]), 0.9))
        return f"imu.yaw_rate gives nothing while the wheels' speeds turn the machine at up to {most:.2g} rad/s: a dead gyro, or another axis of it"
    size = np.abs(yaw)
    clear = size > max(_TURNS * float(np.quantile(size, 0.9)), _LEAST_YAW)
    if np.count_nonzero(clear) * dt < _LEAST_S:
        return ""
    by_size = float(np.median(size[clear])) / max(float(np.median(np.abs(made[clear]))), 1e-9)
    told = clear & (np.abs(made) > _LEAST_MADE)
    share = float(np.median(yaw[told] / made[told])) if np.count_nonzero(told) * dt >= _LEAST_S else 0.0
    fits = bool(share) and float(np.median(np.abs(yaw - share * made)[told])) <= _FITS * float(np.median(size[told]))
    if fits and share < 0.0:
        return "imu.yaw_rate turns against the wheels: its sign is wrong, or left and right are exchanged"
    if not by_size > _FAR_MORE and not (fits and not _LEAST <= share <= _MOST):
        return ""
    more = share if fits else by_size
    other = f"another track (it would be {track / more:.2g} m), " if fits else ""
    return (
        f"imu.yaw_rate is {more:.2g} × what the wheels' speeds make over their track of {track:.3g} m: {other}a wrong place of the wheels, "
        "or a wrong unit of the gyro or of the speeds"
    )


def _smoothed(x: Array, width: int) -> Array:
    """Moving mean of what is known, shape of `x`; NaN where less than half is."""
    known = np.isfinite(x)
    kernel = np.ones(width)
    count = np.convolve(known.astype(np.float64), kernel, mode="same")
    total = np.convolve(np.where(known, x, 0.0), kernel, mode="same")
    return np.where(count >= 0.5 * width, total / np.maximum(count, 1.0), np.nan)
