"""MCAP files: chunked or not, with or without index, complete or cut off."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from replay.errors import LogError
from replay.machine import SourceOptions
from replay.rawlog import Clock, LogSummary, RawLog, TopicInfo
from replay.readers.assemble import Assembler, Block, Connection
from replay.readers.clocks import Report
from replay.readers.inflate import InflateError, inflate
from replay.readers.records import Records, scan_mcap

MAGIC = b"\x89MCAP0\r\n"
_HEADER, _FOOTER, _SCHEMA, _CHANNEL, _MESSAGE, _CHUNK, _INDEX, _STATISTICS, _METADATA, _END = (
    1, 2, 3, 4, 5, 6, 7, 11, 12, 15,
)  # fmt: skip
_MESSAGE_HEAD = 22
_HEAD = np.dtype([("channel", "<u2"), ("sequence", "<u4"), ("log", "<i8"), ("publish", "<i8")])
_ENCODINGS = {"cdr": "cdr", "ros1": "ros1", "json": "json"}
_BAD = (struct.error, UnicodeDecodeError, IndexError, ValueError, KeyError)


@dataclass(frozen=True)
class _Chunk:
    """Where a chunk lies and what its head says."""

    start: int
    first_ns: int
    last_ns: int
    size: int
    crc: int
    compression: str
    body: int
    packed: int


@dataclass
class _File:
    """One opened MCAP file."""

    path: Path
    data: NDArray[np.uint8]
    report: Report
    schemas: dict[int, tuple[str, str, str]] = field(default_factory=dict)
    channels: dict[int, Connection] = field(default_factory=dict)
    pending: dict[int, tuple[int, str, str]] = field(default_factory=dict)
    chunks: list[_Chunk] = field(default_factory=list)
    loose: list[tuple[int, int]] = field(default_factory=list)
    metadata: dict[str, str] = field(default_factory=dict)
    statistics: dict[int, int] | None = None
    indexed: dict[int, dict[int, int]] = field(default_factory=dict)

    def bytes(self, start: int, size: int) -> bytes:
        return self.data[start : start + size].tobytes()


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


def open_files(files: list[Path], source: Path, report: Report) -> list[_File]:
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


def open_file(path: Path, report: Report) -> _File:
    """Walk the top-level records of a file.

    Raises
    ------
    LogError
        Where the file is empty, unreadable or not MCAP.
    """
    try:
        size = path.stat().st_size
        if size == 0:
            raise LogError(f"{path} is empty (0 bytes); the recording was not written, copy or record it again")
        data: NDArray[np.uint8] = np.memmap(path, np.uint8, "r")
    except OSError as error:
        raise LogError(f"{path} cannot be read: {error.strerror or error}") from error
    if data[: len(MAGIC)].tobytes() != MAGIC:
        raise LogError(f"{path} does not start as an MCAP file; found {data[:8].tobytes()!r}")
    file = _File(path, data, report)
    records = scan_mcap(data, len(MAGIC))
    _take_top(file, records)
    closed = bool(len(records.op)) and int(records.op[-1]) == _FOOTER
    if not closed:
        _cut(file, records)
    _connect(file)
    return file


def _cut(file: _File, records: Records) -> None:
    """Say what a missing footer means."""
    left = len(file.data) - records.end
    ended = bool(np.any(records.op == _END))
    where = "after the data" if ended else "while data were written"
    file.report.lost(
        f"{file.path.name} ends without a footer ({where}): {left} bytes after byte {records.end} "
        "hold no complete record and were left out"
    )


def _take_top(file: _File, records: Records) -> None:
    run: int | None = None
    after = 0
    last_chunk = -1
    for op, body, size in zip(records.op.tolist(), records.body.tolist(), records.size.tolist(), strict=True):
        if op == _MESSAGE:
            run = body - 9 if run is None else run
            after = body + size
            continue
        try:
            if op in (_SCHEMA, _CHANNEL):
                _take_name(file, op, file.bytes(body, size))
            elif op == _CHUNK:
                last_chunk = len(file.chunks)
                file.chunks.append(_chunk(file, body, size))
            elif op == _INDEX and last_chunk >= 0:
                channel, length = struct.unpack_from("<HI", file.bytes(body, 6))
                counts = file.indexed.setdefault(last_chunk, {})
                counts[channel] = counts.get(channel, 0) + length // 16
            elif op == _STATISTICS:
                file.statistics = _statistics(file.bytes(body, size))
            elif op == _METADATA:
                name, at = _text(raw := file.bytes(body, size), 0)
                file.metadata.update({f"{name}.{k}": v for k, v in _map(raw, at).items()})
            elif op == _HEADER:
                profile, at = _text(raw := file.bytes(body, size), 0)
                file.metadata.update(profile=profile, library=_text(raw, at)[0])
        except _BAD as error:
            file.report.lost(f"{file.path.name}: record at byte {body - 9} is damaged ({type(error).__name__})")
    if run is not None:
        file.loose.append((run, after))


def _text(raw: bytes, at: int) -> tuple[str, int]:
    (size,) = struct.unpack_from("<I", raw, at)
    if at + 4 + size > len(raw):
        raise ValueError("text beyond its record")
    return raw[at + 4 : at + 4 + size].decode(), at + 4 + size


def _map(raw: bytes, at: int) -> dict[str, str]:
    (size,) = struct.unpack_from("<I", raw, at)
    at, end, out = at + 4, at + 4 + size, {}
    while at < end:
        key, at = _text(raw, at)
        out[key], at = _text(raw, at)
    return out


def _statistics(raw: bytes) -> dict[int, int]:
    (size,) = struct.unpack_from("<I", raw, 42)
    return dict(struct.iter_unpack("<HQ", raw[46 : 46 + size]))


def _take_name(file: _File, op: int, raw: bytes) -> None:
    """Take a schema or channel record; channels may come before their schemas."""
    (number,) = struct.unpack_from("<H", raw)
    if op == _SCHEMA:
        name, at = _text(raw, 2)
        encoding, at = _text(raw, at)
        (size,) = struct.unpack_from("<I", raw, at)
        text = raw[at + 4 : at + 4 + size].decode("utf-8", "replace")
        file.schemas.setdefault(number, (name, encoding, text))
    else:
        (schema,) = struct.unpack_from("<H", raw, 2)
        topic, at = _text(raw, 4)
        file.pending.setdefault(number, (schema, topic, _text(raw, at)[0]))


def _connect(file: _File) -> None:
    for number, (schema, topic, encoding) in file.pending.items():
        name, language, text = file.schemas.get(schema, ("", "", ""))
        file.channels[number] = Connection(topic, name, _ENCODINGS.get(encoding, encoding), language, text)


def _chunk(file: _File, body: int, size: int) -> _Chunk:
    head = file.bytes(body, min(size, 256))
    first, last, full, crc = struct.unpack_from("<QQQI", head)
    compression, at = _text(head, 28)
    (packed,) = struct.unpack_from("<Q", head, at)
    if at + 8 + packed > size:
        raise ValueError("chunk data beyond their record")
    return _Chunk(body - 9, first, last, full, crc, compression, body + at + 8, packed)


def _open_chunk(file: _File, chunk: _Chunk) -> NDArray[np.uint8] | None:
    """Return a chunk's records, or None where they are damaged (which is reported)."""
    try:
        raw = inflate(chunk.compression, file.bytes(chunk.body, chunk.packed), chunk.size)
    except InflateError as error:
        file.report.lost(f"{file.path.name}: the chunk at byte {chunk.start} was left out: {error}")
        return None
    if chunk.crc and zlib.crc32(raw) != chunk.crc:
        file.report.lost(f"{file.path.name}: the chunk at byte {chunk.start} was left out: its checksum differs")
        return None
    if not chunk.crc and len(raw):
        file.report.note(f"{file.path.name} has chunks without checksums; their integrity cannot be verified")
    return np.frombuffer(raw, np.uint8)


