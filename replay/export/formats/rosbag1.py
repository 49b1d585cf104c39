"""Write ROS 1 bags (version 2.0, LZ4 chunks) from rows of equal length."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from pathlib import Path
from typing import BinaryIO

import lz4.frame
import numpy as np
from numpy.typing import NDArray
from rosbags.typesys import Stores, get_typestore

from replay.atomic_write import atomic_path
from replay.export.formats.message_layout import ChunkPlan, TopicBatch, place_rows, plan_chunks

_CHUNK_SIZE = 768 << 10
_BAG_HEADER_SIZE = 4096
_MESSAGE, _BAG, _INDEX, _CHUNK, _CHUNK_INFO, _CONNECTION = 2, 3, 4, 5, 6, 7
_INDEX_ENTRY = np.dtype([("sec", "<u4"), ("nanosec", "<u4"), ("offset", "<u4")])


def write_ros1_bag(path: Path, batches: Sequence[TopicBatch], level: int = 0) -> None:
    """Write topics in ROS 1 serialisation as a bag.

    Parameters
    ----------
    path : Path
        File; an existing one is replaced.
    batches : Sequence[TopicBatch]
        Messages.
    level : int
        LZ4 level, 0…16.

    Raises
    ------
    OutputError
        Where the file cannot be written.
    """
    with atomic_path(path) as temporary, temporary.open("wb") as file:
        _write(file, batches, level)


def _head(opcode: int, **fields: bytes) -> bytes:
    """Record header: its length, then ``name=value`` fields, each with its length."""
    pairs = [b"op=" + bytes([opcode])] + [name.encode() + b"=" + value for name, value in fields.items()]
    body = b"".join(struct.pack("<I", len(p)) + p for p in pairs)
    return struct.pack("<I", len(body)) + body


def _record(opcode: int, data: bytes, **fields: bytes) -> bytes:
    return _head(opcode, **fields) + struct.pack("<I", len(data)) + data


def _u32(value: int) -> bytes:
    return struct.pack("<I", value)


def _time(stamp: int) -> bytes:
    return struct.pack("<II", stamp // 1_000_000_000, stamp % 1_000_000_000)


def _connections(topics: Sequence[str], types: Sequence[str]) -> bytes:
    store = get_typestore(Stores.ROS1_NOETIC)
    records = b""
    for number, (topic, type_name) in enumerate(zip(topics, types, strict=True)):
        definition, digest = store.generate_msgdef(type_name)
        fields = {
            "topic": topic,
            "type": type_name.replace("/msg/", "/"),
            "md5sum": digest,
            "message_definition": definition,
        }
        pairs = [f"{name}={value}".encode() for name, value in fields.items()]
        data = b"".join(_u32(len(p)) + p for p in pairs)
        records += _record(_CONNECTION, data, conn=_u32(number), topic=topic.encode())
    return records


def _bag_header(index_position: int, connections: int, chunks: int) -> bytes:
    fields = {"index_pos": struct.pack("<Q", index_position), "conn_count": _u32(connections)}
    head = _head(_BAG, **fields, chunk_count=_u32(chunks))
    padding = _BAG_HEADER_SIZE - len(head) - 4
    return head + _u32(padding) + b" " * padding


def _write(file: BinaryIO, batches: Sequence[TopicBatch], level: int) -> None:
    type_of = {b.topic: b.type_name for b in batches}
    topics = list(type_of)
    numbers = [topics.index(b.topic) for b in batches]
    connections = _connections(topics, [type_of[t] for t in topics])
    file.write(b"#ROSBAG V2.0\n")
    start = file.tell()
    file.write(_bag_header(0, len(topics), 0))
    infos = []
    prefix = connections  # the first chunk declares every connection
    for plan in plan_chunks(batches, len(_message_head(0, 0)), _CHUNK_SIZE):
        data = prefix + _chunk_data(plan, batches, numbers)
        position = file.tell()
        packed = lz4.frame.compress(data, level)
        file.write(_record(_CHUNK, packed, compression=b"lz4", size=_u32(len(data))))
        counts = b""
        for number, entries in _index(plan, batches, numbers, len(prefix)).items():
            fields = {"ver": _u32(1), "conn": _u32(number), "count": _u32(entries.size)}
            file.write(_record(_INDEX, entries.tobytes(), **fields))
            counts += _u32(number) + _u32(entries.size)
        fields = {"ver": _u32(1), "chunk_pos": struct.pack("<Q", position), "count": _u32(len(counts) // 8)}
        times = {"start_time": _time(plan.start_ns), "end_time": _time(plan.stop_ns)}
        infos.append(_record(_CHUNK_INFO, counts, **fields, **times))
        prefix = b""
    index_position = file.tell()
    file.write(connections + b"".join(infos))
    file.seek(start)
    file.write(_bag_header(index_position, len(topics), len(infos)))


def _message_head(number: int, size: int) -> bytes:
    """Bytes before a message; its stamp stands in the eight bytes before the last four."""
    return _head(_MESSAGE, conn=_u32(number), time=_time(0)) + _u32(size)


def _seconds(stamps: NDArray[np.int64]) -> NDArray[np.uint32]:
    """ROS 1 time, shape (n, 2): seconds, nanoseconds."""
    return np.column_stack(np.divmod(stamps, 1_000_000_000)).astype("<u4")


def _chunk_data(plan: ChunkPlan, batches: Sequence[TopicBatch], numbers: Sequence[int]) -> bytes:
    chunk = np.empty(plan.size, np.uint8)
    for piece in plan.pieces:
        batch = batches[piece.batch]
        template = np.frombuffer(_message_head(numbers[piece.batch], batch.size), np.uint8)
        heads = np.tile(template, (piece.stop - piece.start, 1))
        heads[:, -12:-4] = _seconds(batch.log_stamps[piece.start : piece.stop]).view(np.uint8)
        place_rows(chunk, piece.offsets, np.hstack([heads, batch.encode(piece.start, piece.stop)]))
    return chunk.tobytes()


def _index(
    plan: ChunkPlan, batches: Sequence[TopicBatch], numbers: Sequence[int], shift: int
) -> dict[int, NDArray[np.void]]:
    """Index entries of one chunk by connection, in order of time."""
    found: dict[int, NDArray[np.void]] = {}
    for piece in plan.pieces:
        entries = np.empty(piece.offsets.size, _INDEX_ENTRY)
        times = _seconds(batches[piece.batch].log_stamps[piece.start : piece.stop])
        entries["sec"], entries["nanosec"], entries["offset"] = times[:, 0], times[:, 1], piece.offsets + shift
        number = numbers[piece.batch]
        found[number] = np.concatenate([found[number], entries]) if number in found else entries
    return {number: np.sort(entries, order="offset") for number, entries in sorted(found.items())}
