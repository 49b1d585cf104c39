"""Write MCAP: chunks with zstd, CRCs, message indexes, summary; built from rows of equal length."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Mapping, Sequence
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
    Schema,
    Statistics,
    SummaryOffset,
)
from rosbags.typesys import Stores, get_typestore

from replay.atomic_write import atomic_path
from replay.export.formats.message_layout import ChunkPlan, TopicBatch, place_rows, plan_chunks
from replay.version import __version__

_MAGIC = b"\x89MCAP0\r\n"
_CHUNK_SIZE = 1 << 20
_INDEX_ENTRY = np.dtype([("time", "<u8"), ("offset", "<u8")])
_MESSAGE_HEAD = np.dtype(
    [("opcode", "u1"), ("length", "<u8"), ("channel", "<u2"), ("sequence", "<u4"), ("log", "<u8"), ("publish", "<u8")]
)


def write_mcap(path: Path, batches: Sequence[TopicBatch], level: int = 3) -> None:
    """Write topics in CDR as an MCAP file with profile ``ros2``.

    Parameters
    ----------
    path : Path
        File; an existing one is replaced.
    batches : Sequence[TopicBatch]
        Messages.
    level : int
        zstd level, 1…22.

    Raises
    ------
    OutputError
        Where the file cannot be written.
    """
    with atomic_path(path) as temporary, temporary.open("wb") as file:
        _write(file, batches, level)


def _record(record: McapRecord) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    return bytes(builder.end())  # type: ignore[no-untyped-call]


def _write(file: BinaryIO, batches: Sequence[TopicBatch], level: int) -> None:
    definitions, channels = _named(batches)
    section = _DataSection(file)
    section.put(
        _MAGIC + _record(Header(profile="ros2", library=f"mfhca-replay {__version__}")) + definitions + channels
    )
    topics = list(dict.fromkeys(b.topic for b in batches))
    channel_ids = [topics.index(b.topic) + 1 for b in batches]
    compressor = zstandard.ZstdCompressor(level=level)
    sequence = np.zeros(len(topics) + 1, np.int64)
    indexes = []
    for plan in plan_chunks(batches, _MESSAGE_HEAD.itemsize, _CHUNK_SIZE):
        data = _chunk_data(plan, batches, channel_ids, sequence)
        indexes.append(
            section.put_chunk(plan, data, compressor.compress(data), _message_indexes(plan, batches, channel_ids))
        )
    file.write(_record(DataEnd(section.crc)))
    statistics = _statistics(sequence, indexes, len({b.type_name for b in batches}))
    _write_summary(
        file,
        {
            Opcode.SCHEMA: definitions,
            Opcode.CHANNEL: channels,
            Opcode.STATISTICS: _record(statistics),
            Opcode.CHUNK_INDEX: b"".join(_record(c) for c in indexes),
        },
    )


def _named(batches: Sequence[TopicBatch]) -> tuple[bytes, bytes]:
    """Records of the message types, and of the topics' channels."""
    types = list(dict.fromkeys(b.type_name for b in batches))
    store = get_typestore(Stores.ROS2_HUMBLE)
    definitions = b"".join(
        _record(
            Schema(id=i, name=name, encoding="ros2msg", data=store.generate_msgdef(name, ros_version=2)[0].encode())
        )
        for i, name in enumerate(types, 1)
    )
    type_of = {b.topic: b.type_name for b in batches}
    channels = b"".join(
        _record(Channel(i, topic, "cdr", {}, types.index(name) + 1))
        for i, (topic, name) in enumerate(type_of.items(), 1)
    )
    return definitions, channels


