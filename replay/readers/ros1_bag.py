"""ROS 1 bags (format 2.0): indexed or not, complete or cut off."""

from __future__ import annotations

import struct
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from replay.errors import LogError
from replay.rawlog import Clock, LogSummary, RawLog, TopicInfo, Window
from replay.readers.assemble import Assembler, Block, Connection
from replay.readers.clocks import Report
from replay.readers.inflate import InflateError, inflate
from replay.readers.records import BagRecords, scan_bag
from replay.sources import SourceOptions

MAGIC = b"#ROSBAG V"
_VERSION = b"#ROSBAG V2.0\n"
_MESSAGE, _HEADER, _INDEX, _CHUNK, _INFO, _CONNECTION = 2, 3, 4, 5, 6, 7


@dataclass(frozen=True)
class _Chunk:
    start: int
    compression: str
    size: int
    body: int
    packed: int


@dataclass
class _Bag:
    """One opened bag."""

    path: Path
    data: NDArray[np.uint8]
    report: Report
    connections: dict[int, Connection] = field(default_factory=dict)
    chunks: list[_Chunk] = field(default_factory=list)
    indexed: dict[int, dict[int, int]] = field(default_factory=dict)
    bounds: list[int] = field(default_factory=list)


class Ros1BagReader:
    """Reader of ROS 1 bags."""

    format = "bag"

    def matches(self, path: Path) -> bool:
        """Whether the file starts with a bag's magic line."""
        if not path.is_file():
            return False
        with path.open("rb") as file:
            return file.read(len(MAGIC)) == MAGIC

    def summarise(self, path: Path, options: SourceOptions) -> LogSummary:
        """List topics and counts from the index, opening chunks only where it is absent.

        Raises
        ------
        LogError
            Where nothing in the bag can be read.
        """
        return _summary(_open(path, Report()))

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
            Where nothing in the bag can be read.
        """
        report = Report()
        bag = _open(path, report)
        assembler = Assembler(clock, report)
        for i, chunk in enumerate(bag.chunks):
            if topics is not None and not _may_hold(bag, bag.indexed.get(i), topics):
                continue
            opened = _open_chunk(bag, chunk)
            if opened is not None:
                assembler.add(_split(bag, *opened, topics))
        assembler.add(_split(bag, bag.data, scan_bag(bag.data, len(_VERSION)), topics))
        return assembler.finish(_summary(bag))


def _open(path: Path, report: Report) -> _Bag:
    try:
        size = path.stat().st_size
        if size == 0:
            raise LogError(f"{path} is empty (0 bytes); the recording was not written, copy or record it again")
        data: NDArray[np.uint8] = np.memmap(path, np.uint8, "r")
    except OSError as error:
        raise LogError(f"{path} cannot be read: {error.strerror or error}") from error
    first = data[: len(_VERSION)].tobytes()
    if first != _VERSION:
        raise LogError(f"{path} is not a ROS bag of version 2.0; found {first!r}; convert it with `rosbag migrate`")
    bag = _Bag(path, data, report)
    records = scan_bag(data, len(_VERSION))
    stated = _take_top(bag, records)
    if records.end < len(data):
        report.lost(
            f"{path.name}: {len(data) - records.end} bytes after byte {records.end} hold no complete record and were "
            "left out"
        )
    if stated is not None and not stated[0]:
        report.lost(f"{path.name} has no index (the recorder was not closed); its complete chunks were read in order")
    elif stated is not None and stated[1] != len(bag.chunks):
        report.lost(f"{path.name}: its header counts {stated[1]} chunks, {len(bag.chunks)} were found")
    return bag


def _fields(raw: bytes) -> dict[str, bytes]:
    """Header fields ``name=value`` of one record."""
    out, at = {}, 0
    while at + 4 <= len(raw):
        (size,) = struct.unpack_from("<I", raw, at)
        name, _, value = raw[at + 4 : at + 4 + size].partition(b"=")
        out[name.decode("ascii", "replace")] = value
        at += 4 + size
    return out


def _take_top(bag: _Bag, records: BagRecords) -> tuple[int, int] | None:
    """Take connections, chunks and index records; return index position and chunk count of the bag header."""
    stated = None
    for i, op in enumerate(records.op.tolist()):
        head, body, size = int(records.head[i]), int(records.body[i]), int(records.size[i])
        try:
            if op == _CONNECTION:
                _take_connection(bag, bag.data, records, i)
            elif op == _CHUNK:
                fields = _fields(bag.data[head : body - 4].tobytes())
                (full,) = struct.unpack("<I", fields["size"])
                compression = fields["compression"].decode("ascii", "replace")
                bag.chunks.append(_Chunk(head - 4, compression, full, body, size))
            elif op == _INDEX and bag.chunks:
                counts = bag.indexed.setdefault(len(bag.chunks) - 1, {})
                number = int(records.conn[i])
                counts[number] = counts.get(number, 0) + size // 12
                _take_bounds(bag, bag.data[body : body + size - size % 12].tobytes())
            elif op == _HEADER:
                fields = _fields(bag.data[head : body - 4].tobytes())
                stated = struct.unpack("<Q", fields["index_pos"])[0], struct.unpack("<I", fields["chunk_count"])[0]
                if fields.get("encryptor"):
                    raise LogError(f"{bag.path} is encrypted ({fields['encryptor']!r}); decrypt it with rosbag first")
        except (struct.error, KeyError, UnicodeDecodeError) as error:
            bag.report.lost(f"{bag.path.name}: record at byte {head - 4} is damaged ({type(error).__name__})")
    return stated


def _take_bounds(bag: _Bag, raw: bytes) -> None:
    stamps = np.frombuffer(raw, "<u4").reshape(-1, 3).astype(np.int64)
    if len(stamps):
        ns = stamps[:, 0] * 1_000_000_000 + stamps[:, 1]
        bag.bounds += [int(ns.min()), int(ns.max())]


def _take_connection(bag: _Bag, data: NDArray[np.uint8], records: BagRecords, i: int) -> None:
    head, body, size, number = (int(a[i]) for a in (records.head, records.body, records.size, records.conn))
    fields = _fields(data[head : body - 4].tobytes())
    inner = _fields(data[body : body + size].tobytes())
    topic = fields["topic"].decode("utf-8", "replace")
    text = inner["message_definition"].decode("utf-8", "replace")
    name = inner["type"].decode("ascii", "replace")
    bag.connections.setdefault(number, Connection(topic, name, "ros1", "ros1msg", text))


def _open_chunk(bag: _Bag, chunk: _Chunk) -> tuple[NDArray[np.uint8], BagRecords] | None:
    try:
        raw = inflate(chunk.compression, bag.data[chunk.body : chunk.body + chunk.packed].tobytes(), chunk.size)
    except InflateError as error:
        bag.report.lost(f"{bag.path.name}: the chunk at byte {chunk.start} was left out: {error}")
        return None
    data = np.frombuffer(raw, np.uint8)
    records = scan_bag(data)
    if records.end < len(data):
        bag.report.lost(
            f"{bag.path.name}: the chunk at byte {chunk.start} is damaged: its last {len(data) - records.end} bytes "
            "hold no complete record"
        )
    for i in np.flatnonzero(records.op == _CONNECTION):
        if int(records.conn[i]) not in bag.connections:
            try:
                _take_connection(bag, data, records, int(i))
            except (struct.error, KeyError, UnicodeDecodeError):
                bag.report.lost(f"{bag.path.name}: a connection in the chunk at byte {chunk.start} is damaged")
    return data, records


def _may_hold(bag: _Bag, counts: dict[int, int] | None, topics: Collection[str]) -> bool:
    """Whether a chunk with this index may hold one of the topics; one without index may."""
    if counts is None or any(n not in bag.connections for n in counts):
        return True
    return any(bag.connections[n].topic in topics for n in counts)


def _split(bag: _Bag, data: NDArray[np.uint8], records: BagRecords, topics: Collection[str] | None) -> Iterator[Block]:
    """Blocks of one buffer, one per connection."""
    messages = records.op == _MESSAGE
    for number in np.unique(records.conn[messages]):
        mine = messages & (records.conn == number)
        connection = bag.connections.get(int(number))
        if connection is None:
            bag.report.lost(f"{bag.path.name}: {mine.sum()} messages belong to connection {number}, which is not named")
        elif topics is None or connection.topic in topics:
            yield Block(connection, data, records.body[mine], records.size[mine], records.stamp[mine])


def _summary(bag: _Bag) -> LogSummary:
    counts: dict[int, int] = {}
    bounds = list(bag.bounds)
    for i, chunk in enumerate(bag.chunks):
        indexed = bag.indexed.get(i)
        if indexed is None or any(n not in bag.connections for n in indexed):
            opened = _open_chunk(bag, chunk)
            if opened is None:
                continue
            messages = opened[1].op == _MESSAGE
            numbers, repeats = np.unique(opened[1].conn[messages], return_counts=True)
            indexed = dict(zip(numbers.tolist(), repeats.tolist(), strict=True))
            stamps = opened[1].stamp[messages]
            bounds += [int(stamps.min()), int(stamps.max())] if len(stamps) else []
        for number, n in indexed.items():
            counts[number] = counts.get(number, 0) + n
    totals: dict[Connection, int] = {}
    for number, connection in bag.connections.items():
        totals[connection] = totals.get(connection, 0) + counts.get(number, 0)
    topics = tuple(TopicInfo(c.topic, c.type_name, n, c.encoding, (), c.why_not()) for c, n in totals.items())
    start, stop = (min(bounds), max(bounds)) if bounds else (0, 0)
    return LogSummary(
        str(bag.path),
        "bag",
        start,
        stop,
        topics,
        tuple(bag.report.notes),
        tuple(bag.report.damage),
        {"integrity": "unverifiable"},
    )
