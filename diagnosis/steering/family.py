"""Steering axles as a family of evidence."""

from __future__ import annotations

from diagnosis.evidence import Contribution, MissionView
from diagnosis.results.vocabulary import Tier
from diagnosis.steering.assess import assess_steering


class SteeringEvidence:
    """Sensor and valve of each axle by the steering model, with second measurements where they are logged."""

    tier = Tier.MODEL

    def assess(self, mission: MissionView) -> Contribution:
        """Judge all axles, and estimate their true angles."""
        found = assess_steering(mission.timeline, mission.replay, mission.machine, mission.alive, mission.progress)
        return Contribution(found.assessments, angle=found.angle, doubtful=found.doubtful)