class _DataSection:
    """Data section of a file under way, and the CRC of what it holds."""

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self.crc = 0

    def put(self, octets: bytes) -> None:
        """Write records."""
        self.crc = zlib.crc32(octets, self.crc)
        self._file.write(octets)

    def put_chunk(self, plan: ChunkPlan, data: bytes, packed: bytes, entries: Mapping[int, bytes]) -> ChunkIndex:
        """Write a chunk, and the message index of each of its channels."""
        chunk = _record(Chunk("zstd", packed, plan.stop_ns, plan.start_ns, zlib.crc32(data), len(data)))
        start = self._file.tell()
        self.put(chunk)
        index_start, offsets = self._file.tell(), {}
        for channel, octets in entries.items():
            offsets[channel] = self._file.tell()
            self.put(octets)
        return ChunkIndex(
            chunk_length=len(chunk),
            chunk_start_offset=start,
            compression="zstd",
            compressed_size=len(packed),
            message_end_time=plan.stop_ns,
            message_index_length=self._file.tell() - index_start,
            message_index_offsets=offsets,
            message_start_time=plan.start_ns,
            uncompressed_size=len(data),
        )


def _statistics(sequence: np.typing.NDArray[np.int64], indexes: Sequence[ChunkIndex], types: int) -> Statistics:
    """Counts and span of the file; `sequence` holds the messages of each channel."""
    counts = {i: int(n) for i, n in enumerate(sequence) if i > 0}
    return Statistics(
        attachment_count=0,
        channel_count=len(counts),
        channel_message_counts=counts,
        chunk_count=len(indexes),
        message_count=sum(counts.values()),
        message_start_time=min((c.message_start_time for c in indexes), default=0),
        message_end_time=max((c.message_end_time for c in indexes), default=0),
        metadata_count=0,
        schema_count=types,
    )


def _chunk_data(
    plan: ChunkPlan, batches: Sequence[TopicBatch], channel_ids: Sequence[int], sequence: np.typing.NDArray[np.int64]
) -> bytes:
    """Message records of one chunk; counts them in `sequence` by channel."""
    chunk = np.empty(plan.size, np.uint8)
    for piece in plan.pieces:
        batch, channel = batches[piece.batch], channel_ids[piece.batch]
        count = piece.stop - piece.start
        head = np.empty(count, _MESSAGE_HEAD)
        head["opcode"] = int(Opcode.MESSAGE)
        head["length"] = _MESSAGE_HEAD.itemsize - 9 + batch.size
        head["channel"] = channel
        head["sequence"] = sequence[channel] + np.arange(count)
        head["log"] = head["publish"] = batch.log_stamps[piece.start : piece.stop]
        sequence[channel] += count
        octets = head.view(np.uint8).reshape(count, -1)
        place_rows(chunk, piece.offsets, np.hstack([octets, batch.encode(piece.start, piece.stop)]))
    return chunk.tobytes()


def _message_indexes(plan: ChunkPlan, batches: Sequence[TopicBatch], channel_ids: Sequence[int]) -> dict[int, bytes]:
    """Message index records of one chunk by channel."""
    found: dict[int, bytes] = {}
    for channel in dict.fromkeys(channel_ids[p.batch] for p in plan.pieces):
        parts = []
        for piece in plan.pieces:
            if channel_ids[piece.batch] == channel:
                entries = np.empty(piece.offsets.size, _INDEX_ENTRY)
                entries["time"] = batches[piece.batch].log_stamps[piece.start : piece.stop]
                entries["offset"] = piece.offsets
                parts.append(entries)
        body = np.sort(np.concatenate(parts), order="time", kind="stable").tobytes()
        head = struct.pack("<BQHI", Opcode.MESSAGE_INDEX, len(body) + 6, channel, len(body))
        found[channel] = head + body
    return found


def _write_summary(file: BinaryIO, groups: dict[Opcode, bytes]) -> None:
    """Summary section, its offsets, footer."""
    start, offset = file.tell(), file.tell()
    summary, offsets = b"", b""
    for opcode, octets in groups.items():
        if octets:
            offsets += _record(SummaryOffset(opcode, offset, len(octets)))
        summary += octets
        offset += len(octets)
    # The CRC covers the summary and the footer up to itself.
    footer = struct.pack("<BQQQ", Opcode.FOOTER, 20, start, offset)
    crc = zlib.crc32(summary + offsets + footer)
    file.write(summary + offsets + _record(Footer(start, offset, crc)) + _MAGIC)
