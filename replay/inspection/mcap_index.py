"""The index of a complete MCAP file, read with nothing that takes time to load.

Any doubt about the index (none, a wrong checksum, counts or places that do not agree) gives None: then the reader,
which walks the whole file, has to find what is there.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO

from replay.inspection.report import InspectReport, TopicTiming, mean_rate

MAGIC = b"\x89MCAP0\r\n"
MAX_INDEX = 256 << 20
_MAX_TEXTS, _MAX_TEXT = 64, 1 << 20
_HEADER, _FOOTER, _SCHEMA, _CHANNEL, _CHUNK, _CHUNK_INDEX, _ATTACHMENT_INDEX, _STATISTICS, _METADATA, _METADATA_INDEX = (
    1, 2, 3, 4, 6, 8, 10, 11, 12, 13,
)  # fmt: skip
_DECODED = ("cdr", "ros1", "json", "protobuf")


class _DoubtError(Exception):
    """The index does not hold together."""


@dataclass
class _Index:
    """Records of a summary section."""

    schemas: dict[int, str] = field(default_factory=dict)
    channels: dict[int, tuple[str, int, str]] = field(default_factory=dict)
    counts: dict[int, int] | None = None
    messages: int = 0
    chunks_stated: int = 0
    bounds: tuple[int, int] = (0, 0)
    chunks: list[tuple[int, int]] = field(default_factory=list)
    packing: dict[str, int] = field(default_factory=dict)
    unpacked: int = 0
    attachments: list[Mapping[str, object]] = field(default_factory=list)
    texts: list[tuple[int, int]] = field(default_factory=list)


def mcap_index(path: Path, clock: str) -> InspectReport | None:
    """Read the index of an MCAP file.

    Parameters
    ----------
    path : Path
        The file.
    clock : str
        Clock that a full reading would use.

    Returns
    -------
    InspectReport or None
        None where the file is not MCAP or its index cannot be trusted.
    """
    if not path.is_file():
        return None
    try:
        with path.open("rb") as file:
            return _read(file, path, path.stat().st_size, clock)
    except (_DoubtError, struct.error, UnicodeDecodeError):
        return None


def _read(file: IO[bytes], path: Path, size: int, clock: str) -> InspectReport:
    tail = 29 + len(MAGIC)
    _sure(file.read(len(MAGIC)) == MAGIC and size > 2 * tail)
    file.seek(size - tail)
    end = file.read(tail)
    start, _, checksum = struct.unpack_from("<QQI", end, 9)
    _sure(end[0] == _FOOTER and end.endswith(MAGIC) and len(MAGIC) < start < size - tail)
    _sure(size - tail - start <= MAX_INDEX)
    file.seek(start)
    raw = file.read(size - tail - start)
    _sure(not checksum or zlib.crc32(end[:-12], zlib.crc32(raw)) == checksum)
    index = _Index()
    for op, body in _records(raw):
        _take(index, op, body)
    _check(index, start)
    checked = bool(checksum) and _first_checksum(file, index)
    seconds = (index.bounds[1] - index.bounds[0]) / 1e9
    counts = index.counts or {}
    totals: dict[tuple[str, str, str], int] = {}
    for number, (topic, schema, encoding) in index.channels.items():
        key = topic, index.schemas.get(schema, ""), encoding
        totals[key] = totals.get(key, 0) + counts.get(number, 0)
    topics = tuple(
        TopicTiming(
            topic, kind, n, mean_rate(n, seconds), None, None, None, None, None, encoding=encoding,
            note="" if encoding in _DECODED else f"{encoding or 'unnamed'} serialisation is not decoded",
        )
        for (topic, kind, encoding), n in totals.items()
    )  # fmt: skip
    container = {
        "chunks": len(index.chunks),
        "compression": ", ".join(sorted(k or "none" for k in index.packing)) or "none",
        "uncompressed_bytes": index.unpacked if index.chunks else None,
    }
    return InspectReport(
        str(path), "mcap", *index.bounds, topics, (),
        metadata=_texts(file, index, size) | {"integrity": "checksums" if checked else "unverifiable"}, depth="quick", size=size,
        clock=clock, container=container, attachments=tuple(index.attachments),
        integrity="checksums; that of the index is right, those of the data were not read"
        if checked
        else "not every part has a checksum; damage there cannot be detected",
    )  # fmt: skip


def _sure(holds: bool) -> None:
    if not holds:
        raise _DoubtError


def _records(raw: bytes) -> Iterator[tuple[int, bytes]]:
    at = 0
    while at < len(raw):
        op, size = struct.unpack_from("<BQ", raw, at)
        _sure(size <= len(raw) - at - 9)
        yield op, raw[at + 9 : at + 9 + size]
        at += 9 + size


def _take(index: _Index, op: int, raw: bytes) -> None:
    if op == _SCHEMA:
        index.schemas[struct.unpack_from("<H", raw)[0]] = _text(raw, 2)[0]
    elif op == _CHANNEL:
        number, schema = struct.unpack_from("<HH", raw)
        topic, at = _text(raw, 4)
        index.channels[number] = topic, schema, _text(raw, at)[0]
    elif op == _CHUNK_INDEX:
        _, _, start, length, places = struct.unpack_from("<QQQQI", raw)
        compression, at = _text(raw, 36 + places + 8)
        packed, unpacked = struct.unpack_from("<QQ", raw, at)
        index.chunks.append((start, length))
        index.packing[compression] = index.packing.get(compression, 0) + packed
        index.unpacked += unpacked
    elif op == _ATTACHMENT_INDEX:
        (size,) = struct.unpack_from("<Q", raw, 32)
        name, at = _text(raw, 40)
        index.attachments.append({"name": name, "media_type": _text(raw, at)[0], "size": size})
    elif op == _METADATA_INDEX:
        index.texts.append(struct.unpack_from("<QQ", raw))
    elif op == _STATISTICS:
        index.messages, _, _, _, _, index.chunks_stated = struct.unpack_from("<QHIIII", raw)
        index.bounds = struct.unpack_from("<QQ", raw, 26)
        (size,) = struct.unpack_from("<I", raw, 42)
        index.counts = dict(struct.iter_unpack("<HQ", raw[46 : 46 + size]))


def _check(index: _Index, stop: int) -> None:
    """Raise where counts, channels or places do not agree."""
    counts = index.counts
    _sure(counts is not None and sum(counts.values()) == index.messages and counts.keys() <= index.channels.keys())
    _sure(index.chunks_stated == len(index.chunks) and 0 <= index.bounds[0] <= index.bounds[1] < 1 << 63)
    _sure(all(schema in index.schemas or not schema for _, schema, _ in index.channels.values()))
    _sure(bool(index.chunks) or not index.chunks_stated)
    end = len(MAGIC)
    for start, length in sorted(index.chunks):
        _sure(start >= end)
        end = start + length
    _sure(end <= stop)


def _first_checksum(file: IO[bytes], index: _Index) -> bool:
    """Whether the first chunk has a checksum of its content."""
    if not index.chunks:
        return False
    file.seek(min(index.chunks)[0])
    head = file.read(37)
    _sure(len(head) == 37 and head[0] == _CHUNK)
    return bool(struct.unpack_from("<I", head, 33)[0])


def _texts(file: IO[bytes], index: _Index, file_size: int) -> dict[str, str]:
    """Profile and library, and the metadata records of moderate size; `file_size` in bytes, beyond which none can begin."""
    out = {}
    for start, length in [(len(MAGIC), 1 << 16), *index.texts[:_MAX_TEXTS]]:
        _sure(start < file_size)
        file.seek(start)
        raw = file.read(min(length, _MAX_TEXT))
        op, size = struct.unpack_from("<BQ", raw)
        if op == _HEADER and start == len(MAGIC):
            out["profile"], at = _text(raw, 9)
            out["library"] = _text(raw, at)[0]
        elif op == _METADATA and size + 9 <= len(raw):
            name, at = _text(raw, 9)
            end = at + 4 + struct.unpack_from("<I", raw, at)[0]
            at += 4
            while at < end:
                key, at = _text(raw, at)
                out[f"{name}.{key}"], at = _text(raw, at)
    return out


def _text(raw: bytes, at: int) -> tuple[str, int]:
    (size,) = struct.unpack_from("<I", raw, at)
    _sure(at + 4 + size <= len(raw))
    return raw[at + 4 : at + 4 + size].decode(), at + 4 + size
