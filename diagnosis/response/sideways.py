"""Whether a machine goes sideways on rollers, by its wheels alone: front and rear wheels of both sides differ by the same, with opposite signs.

The target of a wheel with rollers is v_x ∓ v_y ∓ ω (l + w), so that v_FL − v_RL = −(v_FR − v_RR) whatever the machine does; wheels without
rollers do that only in passing, and a sensor that is wrong sets the wheels of one side apart alone.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from replay.machine.geometry import Geometry

Array = NDArray[np.float64]

_APART, _TOGETHER = 0.15, 0.25  # of the top speed; residual by the difference
_MOSTLY, _LEAST_S = (
    0.3,
    4.0,
)  # of the time in which wheels of a side differ, one that is wrong included, and how long it must be

_TURNS_WITH = 0.9  # correlation with the yaw rate


def goes_sideways(means: Mapping[str, Array], geometry: Geometry | None, block_s: float) -> bool:
    """Whether four fixed wheels, two of each side, move as those with rollers do when the machine goes sideways.

    Parameters
    ----------
    means : Mapping[str, Array]
        Speed of each wheel by blocks, shape (b,) [m/s].
    geometry : Geometry or None
        Says where the wheels are; without it nothing can be told.
    block_s : float
        Length of a block [s].
    """
    splits = _splits(means, geometry)
    if splits is None:
        return False
    left, right = splits
    known = np.isfinite(left) & np.isfinite(right)
    top = max((float(np.nanquantile(np.abs(m), 0.95)) for m in means.values() if np.isfinite(m).any()), default=0.0)
    apart = known & (np.maximum(np.abs(left), np.abs(right)) > _APART * top)
    alike = np.abs(left + right)[apart] < _TOGETHER * np.abs(left - right)[apart]
    number = np.count_nonzero(alike)
    return bool(number * block_s >= _LEAST_S and number >= _MOSTLY * alike.size)


def crossed(means: Mapping[str, Array], geometry: Geometry | None, yaw: Array | None) -> bool:
    """Whether front and rear wheels of a side differ as the machine turns: wheels of one axle that are exchanged do, none that goes sideways.

    Parameters
    ----------
    means : Mapping[str, Array]
        Speed of each wheel by blocks, shape (b,) [m/s].
    geometry : Geometry or None
        Says where the wheels are; without it nothing can be told.
    yaw : Array or None, shape (b,)
        Measured yaw rate [rad/s].
    """
    splits = _splits(means, geometry)
    if splits is None or yaw is None:
        return False
    known = np.isfinite(splits[0]) & np.isfinite(splits[1]) & np.isfinite(yaw)
    apart = (splits[0] - splits[1])[known]
    if not apart.size or min(np.ptp(apart), np.ptp(yaw[known])) == 0.0:
        return False
    return bool(abs(np.corrcoef(apart, yaw[known])[0, 1]) > _TURNS_WITH)


def _splits(means: Mapping[str, Array], geometry: Geometry | None) -> tuple[Array, Array] | None:
    """By how much the front wheel of each side is faster than the rear one [m/s]; None without two fixed wheels a side."""
    if geometry is None:
        return None
    placed = {w: geometry.wheels[w] for w in means if w in geometry.wheels and geometry.wheels[w].axle == "fixed"}
    sides = [sorted((w for w in placed if placed[w].y * side > 0.0), key=lambda w: placed[w].x) for side in (1.0, -1.0)]
    if any(len(s) != 2 or placed[s[0]].x == placed[s[1]].x for s in sides):
        return None
    left, right = (means[front] - means[rear] for rear, front in sides)
    return left, right
