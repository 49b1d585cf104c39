"""Storage files of rosbag2 in SQLite."""

from __future__ import annotations

import shutil
import sqlite3
from collections.abc import Collection, Iterator
from contextlib import closing, contextmanager
from itertools import islice
from pathlib import Path

import numpy as np
import zstandard

from replay.errors import LogError
from replay.rawlog import Clock, LogSummary, RawLog, TopicInfo
from replay.readers.assemble import Assembler, Block, Connection
from replay.readers.clocks import Report
from replay.readers.inflate import MAX_CHUNK

_BATCH = 65_536


@contextmanager
def _database(path: Path, report: Report, scratch: Path) -> Iterator[sqlite3.Connection]:
    """Open a database without touching it; one with a write-ahead log is read whole from a copy."""
    wal = path.with_name(path.name + "-wal")
    journal = path.with_name(path.name + "-journal")
    mode = "mode=ro&immutable=1"
    for beside in (wal, journal):
        if beside.is_file() and beside.stat().st_size:
            copy = scratch / path.name
            shutil.copyfile(path, copy)
            shutil.copyfile(beside, scratch / beside.name)
            report.note(f"{path.name} was not closed by its recorder; it was read together with {beside.name}")
            path, mode = copy, "mode=rw"
    _check_size(path, report)
    with closing(sqlite3.connect(f"{path.resolve().as_uri()}?{mode}", uri=True)) as base:
        base.execute("pragma writable_schema = on")  # lets a file that was cut off be read as far as it goes
        base.text_factory = lambda raw: raw.decode("utf-8", "replace")
        yield base


def _check_size(path: Path, report: Report) -> None:
    """Compare the file's size with the page count in its header, where that is stated to be valid."""
    with path.open("rb") as file:
        head = file.read(100)
    if len(head) == 100 and head[24:28] == head[92:96]:
        page = int.from_bytes(head[16:18], "big")
        stated = int.from_bytes(head[28:32], "big") * (65_536 if page == 1 else page)
        if path.stat().st_size < stated:
            report.lost(f"{path.name} was cut off: {path.stat().st_size} of {stated} bytes are there")


def _connections(base: sqlite3.Connection, report: Report) -> dict[int, Connection]:
    """Topics by number, with their definitions where the file holds them."""
    texts: dict[str, tuple[str, str]] = {}
    if base.execute("select 1 from sqlite_master where name = 'message_definitions'").fetchone():
        for name, encoding, text in base.execute(
            "select topic_type, encoding, encoded_message_definition from message_definitions"
        ):
            texts[str(name)] = (str(encoding), str(text))
    rows = base.execute("select id, name, type, serialization_format from topics").fetchall()
    return {
        int(i): Connection(str(name), str(kind), str(encoding), *texts.get(str(kind), ("", "")))
        for i, name, kind, encoding in rows
        if isinstance(i, int)
    }


def _blocks(
    path: Path, base: sqlite3.Connection, report: Report, topics: Collection[str] | None, packed: bool
) -> Iterator[Iterator[Block]]:
    """Blocks of one file, in batches of rows in recorded order."""
    known = _connections(base, report)
    wanted = {i: c for i, c in known.items() if topics is None or c.topic in topics}
    marks = ",".join(str(i) for i in wanted)
    where = f"from messages where topic_id in ({marks})"  # integers only
    rows = base.execute(
        f"select topic_id, timestamp, data {where} and typeof(data) = 'blob' and typeof(timestamp) = 'integer' "
        "order by id"
    )
    while True:
        batch: list[tuple[int, int, bytes]] = []
        try:
            batch.extend(islice(rows, _BATCH))
        except (sqlite3.Error, MemoryError, OverflowError) as error:
            report.lost(f"{path.name}: its messages cannot be read to the end: {error}")
            yield _split(path, batch, wanted, report, packed)
            return
        if not batch:
            return
        yield _split(path, batch, wanted, report, packed)


def _split(
    path: Path, rows: list[tuple[int, int, bytes]], known: dict[int, Connection], report: Report, packed: bool
) -> Iterator[Block]:
    if packed:
        rows = _unpack(path, rows, report)
    if not rows:
        return
    numbers, stamps, payloads = zip(*rows, strict=True)
    data = np.frombuffer(b"".join(payloads), np.uint8)
    lengths = np.fromiter(map(len, payloads), np.int64, len(payloads))
    starts = np.cumsum(lengths) - lengths
    number, stamp = np.array(numbers, np.int64), np.array(stamps, np.int64)
    for i in np.unique(number):
        mine = number == i
        yield Block(known[int(i)], data, starts[mine], lengths[mine], stamp[mine])


