"""One MCAP file of a diagnosis, to open beside its log or together with it, and layouts that show it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from diagnosis.clips.sources import APART_S, UNREADABLE, Source, open_sources
from diagnosis.results.document import ReportDocument
from diagnosis.ros.layouts import foxglove_diagnosis, plotjuggler_diagnosis
from diagnosis.ros.records import diagnosis_records, unmoved
from diagnosis.ros.statuses import courses, hardware_of
from replay.atomic_write import atomic_path
from replay.control.loop import replay_loop
from replay.errors import LogError, OutputError
from replay.export.clips.mcap import Definitions, Records, batch_records, write_clip
from replay.export.replay_log import replay_topics
from replay.machine.config import Machine
from replay.mission import Mission

MARK = "mfhca_export"
LAYOUTS = (".foxglove.json", ".plotjuggler.xml")
_LAST_ROS_NS = 2**32 * 1_000_000_000
_EVER = (-(2**63), 2**63 - 1)


@dataclass(frozen=True)
class Contents:
    """What the file holds: the diagnosis, the replayed loop, the log's own messages."""

    diagnostics: bool = True
    loop: bool = False
    log: bool = False


@dataclass(frozen=True)
class Exported:
    """What was written: files, number of messages, and what is to be said of them."""

    paths: tuple[Path, ...]
    messages: int
    notes: tuple[str, ...]


def check_same_mission(report: ReportDocument, mission: Mission, name: str) -> None:
    """See that a saved result is of the logs that were read.

    Raises
    ------
    LogError
        Where one of the logs is not among the result's.
    """
    known = {file["sha256"] for file in report["log"]["files"]}
    for file in mission.files:
        if file.sha256 not in known:
            raise LogError(
                f"{file.path}: is not a log of {name}, or has changed since; give the logs of that result, or leave out --result"
            )


def write_export(
    path: Path, mission: Mission, report: ReportDocument, machine: Machine, contents: Contents
) -> Exported:
    """Write the file, and with the diagnosis its layouts.

    Headers keep the mission's clock, which is that of the log's headers. Log stamps are the recorder's: the
    messages stand beside those of the log that hold the same moments, also where the log ran on simulation time.

    Parameters
    ----------
    path : Path
        MCAP file; an existing one is replaced.
    mission : Mission
        Its logs give the recorder's clock; without an MCAP log the mission's clock stands for it, which a note says.
    report : ReportDocument
        The diagnosis.
    machine : Machine
        The machine.
    contents : Contents
        What the file is to hold.

    Raises
    ------
    OutputError
        Where a file cannot be written, or the log's clock is beyond what ROS stamps hold.
    """
    first = report["log"]["start_ns"]
    if first < 0 or first + report["log"]["duration_s"] * 1e9 >= _LAST_ROS_NS:
        raise OutputError(f"{path}: ROS stamps hold 1970 to 2106, the log starts at {np.datetime64(first, 'ns')}")
    definitions, found = Definitions(), list[str]()
    with TemporaryDirectory(prefix="mfhca-") as scratch:
        sources = list(open_sources(mission, Path(scratch), found))
        notes = _notes(mission, sources, contents, [n for n in found if n.startswith(UNREADABLE)])
        places = sources[0].places if sources else unmoved
        parts: list[Iterator[Records]] = []
        if contents.diagnostics:
            parts.append(diagnosis_records(report, definitions, places))
        if contents.loop:
            batches = replay_topics(mission.timeline, replay_loop(mission.timeline, machine), machine)
            moved = (replace(b, log_stamps=places(b.log_stamps)) for b in batches)
            parts.append(iter([batch_records(b, definitions) for b in moved]))
        if contents.log:
            for source in sources:
                parts += [part.messages(*_EVER, part.define(definitions)) for part in source.parts]
        about = {
            "logs": ", ".join(f.path.name for f in mission.files),
            "machine": hardware_of(report),
            "verdict": str(report["verdict"]["status"]),
            "start_ns": str(first),
        }
        messages = write_clip(path, definitions, chain(*parts), about, MARK)
    written = [path]
    if contents.diagnostics:
        keys = {c.name: {k for s in c.statuses for k, _ in s.values} for c in courses(report)}
        texts = foxglove_diagnosis(list(keys)), plotjuggler_diagnosis(hardware_of(report), keys)
        for ending, text in zip(LAYOUTS, texts, strict=True):
            layout = path.with_name(path.stem + ending)
            with atomic_path(layout) as temporary:
                temporary.write_text(text, encoding="utf-8", newline="\n")
            written.append(layout)
    return Exported(tuple(written), messages, tuple(notes))


def _notes(mission: Mission, sources: Sequence[Source], contents: Contents, found: Sequence[str]) -> list[str]:
    """What is to be said of clocks, and of messages that are not in the file."""
    notes = list(found)
    if not sources:
        notes.append("No MCAP log gives a recorder's clock: the messages stand on the mission's clock.")
    elif abs(sources[0].apart_s) >= APART_S:
        notes.append(
            f"The recorder's clock is {sources[0].apart_s:+.3f} s from the mission's: the messages stand on the recorder's, "
            "beside the log's own; their headers keep the mission's."
        )
    if contents.log and len(sources) < len(mission.files):
        several = f"Of {len(mission.files)} logs the messages of {len(sources)} were copied"
        only = several if len(mission.files) > 1 else "The log's messages were not copied"
        notes.append(f"{only}: only those of MCAP can be.")
    return notes


def is_own(path: Path) -> bool:
    """Whether a file is one that this module wrote."""
    with path.open("rb") as file:
        return MARK.encode() in file.read(4096)
