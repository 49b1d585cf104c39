"""Dead speed sensors as a family of evidence: what a channel shows alone."""

from __future__ import annotations

import numpy as np

from diagnosis.channels.frozen import frozen_sensor, frozen_speeds
from diagnosis.evidence import ACTUATOR, SENSOR, Contribution, MissionView, Part
from diagnosis.results.assessment import Assessment, unassessed
from diagnosis.results.vocabulary import Tier
from replay.control.loop import stack
from replay.faults import State


class DeadSensors:
    """Speed sensors that give one value through the whole mission, and what they mask."""

    tier = Tier.SIGNAL

    def assess(self, mission: MissionView) -> Contribution:
        """Judge wheels whose only speed sensor never changes while the machine drives."""
        machine, timeline = mission.machine, mission.timeline
        v = stack(timeline, [f"wheel.{w}.v" for w in machine.wheels])
        frozen = frozen_speeds(v, mission.replay.v_ref, machine.limits.driving_speed, timeline.dt)
        frozen = {i: x for i, x in frozen.items() if not mission.logged(f"wheel.{machine.wheels[i]}.v_true")}
        parts: dict[Part, Assessment] = {}
        for i, value in frozen.items():
            wheel, others = machine.wheels[i], np.delete(v, list(frozen), axis=1)
            parts[wheel, SENSOR] = frozen_sensor(v[:, i], value, others, f"wheel.{wheel}.v", timeline.dt)
            if not mission.logged(f"wheel.{wheel}.u_applied"):
                why = "the {wheel.sensor} is dead for the whole mission"
                parts[wheel, ACTUATOR] = unassessed(timeline.size, State.MASKED, why)
        return Contribution(parts)
