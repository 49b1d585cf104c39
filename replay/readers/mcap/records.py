"""The records of MCAP as the format defines them, and their parsing from bytes."""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TypeAlias

from replay.readers.mcap import format as fmt

MAX_RECORD = 64 << 20
BAD_RECORD = (struct.error, UnicodeDecodeError, IndexError, ValueError, OverflowError)


@dataclass(frozen=True)
class Header:
    """First record of a file."""

    profile: str
    library: str


@dataclass(frozen=True)
class Footer:
    """Last record of a file: places of the summary and of its offsets, checksum of the summary."""

    summary_start: int
    summary_offset_start: int
    summary_crc: int


@dataclass(frozen=True)
class Schema:
    """Definition of a message type."""

    id: int
    name: str
    encoding: str
    data: bytes


@dataclass(frozen=True)
class Channel:
    """One stream of messages."""

    id: int
    schema_id: int
    topic: str
    message_encoding: str
    metadata: Mapping[str, str]


@dataclass(frozen=True)
class Message:
    """One message; stamps in ns."""

    channel_id: int
    sequence: int
    log_time: int
    publish_time: int
    data: bytes


@dataclass(frozen=True)
class ChunkIndex:
    """What the summary says about a chunk."""

    message_start_time: int
    message_end_time: int
    chunk_start_offset: int
    chunk_length: int
    message_index_offsets: Mapping[int, int]
    message_index_length: int
    compression: str
    compressed_size: int
    uncompressed_size: int


@dataclass(frozen=True)
class Attachment:
    """A file within the file."""

    log_time: int
    create_time: int
    name: str
    media_type: str
    data: bytes
    crc: int


@dataclass(frozen=True)
class AttachmentIndex:
    """What the summary says about an attachment."""

    offset: int
    length: int
    log_time: int
    create_time: int
    data_size: int
    name: str
    media_type: str


@dataclass(frozen=True)
class Statistics:
    """What the summary counts."""

    message_count: int
    schema_count: int
    channel_count: int
    attachment_count: int
    metadata_count: int
    chunk_count: int
    message_start_time: int
    message_end_time: int
    channel_message_counts: Mapping[int, int]


@dataclass(frozen=True)
class Metadata:
    """Named key-value pairs."""

    name: str
    metadata: Mapping[str, str]


@dataclass(frozen=True)
class MetadataIndex:
    """What the summary says about a metadata record."""

    offset: int
    length: int
    name: str


@dataclass(frozen=True)
class SummaryOffset:
    """Place of the summary's records of one type."""

    group_opcode: int
    group_start: int
    group_length: int


@dataclass(frozen=True)
class DataEnd:
    """End of the data section and its checksum."""

    data_section_crc: int


Record: TypeAlias = (
    Header | Footer | Schema | Channel | Message | ChunkIndex | Attachment | AttachmentIndex | Statistics | Metadata
    | MetadataIndex | SummaryOffset | DataEnd
)  # fmt: skip


def _part(raw: bytes, at: int) -> tuple[bytes, int]:
    (size,) = struct.unpack_from("<I", raw, at)
    if at + 4 + size > len(raw):
        raise ValueError("a part reaches beyond its record")
    return raw[at + 4 : at + 4 + size], at + 4 + size


def _text(raw: bytes, at: int) -> tuple[str, int]:
    part, at = _part(raw, at)
    return part.decode(), at


def _texts(raw: bytes, at: int) -> dict[str, str]:
    part, _ = _part(raw, at)
    at, out = 0, {}
    while at < len(part):
        key, at = _text(part, at)
        out[key], at = _text(part, at)
    return out


def _numbers(raw: bytes, at: int) -> tuple[dict[int, int], int]:
    part, at = _part(raw, at)
    return dict(struct.iter_unpack("<HQ", part)), at


def _header(raw: bytes) -> Header:
    profile, at = _text(raw, 0)
    return Header(profile, _text(raw, at)[0])