def _unpack(path: Path, rows: list[tuple[int, int, bytes]], report: Report) -> list[tuple[int, int, bytes]]:
    """Expand messages that were compressed one by one (stated slow path)."""
    out = []
    for number, stamp, data in rows:
        try:
            size = zstandard.get_frame_parameters(data).content_size
            if size > MAX_CHUNK:
                raise zstandard.ZstdError("declared size")
            out.append((number, stamp, zstandard.ZstdDecompressor().decompress(data, max_output_size=MAX_CHUNK)))
        except zstandard.ZstdError:
            report.lost(f"{path.name}: compressed messages are damaged; they were left out")
    return out


def read(
    files: list[Path],
    source: Path,
    report: Report,
    scratch: Path,
    topics: Collection[str] | None,
    clock: Clock,
    packed: bool,
) -> RawLog:
    """Read the files of one recording as one log.

    Raises
    ------
    LogError
        Where none of them can be read.
    """
    assembler = Assembler(clock, report)
    for path in files:
        try:
            with _database(path, report, scratch) as base:
                for blocks in _blocks(path, base, report, topics, packed):
                    assembler.add(blocks)
        except (sqlite3.Error, OSError) as error:
            report.lost(f"{path.name} cannot be read: {error}")
    return assembler.finish(summarise(files, source, report, scratch))


def _counts(path: Path, base: sqlite3.Connection, report: Report) -> dict[int, tuple[int, int, int]]:
    """Messages and first and last stamp per topic, as far as the table can be read."""
    proper = "typeof(data) = 'blob' and typeof(timestamp) = 'integer' and timestamp >= 0"
    try:
        total = base.execute("select count(*) from messages").fetchone()[0]
        rows = base.execute(
            f"select topic_id, count(*), min(timestamp), max(timestamp) from messages where {proper} group by topic_id"
        )
        counts = {i: (n, first, last) for i, n, first, last in rows}
    except sqlite3.Error:
        return _readable_counts(path, base, report, proper)
    lost = total - sum(n for n, _, _ in counts.values())
    if lost:
        report.lost(f"{path.name}: {lost} rows hold no message with a proper stamp")
    return counts


def _readable_counts(
    path: Path, base: sqlite3.Connection, report: Report, proper: str
) -> dict[int, tuple[int, int, int]]:
    found: list[tuple[int, int]] = []
    proper += " and typeof(topic_id) = 'integer'"
    try:
        found.extend(base.execute(f"select topic_id, timestamp from messages not indexed where {proper}"))
    except (sqlite3.Error, OverflowError) as error:
        report.lost(f"{path.name}: its messages cannot be read to the end: {error}")
    table = np.array(found, np.int64).reshape(-1, 2)
    split = {int(i): table[table[:, 0] == i, 1] for i in np.unique(table[:, 0])}
    return {i: (len(s), int(s.min()), int(s.max())) for i, s in split.items()}


def summarise(files: list[Path], source: Path, report: Report, scratch: Path) -> LogSummary:
    """Summarise the files of one recording.

    Raises
    ------
    LogError
        Where none of them can be read.
    """
    totals: dict[Connection, int] = {}
    bounds: list[int] = []
    readable, last = 0, "no storage file"
    for path in files:
        try:
            with _database(path, report, scratch) as base:
                known = _connections(base, report)
                readable += 1
                for connection in known.values():
                    totals.setdefault(connection, 0)
                for i, (n, first, final) in _counts(path, base, report).items():
                    if i in known:
                        totals[known[i]] += n
                        bounds += [first, final]
                    else:
                        report.lost(f"{path.name}: {n} messages belong to topic {i}, which is not named")
        except (sqlite3.Error, OSError) as error:
            last = f"{path.name} cannot be read: {error}"
            report.lost(last)
    if not readable:
        raise LogError(f"{source} is not a rosbag2 database that can be read: {last}")
    topics = tuple(TopicInfo(c.topic, c.type_name, n, c.encoding, (), c.why_not()) for c, n in totals.items())
    named = sorted({c.type_name for c in totals if not c.definition and not c.why_not()})
    if named:
        more = f" and {len(named) - 5} more" if len(named) > 5 else ""
        report.note(f"definitions are not in the log and were taken by name: {', '.join(named[:5])}{more}")
    start, stop = (min(bounds), max(bounds)) if bounds else (0, 0)
    return LogSummary(
        str(source),
        "rosbag2",
        start,
        stop,
        topics,
        tuple(report.notes),
        tuple(report.damage),
        {"integrity": "unverifiable"},
    )
