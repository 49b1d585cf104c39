"""What is meant where a yaw rate is another share of the turns that wheels and steering make, all through a mission.

The gyro, a steering angle, the lengths of the machine file and slip stand in the comparison beside the wheels' scale. Others tell some of
them apart: commanded speeds and odometry have the scale of the wheels, a commanded yaw rate the track as the controller has it, and what the
wheels of one unsteered axle differ in a turn is a third measure of the turn beside gyro and steering angle.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.clearing.cells import Array, Cells
from diagnosis.clearing.second_angles import turned_by
from replay.machine.geometry import Geometry

_LEAST_S = 10.0
_EVEN = 0.1  # ln; how much a factor may vary, as a standard deviation of its middle half
_HARDLY = 0.2
_MOVES = 0.3  # of the usual speed, or yaw rate
_AGREES, _AS_ONE = 0.1, 0.15  # ln; of speeds; of turns
_KEPT, _ROUNDS, _FITS = 0.8, 4, 0.4  # of the cells, and what a share may leave of a turn

GYRO, ANGLE = "gyro", "angle"
SECOND_ANGLES = "the second measurement of the angles (steer.*.phi_true)"


class Meant(NamedTuple):
    """What other channels say of a turn that does not fit.

    Attributes
    ----------
    speeds : tuple[str, ...]
        What agrees with the scale of the wheels' speeds, in words.
    part : str
        `GYRO` or `ANGLE`, which alone contradicts the others; empty where that is open.
    by : str
        What tells it, in words.
    track : bool
        Whether the commanded yaw rate agrees with the track.
    """

    speeds: tuple[str, ...] = ()
    part: str = ""
    by: str = ""
    track: bool = False


def meant(
    cells: Cells, v: Array, expected: Array, turning: NDArray[np.bool_], factor: float, agreeing: tuple[str, ...]
) -> Meant:
    """What other channels say where a yaw rate is `factor` times what wheels and steering make.

    Parameters
    ----------
    cells : Cells
        The mission.
    v, expected : Array, shape (cells,)
        Speed of the body by the wheels [m/s], and yaw rate by them and the steering [rad/s].
    turning : NDArray[np.bool_], shape (cells,)
        Where the machine turns.
    factor : float
        Yaw rate by the gyro over that [1].
    agreeing : tuple[str, ...]
        Sensors of the body that have the scale of the wheels' speeds, in words.
    """
    usual = float(np.nanquantile(np.abs(v), 0.95)) if np.isfinite(v).any() else np.inf
    command = factor_of(np.abs(cells.means("cmd.v")), np.abs(v), np.abs(v) > _MOVES * usual, cells.dt)
    speeds = (*(("the commanded speed",) if _near(command, 1.0, _AGREES) else ()), *agreeing)
    asked = factor_of(np.abs(cells.means("cmd.omega")), np.abs(expected), turning, cells.dt)
    if turned_by(cells) is not None:
        return Meant(speeds, ANGLE, SECOND_ANGLES)
    sides = _by_difference(cells, v, expected)
    if sides is None:
        return Meant(speeds, track=_near(asked, 1.0, _AGREES))
    share, by = sides
    part = GYRO if _near(share, 1.0, _AS_ONE) else ANGLE if _near(share, factor, _AS_ONE) else ""
    return Meant(speeds, part, by)


def _near(factor: float | None, other: float, most: float) -> bool:
    return factor is not None and factor > 0.0 and abs(float(np.log(factor / other))) < most


def _by_difference(cells: Cells, v: Array, expected: Array) -> tuple[float, str] | None:
    """Share of an expected turn that left and right wheels of one unsteered axle make, and these in words; None without them, or where that varies."""
    geometry = cells.machine.geometry
    pair = None if geometry is None or not cells.machine.axles else _pair(cells, geometry)
    if geometry is None or pair is None:
        return None
    right, left = pair
    across = geometry.wheels[left].y - geometry.wheels[right].y
    made = (cells.means(f"wheel.{right}.v") - cells.means(f"wheel.{left}.v")) / across
    use = np.isfinite(made) & np.isfinite(expected) & np.isfinite(v)
    if np.count_nonzero(use) * cells.dt < _LEAST_S:
        return None
    table, y = np.column_stack([expected, v])[use], made[use]  # worn tyres differ by a share of the speed
    kept = np.ones(y.size, np.bool_)
    weights: Array = np.zeros(2)
    for _ in range(_ROUNDS):
        weights = np.asarray(np.linalg.lstsq(table[kept], y[kept], rcond=None)[0], dtype=np.float64)
        off = np.abs(y - table @ weights)
        kept = off <= np.quantile(off, _KEPT)
    made_by = weights[0] * table[:, 0]
    if float(np.std((y - table @ weights)[kept])) > _FITS * float(np.std(made_by[kept])):
        return None
    return float(weights[0]), f"the difference of {right} and {left}"


def _pair(cells: Cells, geometry: Geometry) -> tuple[str, str] | None:
    """A right and a left wheel of one axle that is not steered."""
    fixed = [w for w in cells.machine.wheels if w in geometry.wheels and geometry.wheels[w].axle == "fixed"]
    for right in fixed:
        for left in fixed:
            one, other = geometry.wheels[right], geometry.wheels[left]
            if one.y < 0.0 < other.y and one.x == other.x:
                return right, left
    return None


def factor_of(body: Array, wheels: Array, use: NDArray[np.bool_], dt: float) -> float | None:
    """Median of a speed over that by the wheels [1]; None for too little motion, where it varies, and of what hardly moves.

    Parameters
    ----------
    body, wheels : Array, shape (cells,)
        Sizes of both, of one unit.
    use : NDArray[np.bool_], shape (cells,)
        Where they are compared.
    dt : float
        Length of a cell [s].
    """
    use = use & np.isfinite(body) & np.isfinite(wheels) & (wheels > 0.0)
    if np.count_nonzero(use) * dt < _LEAST_S:
        return None
    ratio = np.log(np.maximum(body[use], 1e-9) / wheels[use])
    low, middle, high = np.quantile(ratio, [0.25, 0.5, 0.75])
    if (high - low) / 1.349 > _EVEN or not np.log(_HARDLY) < middle < -np.log(_HARDLY):
        return None
    return float(np.exp(middle))