def _chunk_records(file: _File, chunk: _Chunk) -> tuple[NDArray[np.uint8], Records] | None:
    data = _open_chunk(file, chunk)
    if data is None:
        return None
    records = scan_mcap(data)
    if records.end < len(data):
        file.report.lost(
            f"{file.path.name}: the chunk at byte {chunk.start} is damaged: its last {len(data) - records.end} bytes "
            "hold no complete record"
        )
    names = np.flatnonzero((records.op == _SCHEMA) | (records.op == _CHANNEL))
    for i in names:
        body, size = int(records.body[i]), int(records.size[i])
        try:
            _take_name(file, int(records.op[i]), data[body : body + size].tobytes())
        except _BAD:
            file.report.lost(f"{file.path.name}: a schema or channel in the chunk at byte {chunk.start} is damaged")
    if len(names):
        _connect(file)
    return data, records


def _heads(data: NDArray[np.uint8], records: Records) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[Any]]:
    """Payload starts, payload lengths and heads of the messages in a buffer."""
    pick = (records.op == _MESSAGE) & (records.size >= _MESSAGE_HEAD)
    body, size = records.body[pick], records.size[pick]
    if not len(body):
        return body, size, np.empty(0, _HEAD)
    windows: NDArray[Any] = np.ndarray((len(data) - _MESSAGE_HEAD + 1,), f"V{_MESSAGE_HEAD}", data, strides=(1,))
    return body + _MESSAGE_HEAD, size - _MESSAGE_HEAD, windows[body].view(_HEAD)


def _split(file: _File, data: NDArray[np.uint8], records: Records, topics: Collection[str] | None) -> Iterator[Block]:
    """Blocks of one buffer, one per channel."""
    start, size, head = _heads(data, records)
    for number in np.unique(head["channel"]):
        connection = file.channels.get(int(number))
        mine = head["channel"] == number
        if connection is None:
            file.report.lost(f"{file.path.name}: {mine.sum()} messages belong to channel {number}, which is not named")
        elif topics is None or connection.topic in topics:
            yield Block(connection, data, start[mine], size[mine], head["log"][mine], head["publish"][mine])


def _blocks(file: _File, topics: Collection[str] | None) -> Iterator[Iterator[Block]]:
    for start, stop in file.loose:
        yield _split(file, file.data, scan_mcap(file.data, start, stop), topics)
    wanted = None if topics is None else {n for n, c in file.channels.items() if c.topic in topics}
    for i, chunk in enumerate(file.chunks):
        counts = file.indexed.get(i)
        known = counts is not None and all(n in file.channels for n in counts)
        if wanted is not None and known and counts is not None and wanted.isdisjoint(counts):
            continue
        opened = _chunk_records(file, chunk)
        if opened is not None:
            yield _split(file, *opened, topics)


def _counts(file: _File) -> tuple[dict[int, int], list[int]]:
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
        elif (opened := _chunk_records(file, chunk)) is not None:
            add(*opened)
    return counts, bounds


def summary_of(files: list[_File], source: Path, name: str, report: Report) -> LogSummary:
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
