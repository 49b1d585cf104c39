"""Whether the common scale of all wheel speeds, such as the wheel diameter of the machine file, fits what measures the body.

A common factor shows in no comparison of wheels with each other, and in none with a command that is scaled alike. It shows where
odometry, a satellite receiver or a yaw rate measures the body itself.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import NamedTuple

import numpy as np

from diagnosis.clearing.cells import Array, Cells
from diagnosis.clearing.yaw import turning_ends
from diagnosis.decision.turn_scale import ANGLE, GYRO, SECOND_ANGLES, Meant, factor_of, meant
from diagnosis.response.body import BodySpeed, body_speeds
from diagnosis.results.machine_event import MachineEvent, other_angle, other_turn, other_yaw_rate
from diagnosis.results.plain_numbers import plain
from replay.arrays.quantiles import median_known, median_of, quantile_of
from replay.machine.geometry import Geometry
from replay.machine.units import known_unit

_MOVES = 0.3  # of the usual speed: less of it says nothing
_USUAL = 0.95  # quantile
_STRAIGHT = 0.05  # of the usual speed: what wheels that go straight on may differ by
_TURNS = 0.1  # rad; and of the usual yaw rate `_MOVES`
_SLIPS = 0.1  # ln; tyres slip and wear by as much
_TURN_SLIPS = 0.2  # ln; in a turn they slip sideways as well, and its lengths count
_STILL, _STILL_S = 0.01, 1.0  # of the usual speed; at rest for this long, a gyro shows its bias
_ROTATIONAL = ("rad/s", "rpm", "deg/s", "rev/s")
GROSS = 0.3  # ln; beyond any slip


class Scaled(NamedTuple):
    """How fast the body is by one sensor.

    Attributes
    ----------
    by : str
        The sensor, in words.
    factor : float
        Its speed over that by the wheels [1].
    lengths : str
        Lengths of the machine file that stand in the comparison beside the wheels' scale; may be empty.
    meant : Meant
        What others say of it.
    """

    by: str
    factor: float
    lengths: str
    meant: Meant = Meant()


class Scale(NamedTuple):
    """What is known of the scale of the wheels' speeds.

    Attributes
    ----------
    diameter : float or None
        Wheel diameter [m] by which rotations were converted; None where the log has speeds of the rim.
    found : tuple[Scaled, ...]
        What sensors of the body say; empty where none does.
    assumed : bool
        Whether the diameter is the paper's machine's, as no machine file gave this one's.
    by : float
        What the first speeds were multiplied by beside the second ones, before they were judged [1].
    """

    diameter: float | None
    found: tuple[Scaled, ...]
    assumed: bool = False
    by: float = 1.0

    @property
    def explained(self) -> bool:
        """Whether what contradicts it is what the second speeds said already."""
        return self.by != 1.0 and all(agrees(s.factor / self.by) for s in self.wrong)

    @property
    def wrong(self) -> tuple[Scaled, ...]:
        """Those that contradict it."""
        return tuple(s for s in self.found if abs(np.log(s.factor)) > (_TURN_SLIPS if s.lengths else _SLIPS))

    @property
    def gross(self) -> str:
        """A sentence where the contradiction is beyond any slip, and may be the machine file's; else empty."""
        return self.sentence if self._gross and not self._turn and not self.explained else ""

    @property
    def _gross(self) -> bool:
        return any(abs(np.log(s.factor)) > GROSS for s in self.wrong)

    @property
    def _turn(self) -> Scaled | None:
        """What contradicts the turns alone, where others have the scale of the wheels' speeds; else None."""
        one = self._worst
        return one if one is not None and one.lengths and one.meant.speeds else None

    @property
    def _worst(self) -> Scaled | None:
        return max(self.wrong, key=lambda s: (not s.lengths, abs(np.log(s.factor))), default=None)

    @property
    def event(self) -> MachineEvent | None:
        """What stands before the verdict where turns are beyond any slip, and the wheels' own scale is not meant; else None."""
        one = self._turn
        if one is None or not self._gross:
            return None
        return {GYRO: other_yaw_rate, ANGLE: other_angle}.get(one.meant.part, other_turn)(self.sentence)

    @property
    def sentence(self) -> str:
        """The contradiction in one sentence; empty where there is none."""
        one = self._worst
        if one is None:
            return ""
        if self._turn is not None:
            return self._of_turns(one)
        what = "the unit or gain of the wheel speeds"
        if self.diameter is not None:
            what = f"the wheel diameter ({self.diameter:g} m; {plain(self.diameter * one.factor)} m would fit)"
        others = f", or {one.lengths}" if one.lengths else ""
        return (
            f"By {one.by} the machine is {one.factor:.2f} times as fast as by its wheels throughout, which is no part's fault, for all "
            f"wheels share the factor: check {what}{others}{self._where}; if that is right, the wheels slip, or that sensor's "
            "scale is wrong."
        )

    def _of_turns(self, one: Scaled) -> str:
        """The same where the scale of the wheels' speeds is not meant."""
        said, angle = one.meant, one.lengths == "the wheelbase"
        makes = "wheel speeds and steering angle make" if angle else "left and right wheel make"
        agree = " and ".join(said.speeds)
        head = (
            f"By the gyro (imu.yaw_rate) the machine turns {one.factor:.2f} times as fast as {makes} it, throughout, while {agree} "
            f"{'agrees' if len(said.speeds) == 1 else 'agree'} with the wheels' speeds: "
        )
        if said.part == ANGLE:
            wheelbase = (
                "" if said.by == SECOND_ANGLES else f", or the wheelbase{self._where} is wrong"
            )  # which stands in both
            reads = f"the steering angle reads about {1.0 / one.factor:.2f} times what it is"
            return f"{head}{said.by} turns it as the gyro has it, so that {reads}{wheelbase}."
        alike = ""
        if self.diameter is not None:
            alike = f"; a wheel diameter that controller and machine file have wrong alike ({plain(self.diameter * one.factor)} m would fit) looks the same"
        if said.part == GYRO:
            return head + (
                f"{said.by} turns it as steering angle and wheelbase have it, so that the scale of the gyro is wrong (it would be multiplied by "
                f"{1.0 / one.factor:.2f}){alike}."
            )
        where = (
            f"the wheelbase{self._where}" if angle else f"the track{self._where} is wrong, or the wheels slip in turns"
        )
        if angle:
            return f"{head}the scale of the gyro or of the steering angle is wrong, or {where}; nothing in the log tells which{alike}."
        if said.track:
            return f"{head}the scale of the gyro is wrong, or the wheels slip in turns; the commanded yaw rate agrees with the track{alike}."
        return f"{head}the scale of the gyro is wrong, or {where}; nothing in the log tells which{alike}."

    @property
    def _where(self) -> str:
        """Where the machine's lengths are stated, to follow them."""
        return ", which are assumed and to be stated in a machine file" if self.assumed else " in the machine file"

    @property
    def result(self) -> tuple[str, str, bool]:
        """Result, effect and whether all is well, for the table of the data's quality."""
        given = (
            "as the log has it"
            if self.diameter is None
            else f"by {'an assumed wheel diameter' if self.assumed else 'the wheel diameter of the machine file'} ({self.diameter:g} m)"
        )
        if self.wrong:
            return self.sentence, "speeds, distances and limits are wrong by that factor", False
        if self.found:
            said = ", ".join(f"{s.by} ({s.factor:.2f})" for s in self.found)
            return f"{given}; agrees with {said}", "none", True
        return (
            f"{given}; not checked: nothing in the log measures the body's own speed long enough",
            "a common error of all wheels' speeds would not show",
            True,
        )


