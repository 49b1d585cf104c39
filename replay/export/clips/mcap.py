"""Write an MCAP file from message records that are already made: pieces of other logs, and topics of our own."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import BinaryIO

import numpy as np
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)
from numpy.typing import NDArray
from rosbags.typesys import Stores, get_typestore

from replay.atomic_write import atomic_path
from replay.errors import OutputError
from replay.export.formats.message_layout import TopicBatch
from replay.version import __version__

MARK = "mfhca_clip"
_MAGIC = b"\x89MCAP0\r\n"
_CHUNK_BYTES = 1 << 20
_MOST_NAMES = (1 << 16) - 1
_INDEX_ENTRY = np.dtype([("time", "<u8"), ("offset", "<u8")])
_MESSAGE_HEAD = np.dtype(
    [("opcode", "u1"), ("length", "<u8"), ("channel", "<u2"), ("sequence", "<u4"), ("log", "<u8"), ("publish", "<u8")]
)


@dataclass(frozen=True)
class Records:
    """Message records, one after the other.

    Attributes
    ----------
    data : NDArray[np.uint8], shape (b,)
        The records as they stand in a file.
    offsets : NDArray[np.int64], shape (n,)
        First byte of each.
    channels : NDArray[np.int64], shape (n,)
        Channel number of each.
    log : NDArray[np.int64], shape (n,)
        Log stamp of each [ns].
    """

    data: NDArray[np.uint8]
    offsets: NDArray[np.int64]
    channels: NDArray[np.int64]
    log: NDArray[np.int64]


@dataclass
class Definitions:
    """Schemas and channels of the file to write, numbered from 1; equal ones share a number."""

    schemas: dict[tuple[str, str, bytes], int] = field(default_factory=dict)
    channels: list[Channel] = field(default_factory=list)

    def schema(self, name: str, encoding: str, data: bytes) -> int:
        """Number of a schema, which is added where it is new."""
        return self.schemas.setdefault((name, encoding, data), len(self.schemas) + 1)

    def channel(self, topic: str, encoding: str, metadata: Mapping[str, str], schema: int) -> int:
        """Add a channel and give its number.

        Raises
        ------
        OutputError
            Where MCAP cannot number more of them.
        """
        if len(self.channels) >= _MOST_NAMES:
            raise OutputError(f"{topic}: more than {_MOST_NAMES} channels do not fit one MCAP file")
        self.channels.append(Channel(len(self.channels) + 1, topic, encoding, dict(metadata), schema))
        return len(self.channels)

    def octets(self) -> tuple[bytes, bytes]:
        """Schema records and channel records."""
        schemas = [Schema(data=d, encoding=e, id=i, name=n) for (n, e, d), i in self.schemas.items()]
        return b"".join(map(_record, schemas)), b"".join(map(_record, self.channels))


def own_channel(topic: str, type_name: str, definitions: Definitions) -> int:
    """Number of the channel of a topic of our own, which is added with the whole definition of its type."""
    text = get_typestore(Stores.ROS2_HUMBLE).generate_msgdef(type_name, ros_version=2)[0]
    return definitions.channel(topic, "cdr", {}, definitions.schema(type_name, "ros2msg", text.encode()))


def batch_records(batch: TopicBatch, definitions: Definitions) -> Records:
    """Records of a topic of our own; its channel is added to the definitions."""
    channel = own_channel(batch.topic, batch.type_name, definitions)
    count = len(batch.log_stamps)
    head = np.empty(count, _MESSAGE_HEAD)
    head["opcode"], head["length"] = int(Opcode.MESSAGE), _MESSAGE_HEAD.itemsize - 9 + batch.size
    head["channel"], head["sequence"] = channel, np.arange(count)
    head["log"] = head["publish"] = batch.log_stamps
    rows = np.hstack([head.view(np.uint8).reshape(count, -1), batch.encode(0, count)])
    offsets = np.arange(count, dtype=np.int64) * rows.shape[1]
    return Records(rows.reshape(-1), offsets, np.full(count, channel, np.int64), batch.log_stamps)


def message_records(messages: Sequence[bytes], log_stamps: NDArray[np.int64], channel: int) -> Records:
    """Records of messages whose length varies, of one channel.

    Parameters
    ----------
    messages : Sequence[bytes]
        Whole messages in CDR.
    log_stamps : NDArray[np.int64], shape (n,)
        Log stamp of each [ns].
    channel : int
        From `own_channel`.
    """
    count = len(messages)
    heads = np.empty(count, _MESSAGE_HEAD)
    lengths = np.array([len(m) for m in messages], np.int64)
    heads["opcode"], heads["length"] = int(Opcode.MESSAGE), _MESSAGE_HEAD.itemsize - 9 + lengths
    heads["channel"], heads["sequence"] = channel, np.arange(count)
    heads["log"] = heads["publish"] = log_stamps
    octets = b"".join(part for pair in zip(heads, messages, strict=True) for part in (pair[0].tobytes(), pair[1]))
    sizes = lengths + _MESSAGE_HEAD.itemsize
    return Records(
        np.frombuffer(octets, np.uint8), np.cumsum(sizes) - sizes, np.full(count, channel, np.int64), log_stamps
    )


def write_clip(
    path: Path, definitions: Definitions, parts: Iterable[Records], about: Mapping[str, str], mark: str = MARK
) -> int:
    """Write a file; give the number of its messages.

    Parameters
    ----------
    path : Path
        Where to; written under a temporary name first.
    definitions : Definitions
        Names of all channels.
    parts : Iterable[Records]
        Messages.
    about : Mapping[str, str]
        What the file shows; kept as a metadata record at the head of the file.
    mark : str
        Name of that record, which tells the files of this tool from others.

    Raises
    ------
    OutputError
        Where the file cannot be written.
    """
    with atomic_path(path) as temporary, temporary.open("wb") as file:
        return _Writer(file, definitions, about, mark).write(parts)


def _record(record: McapRecord) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    return bytes(builder.end())  # type: ignore[no-untyped-call]


class _Writer:
    """One file being written."""

    def __init__(self, file: BinaryIO, definitions: Definitions, about: Mapping[str, str], mark: str) -> None:
        self._file, self._crc, self._mark = file, 0, mark
        self._schemas, self._channels = definitions.octets()
        self._definitions, self._about = definitions, dict(about)
        self._counts = np.zeros(len(definitions.channels) + 1, np.int64)
        self._indexes: list[ChunkIndex] = []
        self._compressor = zstandard.ZstdCompressor(level=3)

    def write(self, parts: Iterable[Records]) -> int:
        self._put(_MAGIC + _record(Header(profile="", library=f"mfhca-replay {__version__}")))
        metadata, start = _record(Metadata(name=self._mark, metadata=self._about)), self._file.tell()
        self._put(metadata + self._schemas + self._channels)
        for part in parts:
            for piece in _pieces(part):
                self._chunk(piece)
        self._file.write(_record(DataEnd(self._crc)))
        self._summary(MetadataIndex(length=len(metadata), name=self._mark, offset=start))
        return int(self._counts.sum())

    def _put(self, octets: bytes) -> None:
        self._crc = zlib.crc32(octets, self._crc)
        self._file.write(octets)

    def _chunk(self, part: Records) -> None:
        first, last = int(part.log.min()), int(part.log.max())
        data = part.data.tobytes()
        packed = self._compressor.compress(data)
        chunk = _record(Chunk("zstd", packed, last, first, zlib.crc32(data), len(data)))
        start = self._file.tell()
        self._put(chunk)
        index_start, offsets = self._file.tell(), {}
        for channel in np.unique(part.channels).tolist():
            mine = part.channels == channel
            entries = np.empty(np.count_nonzero(mine), _INDEX_ENTRY)
            entries["time"], entries["offset"] = part.log[mine], part.offsets[mine]
            body = np.sort(entries, order="time", kind="stable").tobytes()
            offsets[channel] = self._file.tell()
            self._put(struct.pack("<BQHI", Opcode.MESSAGE_INDEX, len(body) + 6, channel, len(body)) + body)
            self._counts[channel] += entries.size
        self._indexes.append(
            ChunkIndex(
                chunk_length=len(chunk),
                chunk_start_offset=start,
                compression="zstd",
                compressed_size=len(packed),
                message_end_time=last,
                message_index_length=self._file.tell() - index_start,
                message_index_offsets=offsets,
                message_start_time=first,
                uncompressed_size=len(data),
            )
        )

    def _summary(self, metadata: MetadataIndex) -> None:
        statistics = Statistics(
            attachment_count=0,
            channel_count=len(self._definitions.channels),
            channel_message_counts={i: int(n) for i, n in enumerate(self._counts) if i},
            chunk_count=len(self._indexes),
            message_count=int(self._counts.sum()),
            message_start_time=min((c.message_start_time for c in self._indexes), default=0),
            message_end_time=max((c.message_end_time for c in self._indexes), default=0),
            metadata_count=1,
            schema_count=len(self._definitions.schemas),
        )
        groups = {
            Opcode.SCHEMA: self._schemas,
            Opcode.CHANNEL: self._channels,
            Opcode.STATISTICS: _record(statistics),
            Opcode.CHUNK_INDEX: b"".join(map(_record, self._indexes)),
            Opcode.METADATA_INDEX: _record(metadata),
        }
        start = at = self._file.tell()
        offsets = b""
        for opcode, octets in groups.items():
            offsets += _record(SummaryOffset(opcode, at, len(octets))) if octets else b""
            at += len(octets)
        summary = b"".join(groups.values()) + offsets
        # The CRC covers the summary and the footer up to itself.
        crc = zlib.crc32(summary + struct.pack("<BQQQ", Opcode.FOOTER, 20, start, at))
        self._file.write(summary + _record(Footer(start, at, crc)) + _MAGIC)


def _pieces(part: Records) -> Sequence[Records]:
    """Parts of about `_CHUNK_BYTES`, cut between messages."""
    if not part.offsets.size:
        return []
    group = part.offsets // _CHUNK_BYTES
    cuts = [*np.flatnonzero(np.diff(group, prepend=-1)).tolist(), part.offsets.size]
    ends = np.append(part.offsets, part.data.size)
    return [
        Records(part.data[ends[a] : ends[b]], part.offsets[a:b] - ends[a], part.channels[a:b], part.log[a:b])
        for a, b in pairwise(cuts)
    ]