def _schema(raw: bytes) -> Schema:
    name, at = _text(raw, 2)
    encoding, at = _text(raw, at)
    return Schema(struct.unpack_from("<H", raw)[0], name, encoding, _part(raw, at)[0])


def _channel(raw: bytes) -> Channel:
    number, schema = struct.unpack_from("<HH", raw)
    topic, at = _text(raw, 4)
    encoding, at = _text(raw, at)
    return Channel(number, schema, topic, encoding, _texts(raw, at))


def _message(raw: bytes) -> Message:
    number, sequence, log, publish = struct.unpack_from("<HIQQ", raw)
    return Message(number, sequence, log, publish, raw[fmt.MESSAGE_HEAD :])


def _chunk_index(raw: bytes) -> ChunkIndex:
    first, last, start, length = struct.unpack_from("<QQQQ", raw)
    offsets, at = _numbers(raw, 32)
    (indexes,) = struct.unpack_from("<Q", raw, at)
    compression, at = _text(raw, at + 8)
    packed, full = struct.unpack_from("<QQ", raw, at)
    return ChunkIndex(first, last, start, length, offsets, indexes, compression, packed, full)


def _attachment(raw: bytes) -> Attachment:
    log, created = struct.unpack_from("<QQ", raw)
    name, at = _text(raw, 16)
    media, at = _text(raw, at)
    (size,) = struct.unpack_from("<Q", raw, at)
    if at + 12 + size > len(raw):
        raise ValueError("its content reaches beyond its record")
    (crc,) = struct.unpack_from("<I", raw, at + 8 + size)
    return Attachment(log, created, name, media, raw[at + 8 : at + 8 + size], crc)


def _attachment_index(raw: bytes) -> AttachmentIndex:
    name, at = _text(raw, 40)
    offset, length, log, created, size = struct.unpack_from("<QQQQQ", raw)
    return AttachmentIndex(offset, length, log, created, size, name, _text(raw, at)[0])


def _statistics(raw: bytes) -> Statistics:
    messages, schemas, channels, attachments, metadata, chunks, first, last = struct.unpack_from("<QHIIIIQQ", raw)
    per_channel = _numbers(raw, 42)[0]
    return Statistics(messages, schemas, channels, attachments, metadata, chunks, first, last, per_channel)


def _metadata(raw: bytes) -> Metadata:
    name, at = _text(raw, 0)
    return Metadata(name, _texts(raw, at))


def _metadata_index(raw: bytes) -> MetadataIndex:
    offset, length = struct.unpack_from("<QQ", raw)
    return MetadataIndex(offset, length, _text(raw, 16)[0])


PARSERS: Mapping[int, Callable[[bytes], Record]] = {
    fmt.HEADER: _header,
    fmt.FOOTER: lambda raw: Footer(*struct.unpack_from("<QQI", raw)),
    fmt.SCHEMA: _schema,
    fmt.CHANNEL: _channel,
    fmt.MESSAGE: _message,
    fmt.CHUNK_INDEX: _chunk_index,
    fmt.ATTACHMENT: _attachment,
    fmt.ATTACHMENT_INDEX: _attachment_index,
    fmt.STATISTICS: _statistics,
    fmt.METADATA: _metadata,
    fmt.METADATA_INDEX: _metadata_index,
    fmt.SUMMARY_OFFSET: lambda raw: SummaryOffset(*struct.unpack_from("<BQQ", raw)),
    fmt.DATA_END: lambda raw: DataEnd(*struct.unpack_from("<I", raw)),
}


def parse(op: int, raw: bytes) -> Record | None:
    """Parse a record's content; None for types that are not told apart here.

    Raises
    ------
    struct.error, UnicodeDecodeError, IndexError, ValueError, OverflowError
        (`BAD_RECORD`) where the content does not fit the type.
    """
    parser = PARSERS.get(op)
    if parser is None:
        return None
    if len(raw) > MAX_RECORD and op != fmt.ATTACHMENT:
        raise ValueError(f"a record of {len(raw)} bytes; at most {MAX_RECORD} are parsed")
    return parser(raw)
