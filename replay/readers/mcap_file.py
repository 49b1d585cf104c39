"""Records of an MCAP file: chunks, channels, schemas and what is damaged among them."""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from replay.errors import LogError
from replay.readers.assemble import Connection
from replay.readers.clocks import Report
from replay.readers.inflate import InflateError, inflate
from replay.readers.records import Records, scan_mcap

MAGIC = b"\x89MCAP0\r\n"
_HEADER, _FOOTER, _SCHEMA, _CHANNEL, MESSAGE, _CHUNK, _INDEX, _CHUNK_INDEX, _STATISTICS, _METADATA, _END = (
    1, 2, 3, 4, 5, 6, 7, 8, 11, 12, 15,
)  # fmt: skip
_TAIL = 9 + 20 + len(MAGIC)
_BAD = (struct.error, UnicodeDecodeError, IndexError, ValueError, KeyError)


_Entry = TypeVar("_Entry")


@dataclass(frozen=True)
class McapChunk:
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
class McapFile:
    """One opened MCAP file."""

    path: Path
    data: NDArray[np.uint8]
    report: Report
    schemas: dict[int, tuple[str, str, str]] = field(default_factory=dict)
    channels: dict[int, Connection] = field(default_factory=dict)
    pending: dict[int, tuple[int, str, str]] = field(default_factory=dict)
    chunks: list[McapChunk] = field(default_factory=list)
    loose: list[tuple[int, int]] = field(default_factory=list)
    metadata: dict[str, str] = field(default_factory=dict)
    statistics: dict[int, int] | None = None
    indexed: dict[int, dict[int, int]] = field(default_factory=dict)

    def bytes(self, start: int, size: int) -> bytes:
        """Copy `size` bytes from `start`, fewer at the end of the file."""
        return self.data[start : start + size].tobytes()


def open_file(path: Path, report: Report) -> McapFile:
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
    file = McapFile(path, data, report)
    records = scan_mcap(data, len(MAGIC))
    _take_top(file, records)
    while not _closed(records):
        again = _next_chunk(file, records.end)
        if again is None:
            _cut(file, records)
            break
        report.lost(f"{path.name}: bytes {records.end} to {again} hold no complete record and were left out")
        records = scan_mcap(data, again)
        _take_top(file, records)
    _check_summary(file)
    bare = bool(file.loose) or any(not c.crc and c.size for c in file.chunks)
    file.metadata["integrity"] = "unverifiable" if bare else "checksums"
    _connect(file)
    return file


def _closed(records: Records) -> bool:
    return bool(len(records.op)) and int(records.op[-1]) == _FOOTER


def _footer(file: McapFile) -> tuple[int, int] | None:
    """Start of the summary section and its checksum, from the file's last bytes."""
    tail = file.bytes(max(len(file.data) - _TAIL, 0), _TAIL)
    if len(tail) < _TAIL or tail[0] != _FOOTER or not tail.endswith(MAGIC):
        return None
    start, _, crc = struct.unpack_from("<QQI", tail, 9)
    return (start, crc) if 0 < start < len(file.data) - _TAIL else None


def _next_chunk(file: McapFile, after: int) -> int | None:
    """Start of the first chunk behind a damaged place, from the chunk index."""
    footer = _footer(file)
    if footer is None or footer[0] <= after:
        return None
    index = scan_mcap(file.data, footer[0])
    starts = [
        struct.unpack_from("<Q", file.bytes(b, s), 16)[0]
        for o, b, s in zip(index.op.tolist(), index.body.tolist(), index.size.tolist(), strict=True)
        if o == _CHUNK_INDEX and s >= 24
    ]
    behind = [n for n in starts if after < n < len(file.data)]
    return min(behind, default=None)


def _check_summary(file: McapFile) -> None:
    footer = _footer(file)
    if footer is not None and footer[1]:
        until = len(file.data) - len(MAGIC) - 4
        if zlib.crc32(file.bytes(footer[0], until - footer[0])) != footer[1]:
            file.report.lost(f"{file.path.name}: the checksum of its summary differs; topics and counts may be wrong")


