"""Single drives as families of evidence: by their effort, or by whether they follow their commands."""

from __future__ import annotations

import numpy as np

from diagnosis.channels.standstill import STILL, together_idle
from diagnosis.drives.assess import assess_drive
from diagnosis.drives.inputs import DriveData, drive_data
from diagnosis.drives.tracking import assess_tracking
from diagnosis.evidence import ACTUATOR, SENSOR, Contribution, MissionView, Part
from diagnosis.results.assessment import Assessment, unassessed
from diagnosis.results.vocabulary import Tier
from replay.faults import State


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
                both = (unassessed(mission.timeline.size, State.NOT_ASSESSED, why),) * 2
            else:
                both = assess_drive(drive, mission.machine.limits)
            parts[wheel, SENSOR], parts[wheel, ACTUATOR] = both
        return Contribution(parts)


class TrackingEvidence:
    """A drive whose effort is not logged, by whether it follows its command."""

    tier = Tier.TRACKING

    def assess(self, mission: MissionView) -> Contribution:
        """Judge drives that no stronger evidence has judged."""
        parts: dict[Part, Assessment] = {}
        dt, limits = mission.timeline.dt, mission.machine.limits
        idle = together_idle(mission) | _never_moved(mission)
        for wheel in _alone(mission):
            if _drive(mission, wheel) is None:
                speed = f"wheel.{wheel}.v"
                command = np.where(idle, 0.0, mission.command(wheel))
                both = assess_tracking(mission.values(speed), command, dt, limits, (speed, "its command"))
                parts[wheel, SENSOR], parts[wheel, ACTUATOR] = both
        return Contribution(parts)


def _never_moved(mission: MissionView) -> bool:
    """Whether the only drive is judged by the odometry of a machine that stood still from end to end: no part of it is to blame."""
    if len(mission.machine.wheels) != 1 or not mission.logged("odom.x"):
        return False
    fastest = np.nanmax(np.abs(mission.values(f"wheel.{mission.machine.wheels[0]}.v")), initial=0.0)
    return bool(fastest <= STILL * mission.machine.limits.driving_speed)


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
    return drive_data(mission.timeline, mission.command(wheel), mission.machine, wheel, mission.alive)
