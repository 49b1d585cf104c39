"""Maps of the valves, lags and the tyres' grip from healthy missions, by all wheels together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from diagnosis.wheels.motion import in_motion
from diagnosis.wheels.plant_constants import PlantFit
from diagnosis.wheels.plant_identification import identify_plants
from diagnosis.wheels.wheel_channels import wheel_channels
from diagnosis.wheels.wheel_fit import wheel_drive
from replay.control.loop import Replay, stack
from replay.machine.config import Machine
from replay.signals.timeline import Timeline

_HEALTHY_SHARE = 0.8  # of the windows: missions to fit are healthy, but not all of their windows are alike
_MOST_MISFIT = 0.1


def fit_maps(
    timelines: Sequence[Timeline], replays: Sequence[Replay], machine: Machine, spoiled: Sequence[str]
) -> PlantFit | None:
    """Plants of all wheels with the maps of their valves; None where the missions do not show them.

    Parameters
    ----------
    timelines, replays, machine
        The missions and the machine.
    spoiled : Sequence[str]
        Per wheel, a signal with a wrong unit that its model would rest on; empty where there is none.
    """
    drives = []
    for timeline, replayed in zip(timelines, replays, strict=True):
        channels = wheel_channels(timeline, machine)
        angle = np.zeros((timeline.size, 0))
        if machine.axles:
            measured, true = (stack(timeline, [f"steer.{a}.{x}" for a in machine.axles]) for x in ("phi", "phi_true"))
            angle = np.where(np.isfinite(true), true, measured)
        drive = wheel_drive(channels, replayed, timeline, machine, in_motion(angle, machine, timeline))
        usable = np.array([not s for s in spoiled])
        drives.append(replace(drive, moving=drive.moving & usable))
    found = identify_plants(drives, machine.max_speed, _HEALTHY_SHARE, machine.plant.coupling) if drives else None
    return None if found is None or found.misfit > _MOST_MISFIT else found
