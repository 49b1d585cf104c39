"""Channels of a single drive on a mission's time axis, and its model from several healthy missions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.liveness import alive, alive_sources
from diagnosis.drives.effort_map import identify_effort
from diagnosis.drives.identification import identify_controller
from diagnosis.drives.inputs import DriveData
from replay.control.loop import Replay
from replay.machine.config import Machine, Noise
from replay.machine.drive_model import DriveModel
from replay.signals.timeline import Timeline

Array = NDArray[np.float64]

_SPAN = 2.2  # largest plausible speed [top speed]


def drive_data(timeline: Timeline, command: Array, machine: Machine, wheel: str) -> DriveData | None:
    """Channels of a drive, or None where its speed, command or effort is not in the log.

    Parameters
    ----------
    timeline : Timeline
        The aligned mission.
    command : Array, shape (n,)
        Commanded speed [m/s].
    machine : Machine
        The machine.
    wheel : str
        Which of its drives.
    """
    names = (f"wheel.{wheel}.v", f"wheel.{wheel}.v_ref", f"wheel.{wheel}.u")
    y, u = timeline.get(names[0]), timeline.get(names[2])
    if y is None or u is None or not all(np.isfinite(x).any() for x in (y, u, command)):
        return None
    return DriveData(
        y=y,
        y_fresh=timeline.fresh[names[0]],
        alive=alive(timeline, alive_sources(timeline), names[0]),
        command=command,
        u=u,
        dt=timeline.dt,
        model=machine.drives.get(wheel),
        span=_SPAN * machine.max_speed,
        u_max=max(machine.control.u_max, 1e-6),
        lsb=machine.noise.get(names[0], Noise()).lsb,
        names=names,
        open_loop=timeline.open_loop,
    )


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
