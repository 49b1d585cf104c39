"""The wheel model as a family of evidence."""

from __future__ import annotations

from dataclasses import replace

from diagnosis.evidence import ACTUATOR, SENSOR, Contribution, MissionView, Part
from diagnosis.results.assessment import Assessment
from diagnosis.results.vocabulary import Tier
from diagnosis.wheels.wheel_channels import WheelChannels, wheel_channels
from replay.progress import Progress, Stage


class WheelEvidence:
    """All wheels together, by valve openings and speeds; what is measured twice helps and is judged elsewhere."""

    tier = Tier.MODEL

    def assess(self, mission: MissionView) -> Contribution:
        """Judge the wheels of a machine that has several."""
        timeline, replay, machine = mission.timeline, mission.replay, mission.machine
        channels = _channels(mission)
        driven = [w not in machine.unpowered for w in machine.wheels]
        if len(machine.wheels) < 2 or (channels.has_true & channels.has_applied)[driven].all():
            return Contribution({})
        mission.progress(Progress(Stage.IDENTIFYING_WHEELS))
        if mission.angle is None or mission.doubtful is None:
            return Contribution({})
        # a wheel model is not loaded for missions in which all is measured twice
        from diagnosis.wheels.assess import assess_wheels
        from diagnosis.wheels.body import measured_body
        from diagnosis.wheels.inputs import wheels_data
        from diagnosis.wheels.motion import MOST_AGAINST, against_command, in_motion, slip_of
        from diagnosis.wheels.wheel_fit import wheel_fit

        motion = in_motion(mission.angle, machine, timeline)
        body = measured_body(timeline, machine, channels.speed, replay.v_ref, mission.angle, motion)
        fit = wheel_fit(channels, replay, timeline, machine, motion, body)
        if fit is None:
            return Contribution({})
        mission.progress(Progress(Stage.JUDGING_WHEELS))
        slip = slip_of(timeline, replay, machine, channels.v, mission.angle, motion, mission.doubtful)
        data = wheels_data(
            timeline, replay, machine, channels, fit, mission.alive, motion, mission.doubtful, slip, body
        )
        parts: dict[Part, Assessment] = {}
        judged = assess_wheels(data, machine.limits, gains=fit.reliable)
        for i, (sensor, actuator) in judged.parts.items():
            wheel = machine.wheels[i]
            if wheel in mission.wheels and not channels.has_true[i]:
                parts[wheel, SENSOR] = sensor
            if wheel in mission.wheels and not channels.has_applied[i]:
                parts[wheel, ACTUATOR] = actuator
        said = [] if body is None else list(body.body.notes)
        against = against_command(channels.speed, replay.v_ref)
        if against > MOST_AGAINST:
            said.append(
                f"The {{wheels}} turned against their commanded speeds for {100 * against:.0f} % of the driving: the controller does not "
                "follow them, and they were left out."
            )
        noted = {part: replace(a, notes=(*a.notes, *said)) for part, a in parts.items()}
        return Contribution(noted, model=fit, events=judged.events)


def _channels(mission: MissionView) -> WheelChannels:
    """Channels of all wheels, without the speeds of sensors that are dead."""
    channels, machine = wheel_channels(mission.timeline, mission.machine), mission.machine
    known = {w: mission.known.get((w, SENSOR)) for w in machine.wheels}
    dead = [i for i, w in enumerate(machine.wheels) if (a := known[w]) is not None and a.tier is Tier.SIGNAL]
    return channels.without_speed(dead) if dead else channels
