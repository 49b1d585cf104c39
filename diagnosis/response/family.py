"""Drives with command and speed alone as families of evidence: by how they answer, or whether they follow at all."""

from __future__ import annotations

import numpy as np

from diagnosis.channels.echo import not_measured
from diagnosis.channels.standstill import STILL, together_idle
from diagnosis.evidence import ACTUATOR, SENSOR, Contribution, MissionView, Part
from diagnosis.response.assess import Judgement, assess_response
from diagnosis.response.body import body_speeds
from diagnosis.response.by_acceleration import beside_the_acceleration, merged
from diagnosis.response.by_body import beside_the_body
from diagnosis.response.disputed import doubted
from diagnosis.response.heading import Contradiction, contradictions, odometry_rate
from diagnosis.response.inputs import FollowerData, cells, followers
from diagnosis.response.lone import by_its_channel, not_shared
from diagnosis.response.models import BLOCK_S
from diagnosis.response.sides import without_doubles
from diagnosis.response.tracking import assess_channel, assess_tracking
from diagnosis.response.unit_note import noted
from diagnosis.response.vibration import Unit
from diagnosis.results.assessment import Assessment, Finding, Reason
from diagnosis.results.machine_event import (
    gyro_or_slip,
    not_following,
    not_related,
    not_shown,
    one_side_otherwise,
    turns_otherwise,
    wheels_apart,
)
from diagnosis.results.said import Said
from diagnosis.results.vocabulary import Tier
from replay.machine.config import Machine
from replay.setup.turn_sizes import turn_size_doubt

_TURNS_OTHERWISE = Reason("the gyro contradicts the heading of odometry, which its speed is a part of")


class ResponseEvidence:
    """Velocity-controlled drives, by how they answer, by each other, and by what each channel shows alone."""

    tier = Tier.RESPONSE

    def assess(self, mission: MissionView) -> Contribution:
        """Judge drives whose response can be found in the mission and that nothing stronger has judged."""
        yaw = mission.values("imu.yaw_rate") if mission.logged("imu.yaw_rate") else None
        machine = mission.machine
        dt = mission.timeline.dt
        several = sum(mission.logged(f"wheel.{w}.v") for w in machine.wheels) > 1
        data = {w: d for w, d in followers(mission).items() if several or np.isfinite(d.asked).any()}
        echoes = {w: d for w, d in data.items() if d.echo}
        data = {w: d for w, d in data.items() if not d.echo}
        width = max(1, round(BLOCK_S / dt))
        speeds = body_speeds(mission.timeline, width) if data else ()
        heading = odometry_rate(mission.timeline, width) if yaw is not None and data else None
        judged = assess_response(data, machine.geometry, yaw, machine.limits, dt, speeds, heading, _unit(mission))
        parts: dict[Part, Assessment] = {}
        for wheel in mission.wheels:
            if wheel in judged.parts:
                parts[wheel, SENSOR], parts[wheel, ACTUATOR] = judged.parts[wheel]
            elif wheel in echoes:
                d = echoes[wheel]
                parts[wheel, SENSOR], parts[wheel, ACTUATOR] = not_measured(d.y, d.asked, machine.limits, d.name)
        turns: tuple[Contradiction, ...] = ()
        if yaw is not None and heading is not None and not several:
            asked = cells(mission.values("cmd.omega"), width) if mission.logged("cmd.omega") else None
            turns = contradictions(cells(yaw, width), heading, asked, width * dt)
            spans = [slice(t.start * width, t.stop * width) for t in turns if t.odometry]
            for (wheel, side), part in list(parts.items()):
                if spans and side == SENSOR and _is_odometry(machine, wheel):
                    parts[wheel, side] = doubted(part, spans, _TURNS_OTHERWISE)
        events = (
            *(x.event(not_following) for x in judged.events),
            *map(not_related, judged.unrelated),
            *(x.event(not_shown) for x in judged.unshown),
            *(x.event(one_side_otherwise) for x in judged.scaled),
            *(x.event(gyro_or_slip) for x in judged.gyro or _other_turns(mission, judged)),
            *wheels_apart(judged.apart),
            *(t.said.event(turns_otherwise) for t in turns),
        )
        return Contribution(parts, events=events)


