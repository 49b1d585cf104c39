"""Model of a single drive from several healthy missions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.drives.effort_map import identify_effort
from diagnosis.drives.identification import identify_controller
from diagnosis.drives.inputs import DriveData, drive_data
from replay.control.loop import Replay
from replay.machine.config import Machine
from replay.machine.drive_model import DriveModel
from replay.signals.timeline import Timeline

Array = NDArray[np.float64]


def identify_drive(missions: Sequence[DriveData], least_speed: float) -> DriveModel:
    """Find controller and effort map of a drive from several healthy missions.

    Parameters
    ----------
    missions : Sequence[DriveData]
        Healthy missions; their models are not used.
    least_speed : float
        Commanded speed from which the drive is driven [m/s].
    """
    records = [m.record for m in missions]
    return DriveModel(echo=identify_controller(records), effort=identify_effort(records, least_speed))


def fit_drives(missions: Sequence[tuple[Timeline, Replay]], machine: Machine) -> dict[str, DriveModel]:
    """Models of a machine's drives from several healthy missions, by wheel; wheels that show neither part are left out.

    Parameters
    ----------
    missions : Sequence[tuple[Timeline, Replay]]
        Aligned healthy missions and their replayed loops.
    machine : Machine
        The machine; its own drive models are not used.
    """
    out = {}
    for i, wheel in enumerate(machine.wheels):
        found = [drive_data(timeline, replay.v_ref[:, i], machine, wheel) for timeline, replay in missions]
        model = identify_drive([d for d in found if d is not None], machine.limits.driving_speed)
        if model.echo is not None or model.effort is not None:
            out[wheel] = model
    return out
