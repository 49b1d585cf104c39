"""The yaw rate against that by the steering angles: an angle that is off its sensor's by an offset or a scale turns the machine.

Where no yaw rate is logged, wheels of both sides may tell it: they deny that an angle is right, and do not say that it is, for wheels
that are held at their references slip instead.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.clearing.cells import Array, Cells
from diagnosis.clearing.measure import lasts, worst
from diagnosis.results.clearing import Check, Checked
from diagnosis.results.vocabulary import Kind
from replay.arrays.quantiles import median_known, median_of
from replay.faults import Side
from replay.machine.config import Machine
from replay.machine.geometry import Geometry

_FIXED, _ENDS = "fixed", 2  # axle of wheels that are not steered; ends of a machine
_STILL, _STILL_S = 0.01, 1.0  # m/s; at rest for this long, a gyro shows its bias
_MOVING = 0.25  # of the top speed
OFF, LASTING_OFF = 0.06, 0.04  # rad
_OFF_BY_WHEELS = (
    0.12  # rad, of windows: on straight ways wheels that slip differ for a moment, up to 0.09 on tuning machines
)
_STRAIGHT, _SHORTEST = 0.08, 0.1  # rad, m
_SIDES = 0.06  # of the speed, by which sound wheels of the sides differ
_TURNS = 0.1  # difference of the ends' tangents, from which on offsets of the angles are a small part of it
_LEAST_S = 6.0  # of driving straight, or of driving
_OF_TURN = 0.15  # of a turn, by which its path may be off that by the angles
ANSWERED = 0.7  # of an angle by which one axle alone is off: tyres give way sideways


def yaw_checks(cells: Cells) -> Iterator[Checked]:
    """Checks of both ends of a machine together; none without a yaw rate, two axles of which one is steered at least, and some driving.

    In turns tyres and the wheels' offsets make the angles an approximation: by a share of the turn that counts for nothing. They are looked
    at where a mission has hardly any driving straight, and over all of it where a yaw rate is logged: an angle that drifts off points
    straight no more.
    """
    off = _off_angles(cells)
    if off is None:
        return
    straight = off.straight_ways(cells)
    looked_at = off.in_turns(cells) if straight is None else straight
    if looked_at is None:
        return
    windows, lasting = np.abs(cells.frame.mean(looked_at)), abs(float(median_known(looked_at)))
    turns = None if off.by_wheels else off.in_turns(cells)
    lasting = lasting if turns is None else max(lasting, abs(float(median_known(turns))))
    told = bool(np.isfinite(windows).any()) and not (off.by_wheels and straight is None)  # in turns wheels slip
    sides = _by_sound_wheels(cells.machine) if off.by_wheels else 0.0
    for end in turning_ends(cells.machine).values():
        for axle in (name for name in end if name != _FIXED):  # one wheel's angle is a share of the mean of its end
            about, share = (Kind.STEER, axle, Side.SENSOR_OR_ACTUATOR), len(end)
            most, most_lasting = (max(limit, share * sides) for limit in (off.most, LASTING_OFF))
            found = [worst(cells, (*about, Check.YAW), share * windows, most)] if told else []
            found.append(lasts(cells, (*about, Check.LASTING_YAW), share * lasting, most_lasting))
            yield from (c for c in found if not (off.by_wheels and c.passed))


def _by_sound_wheels(machine: Machine) -> float:
    """Angle [rad] by which a machine seems to turn whose sides' speeds differ by as much as sound wheels' may: tyres wear, and drives differ."""
    ends = turning_ends(machine)
    wheels = [] if machine.geometry is None else list(machine.geometry.wheels.values())
    across = max((w.y for w in wheels), default=0.0) - min((w.y for w in wheels), default=0.0)
    return _SIDES * (max(ends) - min(ends)) / across if across > _SHORTEST else 0.0


def off_straight(cells: Cells) -> Array | None:
    """By how much the measured path is off that by the angles [rad], NaN but where they point straight, shape (cells,); None for too little."""
    off = _off_angles(cells)
    return None if off is None or off.by_wheels else off.straight_ways(cells)


def ends_of(machine: Machine) -> dict[float, list[str]]:
    """Axles by their place [m]: wheels that are steered one by one are one where they stand side by side."""
    ends: dict[float, list[str]] = {}
    wheels = machine.geometry.wheels.values() if machine.geometry is not None else ()
    for axle in (*machine.axles, *dict.fromkeys(w.axle for w in wheels if w.axle == _FIXED)):
        x = float(np.mean([w.x for w in wheels if w.axle == axle]))
        ends.setdefault(next((e for e in ends if abs(e - x) < _SHORTEST), x), []).append(axle)
    return ends


def turning_ends(machine: Machine) -> dict[float, list[str]]:
    """The two ends whose angles turn a machine, by their place [m]; as many as there are of one that has fewer.

    Where more axles than two are, the outer ones of those that are steered, or the only steered one and the middle of those that are not.
    """
    ends = ends_of(machine)
    if len(ends) <= _ENDS:
        return ends
    steered = {x: names for x, names in ends.items() if names != [_FIXED]}
    if len(steered) == 1:
        return {**steered, float(np.mean([x for x in ends if x not in steered])): [_FIXED]}
    return {x: steered[x] for x in (max(steered), min(steered))}


def yaw_by_wheels(cells: Cells) -> Array:
    """Yaw rate that the wheels' speeds have at the end of the machine where they differ less [rad/s], NaN where none has two sides, shape (cells,).

    A wheel that reads another speed than it has is at one end alone, and the machine turns at both.
    """
    geometry, speeds = cells.machine.geometry, dict(zip(cells.machine.wheels, cells.wheels("v").T, strict=True))
    rates = []
    for end in ends_of(cells.machine).values():
        placed = [(geometry.wheels[w].y, v) for w, v in speeds.items() if geometry and geometry.wheels[w].axle in end]
        left, right = ([(y, v) for y, v in placed if side * y > _SHORTEST] for side in (1.0, -1.0))
        if left and right:
            (y, v), (z, u) = ([np.mean(x, axis=0) for x in zip(*of, strict=True)] for of in (left, right))
            rates.append((u - v) / (y - z))
    if len(rates) < 2:
        return np.full(cells.size, np.nan)
    both = np.column_stack(rates)
    return np.asarray(np.take_along_axis(both, np.abs(both).argmin(axis=1)[:, np.newaxis], axis=1)[:, 0])


def turn_by_angles(cells: Cells) -> tuple[Array, Array] | None:
    """Measured yaw rate without its bias, and that by angles and speed, while the machine turns [rad/s], each of shape (cells,), NaN elsewhere.

    Without axles of which a fault is stated. None where no yaw rate is logged, or an axle's angle is missing.
    """
    path = _path(cells)
    if path is None or path.by_wheels:
        return None
    told = np.column_stack([cells.told(axle) for axle in cells.machine.axles]).any(axis=1)
    with np.errstate(invalid="ignore"):
        use = path.moving & ~told & np.isfinite(path.yaw) & (np.abs(path.turn) > _TURNS)
    expected = np.where(use, path.speed * path.turn / path.length, np.nan)
    return np.where(use, path.yaw, np.nan), expected


def turn_by(cells: Cells, leaf: str) -> tuple[Array, Array] | None:
    """Turn by the gyro, and by one measurement of all angles, each as a difference of the ends' tangents, shape (cells,), NaN where the machine is too slow.

    `leaf` is ``phi`` or ``phi_true``. None without a gyro, or where an angle is not measured so.
    """
    path = _path(cells, leaf)
    if path is None or path.by_wheels:
        return None
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        return np.where(path.moving, path.yaw / path.speed * path.length, np.nan), path.turn


def turn_of_ends(cells: Cells) -> tuple[Array, dict[str, Array]] | None:
    """Turn by the gyro beyond that by all angles, as a difference of the ends' tangents, and each axle's own part of it; all of shape (cells,).

    NaN where the machine is too slow. None without a gyro, or where an axle's angle is missing.
    """
    off = _off_angles(cells)
    if off is None or off.by_wheels:
        return None
    names = [[name for name in end if name != _FIXED] for end in turning_ends(cells.machine).values()]
    angles = dict(zip(cells.machine.axles, cells.axles("phi").T, strict=True))
    signed = zip((1.0, -1.0), names, strict=True)
    return off.angle, {name: sign * np.tan(angles[name]) for sign, end in signed for name in end}


class _Path(NamedTuple):
    """How the machine turns and where its angles point, each of shape (cells,), and its length between the ends [m].

    Yaw rate without its bias [rad/s], the wheels' median speed [m/s], whether that moves the machine, and the difference of the ends' tangents.
    """

    yaw: Array
    speed: Array
    moving: NDArray[np.bool_]
    turn: Array
    length: float
    by_wheels: bool


class _Off(NamedTuple):
    """By how much the path is off that by the angles.

    Attributes
    ----------
    angle, turn : Array, shape (cells,)
        As an angle of one axle, and the turn by the angles likewise [rad].
    straight : NDArray[np.bool_], shape (cells,)
        Where these point straight.
    by_wheels : bool
        Whether the wheels tell the yaw rate.
    """

    angle: Array
    turn: Array
    straight: NDArray[np.bool_]
    by_wheels: bool

    @property
    def most(self) -> float:
        """Limit in a window [rad]."""
        return _OFF_BY_WHEELS if self.by_wheels else OFF

    def straight_ways(self, cells: Cells) -> Array | None:
        """The angle, NaN but on straight ways, shape (cells,); None for too little."""
        straight = np.where(self.straight, self.angle, np.nan)
        return straight if np.count_nonzero(np.isfinite(straight)) * cells.dt >= _LEAST_S else None

    def in_turns(self, cells: Cells) -> Array | None:
        """The same wherever the machine moves, less what a turn may put in, shape (cells,); None for too little."""
        if np.count_nonzero(np.isfinite(self.angle)) * cells.dt < _LEAST_S:
            return None
        return np.asarray(np.sign(self.angle) * np.maximum(np.abs(self.angle) - _OF_TURN * np.abs(self.turn), 0.0))


def _off_angles(cells: Cells) -> _Off | None:
    """How far the machine is off where its angles point; NaN where it is too slow. None without yaw rate, or an axle's angle."""
    path = _path(cells)
    if path is None:
        return None
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        off = np.where(path.moving, path.yaw / path.speed * path.length - path.turn, np.nan)
    return _Off(off, path.turn, np.abs(path.turn) < _STRAIGHT, path.by_wheels)


