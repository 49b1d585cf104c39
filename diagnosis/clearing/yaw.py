"""The yaw rate against that by the steering angles: an angle that is off its sensor's by an offset or a scale turns the machine."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.clearing.cells import Array, Cells
from diagnosis.clearing.measure import lasts, worst
from diagnosis.results.clearing import Check, Checked
from diagnosis.results.vocabulary import Kind
from replay.faults import Side

_FIXED = "fixed"  # axle of wheels that are not steered
_STILL, _STILL_S = 0.01, 1.0  # m/s; at rest for this long, a gyro shows its bias
_MOVING = 0.25  # of the top speed
OFF = 1.5  # times the offset that counts, for three seconds
_ASKED = np.pi / 2  # rad: from here on no offset is asked for
_STRAIGHT, _SHORTEST = 0.08, 0.1  # rad, m
_LEAST_S = 6.0  # of driving straight
ANSWERED = 0.7  # of an angle by which one axle alone is off: tyres give way sideways


def yaw_checks(cells: Cells) -> Iterator[Checked]:
    """Checks of both ends of a machine together, which take a yaw rate, two axles of which one is steered at least, and some driving straight.

    In turns tyres and the wheels' offsets make the angles an approximation. Without all that, an axle whose angle is not measured
    twice stays open.
    """
    straight, part, limit = off_straight(cells), Side.SENSOR_OR_ACTUATOR, cells.machine.limits.clear_offset
    if straight is None:
        known, second = (np.atleast_1d(np.isfinite(cells.axles(leaf)).any(axis=0)) for leaf in ("phi", "phi_true"))
        for axle, once in zip(cells.machine.axles, known & ~second, strict=True):
            if once and limit < _ASKED:
                yield Checked(Kind.STEER, axle, Side.SENSOR, Check.LASTING_YAW, None, limit)
        return
    windows, lasting = np.abs(cells.frame.mean(straight)), abs(float(np.nanmedian(straight)))
    for axle in cells.machine.axles:
        if np.isfinite(windows).any():
            yield worst(cells, (Kind.STEER, axle, part, Check.YAW), windows, OFF * limit)
        yield lasts(cells, (Kind.STEER, axle, part, Check.LASTING_YAW), lasting, limit)


def off_straight(cells: Cells) -> Array | None:
    """By how much the path is off that by the angles [rad], NaN but where they point straight, shape (cells,); None for too little."""
    off = _off_angles(cells)
    if off is None:
        return None
    straight = np.where(off.straight, off.angle, np.nan)
    return straight if np.count_nonzero(np.isfinite(straight)) * cells.dt >= _LEAST_S else None


class _Off(NamedTuple):
    """By how much the path is off that by the angles, as an angle of one axle [rad], and where they point straight, shape (cells,)."""

    angle: Array
    straight: NDArray[np.bool_]


def _off_angles(cells: Cells) -> _Off | None:
    """How far the machine is off where its angles point; NaN where it is too slow. None without yaw rate, or an axle's angle."""
    geometry, axles = cells.machine.geometry, cells.machine.axles
    yaw = cells.means("imu.yaw_rate")
    if geometry is None or not np.isfinite(yaw).any():
        return None
    fixed = [_FIXED] if any(w.axle == _FIXED for w in geometry.wheels.values()) else []
    if not axles or len(axles) + len(fixed) != 2:
        return None
    places = [float(np.mean([w.x for w in geometry.wheels.values() if w.axle == axle])) for axle in (*axles, *fixed)]
    length, angle, speeds = places[0] - places[1], cells.axles("phi"), cells.wheels("v")
    if fixed:
        angle = np.column_stack((angle, np.zeros(len(angle))))
    if abs(length) < _SHORTEST or not np.isfinite(angle).any(axis=0).all():
        return None
    known = np.asarray(np.isfinite(speeds).any(axis=1))
    speed = np.nanmedian(np.where(known[:, np.newaxis], speeds, 0.0), axis=1)
    rest = known & (np.abs(speed) < _STILL) & np.isfinite(yaw)
    bias = float(np.median(yaw[rest])) if np.count_nonzero(rest) * cells.dt >= _STILL_S else 0.0
    moving = np.abs(speed) > _MOVING * cells.machine.max_speed
    turn = np.tan(angle[:, 0]) - np.tan(angle[:, 1])
    with np.errstate(divide="ignore", invalid="ignore"):
        off = np.where(moving, (yaw - bias) / speed * length - turn, np.nan)
    return _Off(off, np.abs(turn) < _STRAIGHT)
