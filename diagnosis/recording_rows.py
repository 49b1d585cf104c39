"""The recording and the machine as rows of ``report.json``."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.decision import quality
from diagnosis.decision.assumed import assumed_words
from diagnosis.decision.way import way_of
from diagnosis.results.document import MachineRow, WheelPlace
from diagnosis.results.left_out import is_left_out
from diagnosis.results.log_rows import FileRow, LogRow
from diagnosis.results.machine_words import machine_words
from replay.arrays.envelope import bucket_of
from replay.machine.config import Machine
from replay.mission import Mission, MissionFile
from replay.readers.machine_identity import stated_machine


def log_row(mission: Mission, moving: NDArray[np.bool_], machine: Machine) -> LogRow:
    """The recording: its files, how long it is, and how long and far the machine drove.

    Parameters
    ----------
    mission : Mission
        The mission.
    moving : NDArray[np.bool_], shape (n, wheels)
        Where each wheel drives.
    machine : Machine
        The machine.
    """
    timeline = mission.timeline
    way = way_of(timeline, machine)
    row: LogRow = {
        "files": [_file(f) for f in mission.files],
        "start_ns": timeline.start_ns,
        "open_loop": mission.open_loop,
        "duration_s": timeline.size * timeline.dt,
        "rate_hz": 1e9 / timeline.step_ns,
        "distance_m": way.distance_m,
        "driving_s": float(np.count_nonzero(moving.any(axis=1))) * timeline.dt,
    }
    if (bucket := bucket_of(timeline.size)) > 1:
        row["samples_per_bucket"] = bucket
    if way.path_note:
        row["path_note"] = way.path_note
    if way.distance_note:
        row["distance_note"] = way.distance_note
    return row


def _file(file: MissionFile) -> FileRow:
    row: FileRow = {
        "path": file.path.name,
        "sha256": file.sha256,
        "bytes": file.bytes,
        "format": file.format,
        "damage": [str(text) for text in file.summary.damage],
        "notes": [*file.summary.notes],
        "clock": quality.clock_row(file.clock),
    }
    if left_out := [str(text) for text in file.summary.damage if is_left_out(text)]:
        row["left_out"] = left_out
    return row


def machine_row(machine: Machine, mission: Mission, source: str, machine_id: str | None) -> MachineRow:
    """The machine, with the identity that was given, else the one that the logs state, else the machine file's.

    Parameters
    ----------
    machine : Machine
        The machine.
    mission : Mission
        Its mission.
    source : str
        Where the machine's settings come from.
    machine_id : str or None
        Identity that was given.
    """
    geometry: dict[str, WheelPlace] | None = None
    if machine.geometry is not None:
        geometry = {
            w: {"x": g.x, "y": g.y, "offset": g.offset, "axle": g.axle} for w, g in machine.geometry.wheels.items()
        }
    row: MachineRow = {
        "name": machine.name,
        "id": machine_id or stated_machine(f.summary.metadata for f in mission.files) or machine.id,
        "wheels": list(machine.wheels),
        "axles": list(machine.axles),
        "geometry": geometry,
        "source": source,
        "assumed": assumed_words(machine),
        "words": machine_words(machine, mission.signals.items).row(),
    }
    if machine.unpowered:
        row["unpowered"] = list(machine.unpowered)
    return row
