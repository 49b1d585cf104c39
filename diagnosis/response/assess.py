"""The walk: response of every drive → blocks → views of each wheel → states → findings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.body import BodySpeed
from diagnosis.response.by_acceleration import with_the_acceleration
from diagnosis.response.by_both import by_both_motions
from diagnosis.response.doubts import sides_of_all
from diagnosis.response.drive_faults import drive_faults
from diagnosis.response.encoder_scale import scaled_sides
from diagnosis.response.encoder_scale_words import by_the_gyro, told
from diagnosis.response.gyro import wrong_gyro
from diagnosis.response.inputs import FollowerData
from diagnosis.response.joint_gain import told_gain
from diagnosis.response.machine import paused, pauses, standstills, unexplained
from diagnosis.response.reversed_sign import reversed_spans, told_reversed
from diagnosis.response.scene import Drives, Given, drives_of, scene_of
from diagnosis.response.shaken import told_shaken
from diagnosis.response.share_findings import told_share
from diagnosis.response.turning import track_of, wrong_yaw_rate
from diagnosis.response.unit_note import noted
from diagnosis.response.vibration import Unit
from diagnosis.response.weighed import settled, weighed
from diagnosis.response.witness import witnessed
from diagnosis.results.assessment import Assessment
from diagnosis.results.said import Said
from replay.machine.config import Limits
from replay.machine.geometry import Geometry

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Judgement:
    """Both sides of each wheel that could be judged, and what happened to the machine as a whole, to its gyro, to all speeds and to those of one side.

    `apart` says which wheels read another share of the motion than the others, or nothing, all through; `unrelated` says that speeds and commands are of sizes that nothing relates.
    """

    parts: Mapping[str, tuple[Assessment, Assessment]]
    events: tuple[Said, ...]
    gyro: tuple[Said, ...] = ()
    unshown: tuple[Said, ...] = ()
    unrelated: tuple[str, ...] = ()
    scaled: tuple[Said, ...] = ()
    apart: tuple[str, ...] = ()


def assess_response(
    data: Mapping[str, FollowerData],
    geometry: Geometry | None,
    yaw: Array | None,
    limits: Limits,
    dt: float,
    speeds: tuple[BodySpeed, ...] = (),
    heading: Array | None = None,
    unit: Unit | None = None,
) -> Judgement:
    """Judge drives by their response.

    Parameters
    ----------
    data : Mapping[str, FollowerData]
        All drives that are judged so, by wheel.
    geometry : Geometry or None
        Says which wheels are on one side.
    yaw : Array or None, shape (n,)
        Measured yaw rate [rad/s].
    limits : Limits
        ``driving_speed``.
    dt : float
        Step [s].
    speeds : tuple[BodySpeed, ...]
        The body's speed by its own sensors, in blocks of `BLOCK_S`.
    heading : Array or None, shape (b,)
        Yaw rate by the heading of odometry in such blocks [rad/s].
    unit : Unit or None
        The inertial unit's forward acceleration.
    """
    if not data:
        return Judgement({}, ())
    given = Given(geometry, yaw, limits, dt, speeds, heading, unit)
    drives = drives_of(data, given)
    if not drives.found:
        return _none_answers(drives, given)
    scene = scene_of(drives, given)
    judged, block_s, width = scene.judged, given.block_s, given.width
    apart = weighed(scene, given)
    faults = drive_faults(scene, apart.by_motion, given)
    kept, nobodys = settled(apart.kept, faults, scene, given)
    sides = sides_of_all((kept, nobodys), faults, apart, scene, drives, given)
    unsettled = {w: [*kept[w], *(s for s in apart.slips[w] if not wrong_yaw_rate(s, j))] for w, j in judged.items()}
    sought = scaled_sides(judged, unsettled, apart.turning, block_s)
    aside, across = [(x.start, x.stop) for x in sought.found], None if apart.other_way else track_of(judged, geometry)
    gyro = wrong_gyro(judged, unsettled, apart.turning, block_s, heading, aside, across)
    open_to = [slice(x.start * width, x.stop * width) for x in gyro if not x.sure]
    parts = {
        w: (by_the_gyro(w, sensor, judged, sought, apart.turning, open_to, speeds), drive)
        for w, (sensor, drive) in sides.parts.items()
    }
    ignored = () if any(j.response.answered for j in judged.values()) else _unexplained(drives, given)
    ignored, said = witnessed(ignored, drives.witness, drives.seen, drives.all, speeds, (width, limits, dt))
    parts = _beside_the_unit(parts, drives, given)
    stood = _stood(drives, parts, given)
    other_sign = reversed_spans(judged, block_s)
    for w, both in parts.items():
        both = told_reversed(told_share(both, judged[w]), judged[w], other_sign.get(w, []))
        parts[w] = told_gain(both, drives.data[w].name, drives.scales[w]) if w in drives.scales else both
    return Judgement(
        parts,
        events=(*stood, *(sides.astray if sides.lasts else ())),
        gyro=tuple(x.said for x in gyro),
        unshown=(*said, *told_shaken(drives.shaken, drives.all, given.dt)),
        unrelated=ignored,
        scaled=told(sought, apart.turning, block_s),
        apart=sides.apart,
    )


def _none_answers(drives: Drives, given: Given) -> Judgement:
    """What can be said where no drive answers enough to be judged."""
    stood = _stood(drives, {}, given)
    ignored = () if stood or drives.seen or drives.shaken else _unexplained(drives, given)
    steps = given.width, given.limits, given.dt
    ignored, said = witnessed(ignored, drives.witness, drives.seen, drives.all, given.speeds, steps)
    return Judgement(
        {},
        stood,
        unshown=(*said, *told_shaken(drives.shaken, drives.all, given.dt)),
        unrelated=() if stood else ignored,
    )


def _unexplained(drives: Drives, given: Given) -> tuple[str, ...]:
    return unexplained(drives.all, given.limits, given.dt)


def _beside_the_unit(
    parts: Mapping[str, tuple[Assessment, Assessment]], drives: Drives, given: Given
) -> dict[str, tuple[Assessment, Assessment]]:
    """Both sides of each wheel, of an only drive, or one of two, with what the inertial unit shows besides."""
    if len(drives.data) > 1:
        return by_both_motions(parts, drives.data, given.yaw, given.unit, given.dt)
    dt, unit = given.dt, given.unit
    return {
        w: noted(with_the_acceleration(both, drives.data[w], unit, dt), drives.data[w], unit, dt)
        for w, both in parts.items()
    }


def _stood(drives: Drives, parts: Mapping[str, tuple[Assessment, Assessment]], given: Given) -> tuple[Said, ...]:
    """What is said where the machine stood though it was told to move, or its only drive paused."""
    of_one = [f for side in parts.values() for f in side[0].findings] if len(drives.data) == 1 else []
    paused_spans = [(f.start, f.stop) for f in pauses(of_one)]
    still = drives.still
    return standstills(drives.idle, given.dt, still(drives.idle)) or paused(of_one, given.dt, still(paused_spans))