def scale_of(cells: Cells, units: Collection[str], *, factor: float = 1.0) -> Scale | None:
    """What sensors of the body say of the scale of the wheels' speeds; None for a machine whose parts are no wheels.

    Parameters
    ----------
    cells : Cells
        The mission.
    units : Collection[str]
        Units in which the wheels' speeds were recorded.
    factor : float
        By what they were multiplied before they were judged [1].
    """
    machine = cells.machine
    if machine.speed_unit != "m/s":
        return None
    turned = any(known_unit(u) in _ROTATIONAL for u in units)
    diameter = machine.geometry.wheel_diameter if machine.geometry is not None and turned else None
    speeds = cells.wheels("v")
    found: tuple[Scaled, ...] = ()
    if np.isfinite(speeds).any():
        found = tuple(_straight(cells, speeds))
        found = (*found, *_turning(cells, speeds, factor, tuple(s.by for s in found if agrees(s.factor * factor))))
    found = tuple(s._replace(factor=s.factor * factor) for s in found)
    return Scale(diameter, found, "geometry" in machine.assumed, factor)


def bodies(cells: Cells) -> tuple[BodySpeed, ...]:
    """What sensors of the body say of its speed, once for a mission."""
    return cells.once("body speeds", lambda: body_speeds(cells.timeline, cells.width))


