"""Each fault cut out of its mission: an MCAP file with the messages around it, and layouts that show it."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from diagnosis.clips.plots import plots_of
from diagnosis.clips.sources import APART_S, Source, open_sources
from diagnosis.results.document import IntervalRow
from diagnosis.results.result import MissionResult
from diagnosis.results.vocabulary import Severity
from diagnosis.ros.records import diagnosis_records, unmoved
from replay.atomic_write import atomic_path
from replay.control.loop import Replay, replay_loop
from replay.errors import OutputError
from replay.export.clips.mcap import MARK, Definitions, Records, batch_records, write_clip
from replay.export.clips.topics import evidence_topic, loop_topics, open_loop_topic, signal_topics
from replay.export.clips.viewer_layouts import foxglove_layout, plotjuggler_layout
from replay.machine.config import Machine
from replay.mission import Mission
from replay.progress import Progress, Stage, Subscriber, silent

MOST = 50
ENDINGS = (".mcap", ".foxglove.json", ".plotjuggler.xml")
_LAST_ROS_NS = 2**32 * 1_000_000_000
_UNSAFE = re.compile(r"[^\w.+-]+")
_LONGEST_NAME = 80
_LONGEST_NS = 600_000_000_000


@dataclass(frozen=True)
class Clips:
    """What was written.

    Attributes
    ----------
    paths : tuple[Path, ...]
        The MCAP files, most severe fault first.
    left_out : int
        Faults for which there was no place among the first `MOST`.
    notes : tuple[str, ...]
        What the clips do not hold, one sentence each.
    """

    paths: tuple[Path, ...]
    left_out: int
    notes: tuple[str, ...]


@dataclass(frozen=True)
class _Diagnosed:
    """A mission with its replayed loop and its diagnosis."""

    mission: Mission
    replay: Replay
    machine: Machine
    result: MissionResult


def clip_name(fault: IntervalRow) -> str:
    """File name of a fault's clip without ending, of characters that every file system takes: ``F1 FR sensor stuck``."""
    words = (fault["id"], fault["component"], fault["side"], fault["mode"])
    safe = " ".join(_UNSAFE.sub("_", w) for w in words)
    return safe[:_LONGEST_NAME].rstrip(" .").lstrip(".") or "fault"


def chosen_faults(intervals: Sequence[IntervalRow], most: int = MOST) -> tuple[list[IntervalRow], int]:
    """Give the faults of at least low severity, most severe first, and how many more there are than `most`."""
    faults = [f for f in intervals if f["severity"] != Severity.INFO]
    faults.sort(key=lambda f: (-Severity(f["severity"]).rank, f["start_s"]))
    return faults[:most], max(len(faults) - most, 0)


def write_clips(
    mission: Mission,
    result: MissionResult,
    machine: Machine,
    folder: Path,
    *,
    margin_s: float = 5.0,
    progress: Subscriber = silent,
) -> Clips:
    """Write a clip and two layouts per fault.

    A clip holds the original messages of MCAP logs as they were written, all topics, and beside them, for every format,
    the mapped signals (``/mfhca/mapped_<n>``), the replayed loop (``/mfhca/…``), the evidence (``/mfhca/evidence``), the state
    of every part (``/mfhca/diagnostics``) and the beginnings and ends of faults (``/mfhca/events``).
    Clips of an earlier run in the folder are replaced; other files in it are left alone.

    Parameters
    ----------
    mission : Mission
        The mission that was diagnosed.
    result : MissionResult
        Its diagnosis.
    machine : Machine
        The machine.
    folder : Path
        Where to; made if absent.
    margin_s : float
        Time before and behind each fault [s].
    progress : Subscriber
        Called at the beginning of each stage.

    Raises
    ------
    OutputError
        Where the folder cannot be written, or holds another file under the name of a clip.
    """
    faults, left_out = chosen_faults(result.report["intervals"])
    names = [clip_name(f) for f in faults]
    targets = {folder / (name + ending) for name in names for ending in ENDINGS}
    _check(mission, targets)
    _remove_earlier(folder, targets)
    if not faults:
        return Clips((), 0, ())
    _make(folder)
    progress(Progress(Stage.REPLAYING_FOR_CLIPS))
    diagnosed = _Diagnosed(mission, replay_loop(mission.timeline, machine), machine, result)
    progress(Progress(Stage.READING_FOR_CLIPS))
    notes = [
        f"{f['id']}: lasts {f['stop_s'] - f['start_s']:.0f} s; its clip holds the first {_LONGEST_NS * 1e-9:.0f} s."
        for f in faults
        if _end(f) < f["stop_ns"]
    ]
    written = []
    with TemporaryDirectory(prefix="mfhca-") as scratch:
        sources = list(open_sources(mission, Path(scratch), notes))
        for fault, name in zip(faults, names, strict=True):
            progress(Progress(Stage.WRITING, name))
            written.append(_write(fault, folder / name, diagnosed, sources, round(margin_s * 1e9)))
    return Clips(tuple(written), left_out, tuple(notes))


