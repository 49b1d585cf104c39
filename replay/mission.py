"""From the files of one mission to its signals and its timeline."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatch
from itertools import compress
from pathlib import Path

from replay.arrays.column_store import ColumnStore
from replay.clocks.align import align_clocks
from replay.clocks.source_clock import SourceClock
from replay.errors import ConfigError, LogError
from replay.log.content_hash import content_hash
from replay.log.empty_log import require_messages, silent_topics
from replay.log.joined_tables import joined_tables
from replay.log.left_out import FileLeftOut
from replay.log.open_loop import is_open_loop, is_open_loop_table
from replay.log.raw_log import LogSummary, RawLog
from replay.log.source_options import SourceOptions
from replay.log.stamp_order import in_order
from replay.machine.config import Machine
from replay.progress import Progress, Stage, Subscriber, silent
from replay.readers.registry import read_log, summarise_log
from replay.signals.file_names import named_channels
from replay.signals.mapping import NO_CHANNEL, map_signals, plan_topics
from replay.signals.near_misses import near_misses
from replay.signals.other_wheels import other_wheels
from replay.signals.rules import candidates
from replay.signals.signal import Signals
from replay.signals.timeline import Timeline, align, check_overlap
from replay.unused_files import require_use

_JOINED = "it goes on where another file's table ends, and was read as a part of that"
_UNUSED = "none of its channels is a signal of this machine; it is not used"


@dataclass(frozen=True)
class MissionFile:
    """One source of a mission.

    Attributes
    ----------
    path : Path
        As given.
    sha256 : str
        Of the content; of a folder, see `content_hash`.
    bytes : int
        Size; of a folder, of all its files.
    format : str
        As in `LogSummary`.
    summary : LogSummary
        Contents, notes and damage after decoding.
    clock : SourceClock or None
        How its clock was put onto the mission's.
    left_out : bool
        Whether its signals are not used, because its clock could not be compared with the others'.
    strange : bool
        Whether none of its channels is a signal of the machine; beside other files it is a note.
    joined : bool
        Whether it is a further part of another file's table.
    """

    path: Path
    sha256: str
    bytes: int
    format: str
    summary: LogSummary
    clock: SourceClock | None = None
    left_out: bool = False
    strange: bool = False
    joined: bool = False


@dataclass(frozen=True)
class Mission:
    """The files of one mission, their signals, and the signals on one time axis."""

    files: tuple[MissionFile, ...]
    signals: Signals
    timeline: Timeline

    @property
    def open_loop(self) -> bool:
        """Whether faults were written into the recording, so that its controller never met them."""
        return self.signals.open_loop


def source_options(path: Path, machine: Machine) -> SourceOptions:
    """Options of the first entry of [sources] whose pattern matches the file's name, else the defaults."""
    for pattern, options in machine.sources.items():
        if fnmatch(path.name, pattern):
            return options
    return SourceOptions()


def read_signals(
    paths: Sequence[Path], machine: Machine, *, progress: Subscriber = silent, store: ColumnStore | None = None
) -> tuple[tuple[MissionFile, ...], Signals]:
    """Read the files of one mission and find the machine's signals in them.

    Parameters
    ----------
    paths : Sequence[Path]
        Files and rosbag2 folders.
    machine : Machine
        Where its signals are recorded, and how its sources are to be read.
    progress : Subscriber
        Called at the beginning of each stage.
    store : ColumnStore or None
        Where long columns stand; None: one of the mission's own.

    Returns
    -------
    tuple[tuple[MissionFile, ...], Signals]
        The files in the given order, and the signals at their own stamps, on the clock of the first file where the
        files' clocks could be compared (`replay.clocks.align`).

    Raises
    ------
    LogError
        Where a file cannot be read.
    ConfigError
        Where a given unit does not fit its signal.
    """
    asked = [SourceOptions() if is_open_loop_table(path) else source_options(path, machine) for path in paths]
    files, parts = _read(paths, asked, machine, store or ColumnStore(), progress)
    logs = joined_tables(parts)
    heads = [next(i for i, part in enumerate(parts) if part.source == log.source) for log in logs]
    options = [asked[i] for i in heads]
    known = [
        any(True for _ in candidates(channels, machine)) or _given_in(log, machine)
        for log, channels in zip(logs, named_channels(logs), strict=True)
    ]
    known = known if any(known) else [True] * len(known)
    use = dict(zip(heads, known, strict=True))
    logs, options = list(compress(logs, known)), list(compress(options, known))
    if len(logs) > 1:
        progress(Progress(Stage.COMPARING_CLOCKS))
    logs, clocks = align_clocks(logs, machine, options)
    progress(Progress(Stage.MAPPING_SIGNALS))
    marked = [log for log in logs if is_open_loop(log.summary)]
    signals = map_signals(logs, _without_given(machine, marked))
    unused = (f"{file.path.name}: {_UNUSED}" for i, file in enumerate(files) if not use.get(i, True))
    notes = (*signals.notes, *unused, *(clock.sentence for clock in clocks if clock.sentence))
    clock_of = iter(clocks)
    dated = tuple(
        _joined(file) if i not in use else replace(file, clock=next(clock_of)) if use[i] else _strange(file)
        for i, file in enumerate(files)
    )
    missing = near_misses(signals.missing, [file.summary for file in files], NO_CHANNEL)
    every = {name: channel for channels in named_channels(logs) for name, channel in channels.items()}
    more = other_wheels(every, machine, {n: s.origin for n, s in signals.items.items()})
    return dated, replace(signals, missing=missing, notes=notes, open_loop=bool(marked), other_wheels=more)


def _joined(file: MissionFile) -> MissionFile:
    return replace(file, summary=replace(file.summary, notes=(*file.summary.notes, _JOINED)), joined=True)


