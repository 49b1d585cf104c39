"""MCAP files: chunked or not, with or without index, complete or cut off."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from replay.errors import LogError
from replay.rawlog import Clock, LogSummary, RawLog, TopicInfo, Window
from replay.readers.assemble import Assembler, Block, Connection
from replay.readers.clocks import Report
from replay.readers.mcap_file import MAGIC, MESSAGE, McapFile, chunk_records, open_file
from replay.readers.records import Records, scan_mcap
from replay.sources import SourceOptions

_MESSAGE_HEAD = 22
_HEAD = np.dtype([("channel", "<u2"), ("sequence", "<u4"), ("log", "<i8"), ("publish", "<i8")])


class McapReader:
    """Reader of MCAP files."""

    format = "mcap"

    def matches(self, path: Path) -> bool:
        """Whether the file starts with MCAP's magic bytes."""
        if not path.is_file():
            return False
        with path.open("rb") as file:
            return file.read(len(MAGIC)) == MAGIC

    def summarise(self, path: Path, options: SourceOptions) -> LogSummary:
        """List topics and counts from index records, opening chunks only where these are absent.

        Raises
        ------
        LogError
            Where nothing in the file can be read.
        """
        report = Report()
        return summary_of([open_file(path, report)], path, self.format, report)

    def read(
        self,
        path: Path,
        options: SourceOptions,
        topics: Collection[str] | None = None,
        clock: Clock = "header",
        window: Window | None = None,
    ) -> RawLog:
        """Decode the given topics.

        Raises
        ------
        LogError
            Where nothing in the file can be read.
        """
        return read_files([path], path, self.format, Report(), topics, clock)


def read_files(
    files: list[Path], source: Path, name: str, report: Report, topics: Collection[str] | None, clock: Clock
) -> RawLog:
    """Read the files of one recording as one log; a file that cannot be read is damage unless it is the only one."""
    opened = open_files(files, source, report)
    assembler = Assembler(clock, report)
    for file in opened:
        for blocks in _blocks(file, topics):
            assembler.add(blocks)
    return assembler.finish(summary_of(opened, source, name, report))


def open_files(files: list[Path], source: Path, report: Report) -> list[McapFile]:
    """Open the files of one recording; raises `LogError` where none can be opened."""
    opened, last = [], LogError(f"{source}: no MCAP file in it")
    for path in files:
        try:
            opened.append(open_file(path, report))
        except LogError as error:
            last = error
            report.lost(str(error))
    if not opened:
        raise last
    return opened


def _heads(data: NDArray[np.uint8], records: Records) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[Any]]:
    """Payload starts, payload lengths and heads of the messages in a buffer."""
    pick = (records.op == MESSAGE) & (records.size >= _MESSAGE_HEAD)
    body, size = records.body[pick], records.size[pick]
    if not len(body):
        return body, size, np.empty(0, _HEAD)
    windows: NDArray[Any] = np.ndarray((len(data) - _MESSAGE_HEAD + 1,), f"V{_MESSAGE_HEAD}", data, strides=(1,))
    return body + _MESSAGE_HEAD, size - _MESSAGE_HEAD, windows[body].view(_HEAD)


def _split(
    file: McapFile, data: NDArray[np.uint8], records: Records, topics: Collection[str] | None
) -> Iterator[Block]:
    """Blocks of one buffer, one per channel."""
    start, size, head = _heads(data, records)
    for number in np.unique(head["channel"]):
        connection = file.channels.get(int(number))
        mine = head["channel"] == number
        if connection is None:
            file.report.lost(f"{file.path.name}: {mine.sum()} messages belong to channel {number}, which is not named")
        elif topics is None or connection.topic in topics:
            yield Block(connection, data, start[mine], size[mine], head["log"][mine], head["publish"][mine])


def _blocks(file: McapFile, topics: Collection[str] | None) -> Iterator[Iterator[Block]]:
    for start, stop in file.loose:
        yield _split(file, file.data, scan_mcap(file.data, start, stop), topics)
    wanted = None if topics is None else {n for n, c in file.channels.items() if c.topic in topics}
    for i, chunk in enumerate(file.chunks):
        counts = file.indexed.get(i)
        known = counts is not None and all(n in file.channels for n in counts)
        if wanted is not None and known and counts is not None and wanted.isdisjoint(counts):
            continue
        opened = chunk_records(file, chunk)
        if opened is not None:
            yield _split(file, *opened, topics)


def _counts(file: McapFile) -> tuple[dict[int, int], list[int]]:
    """Messages per channel, and the log stamps that bound them."""
    counts: dict[int, int] = {}
    bounds: list[int] = []

    def add(data: NDArray[np.uint8], records: Records) -> None:
        head = _heads(data, records)[2]
        if len(head):
            bounds.extend((int(head["log"].min()), int(head["log"].max())))
        for channel, n in zip(*np.unique(head["channel"], return_counts=True), strict=True):
            counts[int(channel)] = counts.get(int(channel), 0) + int(n)

    for start, stop in file.loose:
        add(file.data, scan_mcap(file.data, start, stop))
    for i, chunk in enumerate(file.chunks):
        indexed = file.indexed.get(i)
        if indexed is not None and all(n in file.channels for n in indexed):
            for channel, n in indexed.items():
                counts[channel] = counts.get(channel, 0) + n
            if any(indexed.values()):
                bounds += [chunk.first_ns, chunk.last_ns]
        elif (opened := chunk_records(file, chunk)) is not None:
            add(*opened)
    return counts, bounds


def summary_of(files: list[McapFile], source: Path, name: str, report: Report) -> LogSummary:
    """Summarise the files of one recording."""
    totals: dict[Connection, int] = {}
    bounds: list[int] = []
    metadata: dict[str, str] = {}
    for file in files:
        counts, edges = _counts(file)
        bounds += [b for b in edges if 0 <= b < 2**63]
        for number, connection in file.channels.items():
            totals[connection] = totals.get(connection, 0) + counts.get(number, 0)
        for key, value in file.metadata.items():
            metadata.setdefault(key, value)
        stated = file.statistics
        if stated is not None and sum(stated.values()) != sum(counts.values()):
            report.lost(
                f"{file.path.name}: its statistics count {sum(stated.values())} messages, {sum(counts.values())} "
                "were found"
            )
    topics = tuple(TopicInfo(c.topic, c.type_name, n, c.encoding, (), c.why_not()) for c, n in totals.items())
    start, stop = (min(bounds), max(bounds)) if bounds else (0, 0)
    return LogSummary(str(source), name, start, stop, topics, tuple(report.notes), tuple(report.damage), metadata)