def _other_turns(mission: MissionView, judged: Judgement) -> tuple[Said, ...]:
    """A sentence where the gyro turns otherwise than the wheels all through, by more than tyres make of it, and no wheel is what is wrong."""
    if judged.apart or judged.scaled or any(side.findings for both in judged.parts.values() for side in both):
        return ()
    text = turn_size_doubt(mission.timeline, mission.machine)
    return (Said(f"All through the mission {text}."),) if text else ()


class TrackingEvidence:
    """A drive of which no answer to a command is found: by whether it follows its command at all, and by its channel alone."""

    tier = Tier.TRACKING

    def assess(self, mission: MissionView) -> Contribution:
        """Judge drives that no stronger evidence has judged."""
        parts: dict[Part, Assessment] = {}
        dt, limits = mission.timeline.dt, mission.machine.limits
        idle = together_idle(mission) | _never_moved(mission)
        yaw = mission.values("imu.yaw_rate") if mission.logged("imu.yaw_rate") else None
        drives = {w: d for w, d in followers(mission).items() if (w, SENSOR) not in mission.known}
        found = not_shared({w: by_its_channel(d, yaw, limits, dt) for w, d in drives.items()})
        if len(mission.machine.wheels) == 1:  # of several each is another one's rival
            speeds = body_speeds(mission.timeline, max(1, round(BLOCK_S / dt))) if drives else ()
            found = {w: tuple(without_doubles([*found[w], *beside_the_body(d, speeds, dt)])) for w, d in drives.items()}
            found = {w: _beside_the_unit(found[w], d, _unit(mission), dt) for w, d in drives.items()}
        for wheel, data in drives.items():
            if wheel not in mission.wheels:
                continue
            if np.isfinite(data.asked).any():
                command = np.where(idle, 0.0, data.asked)
                both = assess_tracking(data.y, command, dt, limits, (data.name, "its command"), found[wheel])
            else:
                both = assess_channel(data.y, dt, limits, data.name, found[wheel])
            both = noted(both, data, _unit(mission), dt) if len(mission.machine.wheels) == 1 else both
            parts[wheel, SENSOR], parts[wheel, ACTUATOR] = both
        return Contribution(parts)


def _unit(mission: MissionView) -> Unit | None:
    """The inertial unit's forward acceleration, where it is logged."""
    name = "imu.acceleration"
    return Unit(mission.values(name), mission.timeline.fresh[name]) if mission.logged(name) else None


def _beside_the_unit(
    known: tuple[Finding, ...], data: FollowerData, unit: Unit | None, dt: float
) -> tuple[Finding, ...]:
    """Findings of the only drive with what an inertial unit shows besides, in order of time."""
    new, gone = merged(known, beside_the_acceleration(data, unit, dt))
    return tuple(sorted((*(f for f in known if f not in gone), *new), key=lambda f: f.start))


def _is_odometry(machine: Machine, wheel: str) -> bool:
    """Whether what stands for a wheel's speed is the odometry's, by where both come from."""
    one, other = (machine.signals.get(name) for name in (f"wheel.{wheel}.v", "odom.yaw"))
    return one is not None and other is not None and one.topic == other.topic


def _never_moved(mission: MissionView) -> bool:
    """Whether the only drive is judged by the odometry of a machine that stood still from end to end: no part of it is to blame."""
    if len(mission.machine.wheels) != 1 or not mission.logged("odom.x"):
        return False
    fastest = np.nanmax(np.abs(mission.values(f"wheel.{mission.machine.wheels[0]}.v")), initial=0.0)
    return bool(fastest <= STILL * mission.machine.limits.driving_speed)