def _of_the_middle(geometry: Geometry, wheels: Sequence[str], speeds: Array) -> Array:
    """Speed of the machine's middle [m/s], shape (cells,): the median of all wheels; where a wheel's is not logged, that of those in the middle, or of both sides.

    0 where there are neither: in turns the speed of one side is not the machine's.
    """
    filled = _or_nothing(speeds)
    logged = np.isfinite(speeds).any(axis=0)
    if logged.all():
        return median_known(filled, axis=1)
    across = np.array([geometry.wheels[w].y + geometry.wheels[w].offset for w in wheels])
    middle = logged & (np.abs(across) <= _SHORTEST)
    if middle.any():  # such as the drive of a tricycle, whose other wheels only roll
        return median_known(_or_nothing(speeds[:, middle]), axis=1)
    sides = [filled[:, logged & (side * across > 0.0)] for side in (1.0, -1.0)]
    if any(not side.shape[1] for side in sides):
        return np.zeros(len(speeds))
    left, right = (median_known(_or_nothing(side), axis=1) for side in sides)
    return np.asarray(0.5 * (left + right))


def _or_nothing(x: Array) -> Array:
    """Speeds with 0 where none of a row is known, shape (cells, wheels) [m/s]."""
    return np.where(np.asarray(np.isfinite(x).any(axis=1))[:, np.newaxis], x, 0.0)


