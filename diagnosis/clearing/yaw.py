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
from replay.machine.config import Machine

_FIXED = "fixed"  # axle of wheels that are not steered
_STILL, _STILL_S = 0.01, 1.0  # m/s; at rest for this long, a gyro shows its bias
_MOVING = 0.25  # of the top speed
OFF, LASTING_OFF = 0.06, 0.04  # rad
_STRAIGHT, _SHORTEST = 0.08, 0.1  # rad, m
_LEAST_S = 6.0  # of driving straight, or of driving
_OF_TURN = 0.15  # of a turn, by which its path may be off that by the angles
ANSWERED = 0.7  # of an angle by which one axle alone is off: tyres give way sideways


def yaw_checks(cells: Cells) -> Iterator[Checked]:
    """Checks of both ends of a machine together; none without a yaw rate, two axles of which one is steered at least, and some driving.

    In turns tyres and the wheels' offsets make the angles an approximation: by a share of the turn that counts for nothing. They are looked
    at where a mission has hardly any driving straight.
    """
    straight, part = off_straight(cells), Side.SENSOR_OR_ACTUATOR
    straight = _off_in_turns(cells) if straight is None else straight
    if straight is None:
        return
    windows, lasting = np.abs(cells.frame.mean(straight)), abs(float(np.nanmedian(straight)))
    for end in _ends(cells.machine).values():
        for axle in (name for name in end if name != _FIXED):  # one wheel's angle is a share of the mean of its end
            if np.isfinite(windows).any():
                yield worst(cells, (Kind.STEER, axle, part, Check.YAW), len(end) * windows, OFF)
            yield lasts(cells, (Kind.STEER, axle, part, Check.LASTING_YAW), len(end) * lasting, LASTING_OFF)


def off_straight(cells: Cells) -> Array | None:
    """By how much the path is off that by the angles [rad], NaN but where they point straight, shape (cells,); None for too little."""
    off = _off_angles(cells)
    if off is None:
        return None
    straight = np.where(off.straight, off.angle, np.nan)
    return straight if np.count_nonzero(np.isfinite(straight)) * cells.dt >= _LEAST_S else None


def _off_in_turns(cells: Cells) -> Array | None:
    """The same wherever the machine moves, less what a turn may put in, shape (cells,); None for too little."""
    off = _off_angles(cells)
    if off is None or np.count_nonzero(np.isfinite(off.angle)) * cells.dt < _LEAST_S:
        return None
    return np.asarray(np.sign(off.angle) * np.maximum(np.abs(off.angle) - _OF_TURN * np.abs(off.turn), 0.0))


def _ends(machine: Machine) -> dict[float, list[str]]:
    """Axles by their place [m]: wheels that are steered one by one are one where they stand side by side."""
    ends: dict[float, list[str]] = {}
    wheels = machine.geometry.wheels.values() if machine.geometry is not None else ()
    for axle in (*machine.axles, *dict.fromkeys(w.axle for w in wheels if w.axle == _FIXED)):
        x = float(np.mean([w.x for w in wheels if w.axle == axle]))
        ends.setdefault(next((e for e in ends if abs(e - x) < _SHORTEST), x), []).append(axle)
    return ends


class _Off(NamedTuple):
    """By how much the path is off that by the angles, as an angle of one axle [rad], their turn likewise, and where they point straight, shape (cells,)."""

    angle: Array
    turn: Array
    straight: NDArray[np.bool_]


def _off_angles(cells: Cells) -> _Off | None:
    """How far the machine is off where its angles point; NaN where it is too slow. None without yaw rate, or an axle's angle."""
    geometry, axles = cells.machine.geometry, cells.machine.axles
    yaw = cells.means("imu.yaw_rate")
    if geometry is None or not np.isfinite(yaw).any():
        return None
    ends = _ends(cells.machine)
    if not axles or len(ends) != 2:
        return None
    (first, one), (last, other) = ends.items()
    length, angles, speeds = first - last, cells.axles("phi"), cells.wheels("v")
    by_name = {**dict(zip(axles, angles.T, strict=True)), _FIXED: np.zeros(len(angles))}
    if any(not np.isfinite(by_name[name]).any() for name in (*one, *other)):
        return None
    angle = np.column_stack([np.mean([by_name[name] for name in end], axis=0) for end in (one, other)])
    known = np.asarray(np.isfinite(speeds).any(axis=1))
    speed = np.nanmedian(np.where(known[:, np.newaxis], speeds, 0.0), axis=1)
    rest = known & (np.abs(speed) < _STILL) & np.isfinite(yaw)
    bias = float(np.median(yaw[rest])) if np.count_nonzero(rest) * cells.dt >= _STILL_S else 0.0
    moving = np.abs(speed) > _MOVING * cells.machine.max_speed
    turn = np.tan(angle[:, 0]) - np.tan(angle[:, 1])
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        off = np.where(moving, (yaw - bias) / speed * length - turn, np.nan)
    return _Off(off, turn, np.abs(turn) < _STRAIGHT)
