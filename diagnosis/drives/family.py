"""Single drives, by their effort, as a family of evidence."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from diagnosis.evidence import ACTUATOR, SENSOR, Contribution, MissionView, Part
from diagnosis.results.assessment import Assessment, Lack, unassessed
from diagnosis.results.vocabulary import Tier
from replay.faults import State

if TYPE_CHECKING:
    from diagnosis.drives.inputs import DriveData


class DriveEvidence:
    """A drive with command, speed and effort, by what its controller answered to and what effort it took."""

    tier = Tier.DRIVE

    def assess(self, mission: MissionView) -> Contribution:
        """Judge drives that no stronger evidence has judged."""
        parts: dict[Part, Assessment] = {}
        for wheel in _alone(mission):
            drive = _drive(mission, wheel)
            if drive is None:
                continue
            if mission.machine.geometry is not None and wheel not in mission.machine.drives:
                # wheels of one body under one pump push each other: alone, none of them can be told from the others
                why = "no model of the {wheels} could be found in this mission"
                both = (unassessed(mission.timeline.size, State.NOT_ASSESSED, why, Lack.ANSWER),) * 2
            else:
                from diagnosis.drives.assess import assess_drive  # not loaded where nothing is left to judge

                both = assess_drive(drive, mission.machine.limits)
            parts[wheel, SENSOR], parts[wheel, ACTUATOR] = both
        return Contribution(parts)


def _alone(mission: MissionView) -> list[str]:
    """Wheels with speed and command whose sensor nothing has judged."""
    return [
        w
        for w in mission.wheels
        if (w, SENSOR) not in mission.known
        and not mission.logged(f"wheel.{w}.v_true")
        and mission.logged(f"wheel.{w}.v")
        and np.isfinite(mission.command(w)).any()
    ]


def _drive(mission: MissionView, wheel: str) -> DriveData | None:
    from diagnosis.drives.inputs import drive_data

    return drive_data(mission.timeline, mission.command(wheel), mission.machine, wheel, mission.alive)