def _cut(file: McapFile, records: Records) -> None:
    """Say what a missing footer means."""
    left = len(file.data) - records.end
    ended = bool(np.any(records.op == _END))
    where = "after the data" if ended else "while data were written"
    file.report.lost(
        f"{file.path.name} ends without a footer ({where}): {left} bytes after byte {records.end} "
        "hold no complete record and were left out"
    )


def _take_top(file: McapFile, records: Records) -> None:
    messages = np.flatnonzero(records.op == MESSAGE)
    if len(messages):
        last = messages[-1]
        file.loose.append((int(records.body[messages[0]]) - 9, int(records.body[last] + records.size[last])))
    last_chunk = -1
    for i in np.flatnonzero(records.op != MESSAGE).tolist():
        op, body, size = int(records.op[i]), int(records.body[i]), int(records.size[i])
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
            last_chunk = -1 if op == _CHUNK else last_chunk
            file.report.lost(f"{file.path.name}: record at byte {body - 9} is damaged ({type(error).__name__})")


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


def _take_name(file: McapFile, op: int, raw: bytes) -> None:
    """Take a schema or channel record; channels may come before their schemas."""
    (number,) = struct.unpack_from("<H", raw)
    if op == _SCHEMA:
        name, at = _text(raw, 2)
        encoding, at = _text(raw, at)
        (size,) = struct.unpack_from("<I", raw, at)
        text = raw[at + 4 : at + 4 + size].decode("latin-1" if encoding == "protobuf" else "utf-8", "replace")
        _keep(file, file.schemas, number, (name, encoding, text), "schema")
    else:
        (schema,) = struct.unpack_from("<H", raw, 2)
        topic, at = _text(raw, 4)
        _keep(file, file.pending, number, (schema, topic, _text(raw, at)[0]), "channel")


def _keep(file: McapFile, known: dict[int, _Entry], number: int, entry: _Entry, what: str) -> None:
    """Keep a repeatable record; copies of it must agree, and the one in the summary comes last."""
    if known.get(number, entry) != entry:
        file.report.lost(f"{file.path.name}: two copies of {what} {number} differ; the last was taken")
    known[number] = entry


def _connect(file: McapFile) -> None:
    for number, (schema, topic, encoding) in file.pending.items():
        name, language, text = file.schemas.get(schema, ("", "", ""))
        file.channels[number] = Connection(topic, name, encoding, language, text)


def _chunk(file: McapFile, body: int, size: int) -> McapChunk:
    head = file.bytes(body, min(size, 256))
    first, last, full, crc = struct.unpack_from("<QQQI", head)
    compression, at = _text(head, 28)
    (packed,) = struct.unpack_from("<Q", head, at)
    if at + 8 + packed > size:
        raise ValueError("chunk data beyond their record")
    return McapChunk(body - 9, first, last, full, crc, compression, body + at + 8, packed)


def _open_chunk(file: McapFile, chunk: McapChunk) -> NDArray[np.uint8] | None:
    """Return a chunk's records, or None where they are damaged (which is reported)."""
    try:
        raw = inflate(chunk.compression, file.bytes(chunk.body, chunk.packed), chunk.size)
    except InflateError as error:
        file.report.lost(f"{file.path.name}: the chunk at byte {chunk.start} was left out: {error}")
        return None
    if chunk.crc and zlib.crc32(raw) != chunk.crc:
        file.report.lost(f"{file.path.name}: the chunk at byte {chunk.start} was left out: its checksum differs")
        return None
    return np.frombuffer(raw, np.uint8)


def chunk_records(file: McapFile, chunk: McapChunk) -> tuple[NDArray[np.uint8], Records] | None:
    """Return a chunk's bytes and records, or None where it is damaged (which is reported)."""
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
