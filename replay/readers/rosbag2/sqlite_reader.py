"""Storage files of rosbag2 in SQLite."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from itertools import pairwise
from pathlib import Path

import numpy as np

from replay.border import bordered
from replay.errors import LogError
from replay.log.raw_log import Clock, LogSummary, RawLog, TopicInfo, Window
from replay.log.reading_notes import Report
from replay.readers.common.room import NoRoom
from replay.readers.messages.assemble import Assembler
from replay.readers.messages.connection import Block, Connection
from replay.readers.rosbag2.message_compression import unpacked
from replay.readers.rosbag2.sqlite_file import open_image
from replay.readers.rosbag2.sqlite_messages import Database, Rows
from replay.readers.rosbag2.sqlite_topics import open_database
from replay.readers.rosbag2.sqlite_wal import SqliteError

_SMALLEST_ROW = 16


def read(
    files: list[Path],
    source: Path,
    report: Report,
    topics: Collection[str] | None,
    clock: Clock,
    window: Window | None,
    packed: bool,
    counted: Mapping[str, int] | None = None,
    texts: bool = False,
) -> RawLog:
    """Read the files of one recording as one log.

    Parameters
    ----------
    files : list[Path]
        Databases in recorded order.
    source : Path
        The recording.
    report : Report
        Takes notes and damage.
    topics, clock, window
        As in `Reader.read`.
    packed : bool
        Whether messages are compressed one by one.
    counted : Mapping[str, int] or None
        Messages per topic as the recording's metadata state them; they stand in the summary of a window.
    texts : bool
        As in `Reader.read`.

    Raises
    ------
    LogError
        Where none of the files can be read.
    """
    assembler = Assembler(clock, report, texts)
    bases = _open(files, source, report)
    own = bases[0].stated if counted is None and len(bases) == 1 else None
    counted = own if counted is None else counted
    if window is None:
        _expect(assembler, bases, counted or {})
    for base in bases:
        for rows in base.messages(topics, window, payloads=True):
            blocks = _split(base, rows)
            for part in unpacked(blocks, base.name, report) if packed else (blocks,):
                assembler.add(part)
    if window is None:
        _compare_times(bases, report)
        _compare_counts(bases, own, report)
    elif counted is None:
        bases = _open(files, source, Report())
        for base in bases:
            for _ in base.messages((), None, payloads=False):
                pass
    return assembler.finish(_summary(bases, source, report, counted if window is not None else None))


def summarise(files: list[Path], source: Path, report: Report, counted: bool = False) -> LogSummary:
    """Summarise the files of one recording; `counted` says that its metadata are compared elsewhere.

    Raises
    ------
    LogError
        Where none of them can be read.
    """
    bases = _open(files, source, report)
    for base in bases:
        for _ in base.messages((), None, payloads=False):
            pass
    _compare_counts(bases, bases[0].stated if not counted and len(bases) == 1 else None, report)
    return _summary(bases, source, report, None)


def _open(files: list[Path], source: Path, report: Report) -> list[Database]:
    bases, last = [], "no storage file"
    for path in files:
        try:
            with bordered(path, "rosbag2"):
                base = open_database(open_image(path, report), report)
        except NoRoom:
            raise
        except (SqliteError, LogError) as error:
            last = str(error) if isinstance(error, LogError) else f"{path.name} cannot be read: {error}"
            report.lost(last)
            continue
        if "messages" in base.tables or base.connections or base.image.suspects:
            bases.append(base)
            if "messages" not in base.tables:
                report.lost(f"{path.name} has no table of messages that is named in its schema")
        else:
            last = f"{path.name} holds no table of messages; found {', '.join(sorted(base.tables)[:8]) or 'no table'}"
            report.lost(last)
    if not bases:
        raise LogError(f"{source} is not a rosbag2 database that can be read: {last}")
    return bases


def _expect(assembler: Assembler, bases: list[Database], counted: Mapping[str, int]) -> None:
    """Foretell counts, as far as files of this size can hold them."""
    room = sum(len(b.image.data) for b in bases) // _SMALLEST_ROW
    for connection in {c: None for b in bases for c in b.connections.values()}:
        if 0 < counted.get(connection.topic, 0) <= room:
            assembler.expect(connection, counted[connection.topic])


def _compare_counts(bases: list[Database], own: Mapping[str, int] | None, report: Report) -> None:
    """Hold a database's own metadata against what was found in it."""
    found: Counter[str] = Counter()
    for number, connection in bases[0].connections.items():
        found[connection.topic] += bases[0].counts[number]
    for name, stated in sorted((own or {}).items()):
        if stated > found[name]:
            report.lost(
                f"{bases[0].name}: its metadata count {stated} messages on {name[:80]}, {found[name]} were found; "
                f"{stated - found[name]} are missing"
            )


def _compare_times(bases: list[Database], report: Report) -> None:
    """Say where a part starts before the one before it ends."""
    timed = [b for b in bases if b.bounds]
    for before, after in pairwise(timed):
        overlap = max(before.bounds) - min(after.bounds)
        if overlap > 0:
            report.note(f"{after.name} starts {overlap / 1e9:.3f} s before {before.name} ends; both were read whole")


def _split(base: Database, rows: Rows) -> Iterator[Block]:
    """Blocks of one batch, one per topic; losses of topics that are not named are the database's to report."""
    order = np.argsort(rows.topic, kind="stable")
    edges = np.flatnonzero(np.diff(rows.topic[order])) + 1
    for mine in np.split(order, edges):
        connection = base.connections.get(int(rows.topic[mine[0]])) if len(mine) else None
        if connection is not None:
            yield Block(connection, rows.data, rows.start[mine], rows.length[mine], rows.stamp[mine])


def _summary(bases: list[Database], source: Path, report: Report, counted: Mapping[str, int] | None) -> LogSummary:
    if not any(b.met or "messages" in b.tables or b.connections for b in bases):
        raise LogError(f"{source} holds nothing that can be read: {'; '.join(report.damage[:3])}")
    totals: dict[Connection, int] = {}
    for base in bases:
        for number, connection in sorted(base.connections.items()):
            totals[connection] = totals.get(connection, 0) + base.counts[number]
    topics = tuple(
        TopicInfo(c.topic, c.type_name, counted.get(c.topic, n) if counted else n, c.encoding, (), c.why_not())
        for c, n in totals.items()
    )
    named = sorted({c.type_name for c in totals if not c.definition and not c.why_not()})
    if named:
        more = f" and {len(named) - 5} more" if len(named) > 5 else ""
        report.note(f"definitions are not in the log and were taken by name: {', '.join(named[:5])}{more}")
    bounds = [b for base in bases for b in base.bounds]
    start, stop = (min(bounds), max(bounds)) if bounds else (0, 0)
    return LogSummary(
        str(source), "rosbag2", start, stop, topics, tuple(report.notes), tuple(report.damage),
        {"integrity": "unverifiable"},
    )  # fmt: skip