def _strange(file: MissionFile) -> MissionFile:
    return replace(file, summary=replace(file.summary, notes=(*file.summary.notes, _UNUSED)), strange=True)


def _given_in(log: RawLog, machine: Machine) -> bool:
    """Whether a signal that the machine file names is a channel of a log."""
    return any(
        (s.topic is not None and any(c.topic.strip("/") == s.topic.strip("/") for c in log.channels.values()))
        or (s.column or s.symbol) in log.channels
        for s in machine.signals.values()
    )


def _read(
    paths: Sequence[Path], options: Sequence[SourceOptions], machine: Machine, store: ColumnStore, progress: Subscriber
) -> tuple[list[MissionFile], list[RawLog]]:
    """Decode of each file the topics that may hold the machine's signals."""
    summaries = []
    for path, option in zip(paths, options, strict=True):
        progress(Progress(Stage.OPENING, path.name))
        summaries.append(summarise_log(path, option))
    plan = plan_topics(summaries, machine)
    logs: list[RawLog] = []
    files: list[MissionFile] = []
    for path, option, summary in zip(paths, options, summaries, strict=True):
        progress(Progress(Stage.READING, path.name))
        log = in_order(read_log(path, option, plan.get(summary.source), store=store))
        progress(Progress(Stage.HASHING, path.name))
        sha256, size = content_hash(path)
        logs.append(log)
        files.append(MissionFile(path, sha256, size, log.format, _complete(summary, log.summary)))
    require_messages(summaries, logs)
    return files, logs


def _on_one_clock(files: tuple[MissionFile, ...], signals: Signals) -> tuple[tuple[MissionFile, ...], Signals]:
    """Leave out files whose clock could not be compared: what depends on their delay would look like faults."""
    apart = {str(f.path) for f in files if f.clock is not None and f.clock.reason}
    apart &= {s.source for s in signals.items.values()}
    if not apart:
        return files, signals
    check_overlap(signals)
    kept = {name: s for name, s in signals.items.items() if s.source not in apart}
    gone = {name: f"{Path(s.source).name} was left out" for name, s in signals.items.items() if s.source in apart}
    rest = replace(signals, items=kept, missing={**signals.missing, **gone})
    return tuple(_left_out(f) if str(f.path) in apart else f for f in files), rest


def _left_out(file: MissionFile) -> MissionFile:
    assert file.clock is not None
    why = file.clock.sentence.removeprefix(f"{file.path.name}: ")
    text = FileLeftOut(f"{file.path.name} was left out: {why}", clock=True)
    return replace(file, summary=replace(file.summary, damage=(*file.summary.damage, text)), left_out=True)


def _without_given(machine: Machine, marked: Sequence[RawLog]) -> Machine:
    """Leave out given signals that logs with injected faults hold under their own names: they stood in the original."""
    own = {c.signal for log in marked for c in candidates(log.channels, machine) if c.rank == 0}
    return replace(machine, signals={n: s for n, s in machine.signals.items() if n not in own}) if own else machine


def _complete(index: LogSummary, decoded: LogSummary) -> LogSummary:
    """Decoded summary with what only the index knew."""
    return replace(
        decoded,
        notes=tuple(dict.fromkeys((*index.notes, *decoded.notes))),
        damage=tuple(dict.fromkeys((*index.damage, *decoded.damage))),
    )


def load_mission(
    paths: Sequence[Path],
    machine: Machine,
    *,
    start_s: float | None = None,
    stop_s: float | None = None,
    progress: Subscriber = silent,
    store: ColumnStore | None = None,
) -> Mission:
    """Read the files of one mission onto one time axis.

    Parameters
    ----------
    paths : Sequence[Path]
        Files and rosbag2 folders.
    machine : Machine
        The machine.
    start_s, stop_s : float or None
        Part of the mission [s from its first wheel sample].
    progress : Subscriber
        Called at the beginning of each stage.
    store : ColumnStore or None
        Where long columns stand; None: one of the mission's own.

    Raises
    ------
    LogError
        Where a file cannot be read, no wheel signal is found, or the files do not overlap in time.
    ConfigError
        Where a given unit does not fit its signal, or values cannot be what their units make them.
    """
    files, signals = read_signals(paths, machine, progress=progress, store=store)
    check_units(signals)
    signals.store.release()
    progress(Progress(Stage.ALIGNING_SIGNALS))
    require_use(files, signals)
    try:
        files, signals = _on_one_clock(files, signals)
        timeline = align(signals, start_s, stop_s)
    except LogError as error:
        raise LogError(f"{', '.join(str(p) for p in paths)}: {error}{_cause(files)}") from error
    return Mission(files, signals, timeline)


def check_units(signals: Signals) -> None:
    """Raise a `ConfigError` where values cannot be what their units make them, with the lines that would mend them."""
    if signals.questions:
        raise ConfigError(f"values that cannot be, so nothing was judged: {first_question(signals)}")


def first_question(signals: Signals) -> str:
    """The first of some signals' questions, and how many more there are."""
    first, rest = signals.questions[0], len(signals.questions) - 1
    return first + (
        f" ({rest} more signal{'s' if rest > 1 else ''} likewise; `mfhca channels` lists them)" if rest else ""
    )


def _cause(files: Sequence[MissionFile]) -> str:
    """Why files may not make a mission: damage, else clocks that could not be compared, else topics without messages."""
    damage = [text for file in files for text in file.summary.damage]
    clocks = [f.clock.sentence for f in files if f.clock is not None and f.clock.reason]
    silent_there = silent_topics(file.summary for file in files)
    return f"; the log is damaged: {damage[0]}" if damage else f"; {clocks[0]}" if clocks else silent_there