def _path(cells: Cells, leaf: str = "phi") -> _Path | None:
    """How the machine turns, and where its angles point by one measurement of them; None without yaw rate, or an axle's angle."""
    geometry, axles = cells.machine.geometry, cells.machine.axles
    if geometry is None:
        return None
    ends = turning_ends(cells.machine)
    yaw = cells.means("imu.yaw_rate")
    by_wheels = not np.isfinite(yaw).any()
    if by_wheels:
        yaw = yaw_by_wheels(cells)
    if not axles or len(ends) != _ENDS or not np.isfinite(yaw).any():
        return None
    (first, one), (last, other) = ends.items()
    length, angles, speeds = first - last, cells.axles(leaf), cells.wheels("v")
    by_name = {**dict(zip(axles, angles.T, strict=True)), _FIXED: np.zeros(len(angles))}
    if any(not np.isfinite(by_name[name]).any() for name in (*one, *other)):
        return None
    angle = np.column_stack([np.mean([by_name[name] for name in end], axis=0) for end in (one, other)])
    known = np.asarray(np.isfinite(speeds).any(axis=1))
    speed = _of_the_middle(geometry, cells.machine.wheels, speeds)
    rest = known & (np.abs(speed) < _STILL) & np.isfinite(yaw)
    bias = float(median_of(yaw[rest])) if np.count_nonzero(rest) * cells.dt >= _STILL_S else 0.0
    moving = np.abs(speed) > _MOVING * cells.machine.max_speed
    turn = np.tan(angle[:, 0]) - np.tan(angle[:, 1])
    return _Path(yaw - bias, speed, moving, turn, length, by_wheels)