def _check(mission: Mission, targets: Iterable[Path]) -> None:
    """Raise an `OutputError` where a clip cannot be written, before anything is."""
    timeline = mission.timeline
    if timeline.start_ns < 0 or timeline.start_ns + timeline.size * timeline.step_ns >= _LAST_ROS_NS:
        raise OutputError(
            f"MCAP clips hold 1970 to 2106, the log starts at {np.datetime64(timeline.start_ns, 'ns')}; diagnose without "
            "--clips"
        )
    for path in sorted(targets):
        if path.exists() and not _is_own(path):
            raise OutputError(
                f"{path}: exists, and is not a clip of this tool; move it away, or give another folder with -o"
            )


def _remove_earlier(folder: Path, targets: Collection[Path]) -> None:
    """Remove the clips and layouts of an earlier run that are not written again."""
    if folder.is_dir():
        for path in folder.iterdir():
            if path not in targets and path.name.endswith(ENDINGS) and _is_own(path):
                path.unlink()


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"{folder}: cannot make the folder ({error.strerror or error})") from error


def _is_own(path: Path) -> bool:
    """Whether a file is a clip or a layout that this tool wrote."""
    if not path.is_file():
        return False
    with path.open("rb") as file:
        return MARK.encode() in file.read(4096)


def _end(fault: IntervalRow) -> int:
    """Stamp up to which a fault is cut out: of a long one the beginning."""
    return min(fault["stop_ns"], fault["start_ns"] + _LONGEST_NS)


def _write(
    fault: IntervalRow,
    stem: Path,
    diagnosed: _Diagnosed,
    sources: Sequence[Source],
    margin_ns: int,
) -> Path:
    """Write one clip and its layouts."""
    mission, machine = diagnosed.mission, diagnosed.machine
    start, stop = fault["start_ns"] - margin_ns, _end(fault) + margin_ns
    definitions = Definitions()
    copied: list[Iterator[Records]] = []
    for source in sources:
        first, last = source.places(np.array([start, stop])).tolist()
        copied += [part.messages(first, last, part.define(definitions)) for part in source.parts]
    signals = signal_topics(mission.signals, start, stop)
    loop = loop_topics(mission.timeline, diagnosed.replay, machine, start, stop)
    evidence = evidence_topic(diagnosed.result.columns, fault["component"], mission.timeline.start_ns, start, stop)
    named = [*signals, *([evidence] if evidence else [])]
    batches = [*(b for b, _ in named), *loop]
    if mission.open_loop:
        batches.append(open_loop_topic(max(start, mission.timeline.start_ns)))
    moved = bool(sources) and abs(sources[0].apart_s) >= APART_S
    places = sources[0].places if moved else unmoved
    if moved:  # beside the original messages, not hours from them
        batches = [replace(b, log_stamps=places(b.log_stamps)) for b in batches]
    own = [batch_records(batch, definitions) for batch in batches]
    told = diagnosis_records(diagnosed.result.report, definitions, places, start, stop)
    about = {
        "fault": " ".join((fault["id"], fault["component"], fault["side"], fault["mode"], fault["severity"])),
        "start_ns": str(fault["start_ns"]),
        "stop_ns": str(fault["stop_ns"]),
        "margin_s": f"{margin_ns * 1e-9:g}",
        "logs": ", ".join(f.path.name for f in mission.files),
    }
    path = stem.with_name(stem.name + ENDINGS[0])
    write_clip(path, definitions, chain(own, told, *copied), about)
    parts = [(b.topic, names) for b, names in named] + [
        (b.topic, machine.axles if b.topic.startswith("/mfhca/steer_") else machine.wheels) for b in loop
    ]
    plots = plots_of(fault, parts)
    for ending, text in zip(
        ENDINGS[1:], (foxglove_layout(stem.name, plots), plotjuggler_layout(stem.name, plots)), strict=True
    ):
        with atomic_path(stem.with_name(stem.name + ending)) as temporary:
            temporary.write_text(text, encoding="utf-8", newline="\n")
    return path