def _straight(cells: Cells, speeds: Array) -> Iterator[Scaled]:
    """By speeds of the body while all wheels go alike: then each of them is the body's."""
    v, usual = _median(speeds)
    alike = (np.abs(speeds - v[:, None]) < _STRAIGHT * usual).sum(axis=1)
    straight = (
        (alike > np.isfinite(speeds).sum(axis=1) / 2)
        & (alike >= min(2, speeds.shape[1]))
        & (np.abs(v) > _MOVES * usual)
    )
    for body in bodies(cells):
        factor = factor_of(np.abs(body.speed), np.abs(v), straight, cells.dt)
        if factor is not None:
            yield Scaled(body.name, factor, "")


def agrees(factor: float) -> bool:
    """Whether a factor [1] is none, but for what tyres slip and wear by."""
    return abs(float(np.log(factor))) < _SLIPS


def _turning(cells: Cells, speeds: Array, by: float, agreeing: tuple[str, ...]) -> Iterator[Scaled]:
    """By a yaw rate while the machine turns without skidding: two sides on one line, or a steered axle.

    `by`: what the speeds were multiplied by; `agreeing`: sensors of the body that have their scale.
    """
    geometry, yaw = cells.machine.geometry, cells.means("imu.yaw_rate")
    if geometry is None or not np.isfinite(yaw).any():
        return
    v, usual = _median(speeds)
    found = _by_sides(cells, geometry, speeds) or _by_angles(cells, geometry, v)
    if found is None:
        return
    expected, lengths = found
    known = np.abs(expected[np.isfinite(expected)])
    if not known.size:
        return
    on_the_spot = np.abs(np.nan_to_num(expected)) > _STILL * float(quantile_of(known, _USUAL))
    rest = (np.abs(v) < _STILL * usual) & ~on_the_spot & np.isfinite(yaw)
    yaw = yaw - (float(median_of(yaw[rest])) if np.count_nonzero(rest) * cells.dt >= _STILL_S else 0.0)
    turning = (np.abs(expected) > _MOVES * float(quantile_of(known, _USUAL))) & (expected * yaw > 0.0)
    factor = factor_of(np.abs(yaw), np.abs(expected), turning, cells.dt)
    if factor is not None:
        others = meant(cells, v, expected, turning, factor, agreeing) if by == 1.0 else Meant()
        yield Scaled("the yaw rate", factor, lengths, others)


def _by_sides(cells: Cells, geometry: Geometry, speeds: Array) -> tuple[Array, str] | None:
    """Yaw rate by left and right wheels on one line [rad/s], shape (cells,); machines with more axles skid."""
    places = [geometry.wheels[w] for w in cells.machine.wheels if w in geometry.wheels]
    if len(places) != speeds.shape[1] or any(p.axle != "fixed" for p in places) or len({p.x for p in places}) != 1:
        return None
    y = np.array([p.y for p in places])
    if not (y > 0).any() or not (y < 0).any():
        return None
    left, right = speeds[:, y > 0].mean(axis=1), speeds[:, y < 0].mean(axis=1)
    return (right - left) / float(y[y > 0].mean() - y[y < 0].mean()), "the track"


def _by_angles(cells: Cells, geometry: Geometry, v: Array) -> tuple[Array, str] | None:
    """Yaw rate by speed and steering angles [rad/s], shape (cells,), where these are large; None without two ends that turn the machine."""
    ends = turning_ends(cells.machine)
    names = [name for end in ends.values() for name in end]
    if len(ends) != 2 or not set(names) & set(cells.machine.axles):
        return None
    angles = [
        np.mean([np.zeros(cells.size) if n == "fixed" else cells.means(f"steer.{n}.phi") for n in end], axis=0)
        for end in ends.values()
    ]
    first, last = ends
    turn = np.tan(angles[0]) - np.tan(angles[1])
    return np.where(np.abs(turn) > _TURNS, v * turn / (first - last), np.nan), "the wheelbase"


def _median(speeds: Array) -> tuple[Array, float]:
    """Median of the wheels, shape (cells,), NaN where none is known; and how fast it usually is."""
    known = np.isfinite(speeds).any(axis=1)
    v = np.full(len(speeds), np.nan)
    v[known] = median_known(speeds[known], axis=1)
    moving = np.abs(v[known])
    return v, float(quantile_of(moving[moving > 0.0], _USUAL)) if (moving > 0.0).any() else np.inf
