"""Drives with command and speed alone as a family of evidence."""

from __future__ import annotations

from diagnosis.evidence import ACTUATOR, SENSOR, Contribution, MissionView, Part
from diagnosis.response.assess import assess_response
from diagnosis.response.body import body_speeds
from diagnosis.response.inputs import followers
from diagnosis.response.models import BLOCK_S
from diagnosis.results.assessment import Assessment
from diagnosis.results.machine_event import not_following, other_yaw_rate
from diagnosis.results.vocabulary import Tier


class ResponseEvidence:
    """Velocity-controlled drives, by how they answer, by each other, and by what each channel shows alone."""

    tier = Tier.RESPONSE

    def assess(self, mission: MissionView) -> Contribution:
        """Judge drives whose response can be found in the mission and that nothing stronger has judged."""
        yaw = mission.values("imu.yaw_rate") if mission.logged("imu.yaw_rate") else None
        machine = mission.machine
        dt = mission.timeline.dt
        data = followers(mission)
        speeds = body_speeds(mission.timeline, max(1, round(BLOCK_S / dt))) if data else ()
        judged = assess_response(data, machine.geometry, yaw, machine.limits, dt, speeds)
        parts: dict[Part, Assessment] = {}
        for wheel in mission.wheels:
            if wheel in judged.parts:
                parts[wheel, SENSOR], parts[wheel, ACTUATOR] = judged.parts[wheel]
        events = (*map(not_following, judged.events), *map(other_yaw_rate, judged.gyro))
        return Contribution(parts, events=events)
