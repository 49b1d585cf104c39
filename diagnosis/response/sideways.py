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
    if geometry is None:
        return False
    placed = {w: geometry.wheels[w] for w in means if w in geometry.wheels and geometry.wheels[w].axle == "fixed"}
    sides = [sorted((w for w in placed if placed[w].y * side > 0.0), key=lambda w: placed[w].x) for side in (1.0, -1.0)]
    if any(len(s) != 2 or placed[s[0]].x == placed[s[1]].x for s in sides):
        return False
    left, right = (means[front] - means[rear] for rear, front in sides)
    known = np.isfinite(left) & np.isfinite(right)
    top = max((float(np.nanquantile(np.abs(m), 0.95)) for m in means.values() if np.isfinite(m).any()), default=0.0)
    apart = known & (np.maximum(np.abs(left), np.abs(right)) > _APART * top)
    alike = np.abs(left + right)[apart] < _TOGETHER * np.abs(left - right)[apart]
    number = np.count_nonzero(alike)
    return bool(number * block_s >= _LEAST_S and number >= _MOSTLY * alike.size)
