"""What the reading benchmark compares: the floor, this package, and its peers.

Each maker takes a log and returns a function that brings every number into NumPy.
"""

from __future__ import annotations

import mmap
import os
import struct
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from reading_logs import TOPICS

Result = tuple[int, float, int]


def measured(arrays: list[np.ndarray], stamps: list[np.ndarray]) -> Result:
    total = sum(float(a.sum()) for a in arrays)
    return sum(len(s) for s in stamps), total, sum(a.nbytes for a in (*arrays, *stamps))


def floor(path: Path, crc: bool) -> Callable[[], None]:
    import cramjam

    expand = {"zstd": cramjam.zstd.decompress_into, "lz4": cramjam.lz4.decompress_into}
    room = np.empty(8 << 20, np.uint8)

    def run() -> None:
        with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
            view, at = memoryview(data), 8
            while at < len(data) - 8:
                op, size = data[at], int.from_bytes(data[at + 1 : at + 9], "little")
                if op == 6:
                    full, stated, length = struct.unpack_from("<QII", data, at + 25)
                    packing = data[at + 41 : at + 41 + length].decode()
                    body = at + 41 + length + 8
                    packed = np.frombuffer(view[body : at + 9 + size], np.uint8)
                    if packing:
                        expand[packing](packed, room)
                    else:
                        room[:full] = packed
                    if crc and stated and zlib.crc32(room[:full]) != stated:
                        raise SystemExit("the benchmark's log is damaged")
                    del packed
                at += 9 + size
            view.release()

    return run


def ours(path: Path) -> Callable[[], Any]:
    from replay.log.source_options import SourceOptions
    from replay.readers.registry import open_log

    reader = open_log(path)
    return lambda: reader.read(path, SourceOptions())


def our_measure(log: Any) -> Result:
    unique = {id(c.stamps): c.stamps for c in log.channels.values()}
    floats = [c.values for c in log.channels.values() if c.values.dtype == np.float64]
    rest = [c.values for c in log.channels.values() if c.values.dtype != np.float64]
    rows, total, size = measured(floats, list(unique.values()))
    return rows, total, size + sum(v.nbytes for v in rest)


def joint_row(m: Any) -> list[float]:
    return [*m.position, *m.velocity, *m.effort]


def twist_row(m: Any) -> list[float]:
    a, b = m.twist.linear, m.twist.angular
    return [a.x, a.y, a.z, b.x, b.y, b.z]


def odom_row(m: Any) -> list[float]:
    p, q = m.pose.pose.position, m.pose.pose.orientation
    return [p.x, p.y, p.z, q.x, q.y, q.z, q.w, *m.pose.covariance, *twist_row(m.twist), *m.twist.covariance]


ROWS: dict[str, Callable[[Any], list[float]]] = dict(
    zip((t for t, _, _ in TOPICS), (joint_row, twist_row, odom_row), strict=True)
)


def by_message(each: Callable[[], Iterator[tuple[str, int, Any]]]) -> Any:
    """Collect decoded messages row by row, as the documented use of these libraries is."""
    rows: dict[str, list[list[float]]] = {t: [] for t in ROWS}
    stamps: dict[str, list[tuple[int, int]]] = {t: [] for t in ROWS}
    for topic, log_ns, message in each():
        stamp = message.header.stamp
        stamps[topic].append((log_ns, stamp.sec * 10**9 + stamp.nanosec))
        rows[topic].append(ROWS[topic](message))
    return [np.array(r) for r in rows.values()], [np.array(s, np.int64) for s in stamps.values()]


def rosbags(path: Path) -> Callable[[], Any]:
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    def each() -> Iterator[tuple[str, int, Any]]:
        with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
            for connection, stamp, raw in reader.messages():
                yield connection.topic, stamp, reader.deserialize(raw, connection.msgtype)

    return lambda: by_message(each)


def mcap_ros2(path: Path) -> Callable[[], Any]:
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    def each() -> Iterator[tuple[str, int, Any]]:
        with path.open("rb") as file:
            reader = make_reader(file, decoder_factories=[DecoderFactory()])
            for _, channel, message, decoded in reader.iter_decoded_messages(log_time_order=False):
                yield channel.topic, message.log_time, decoded

    return lambda: by_message(each)


def arrow_leaves(array: Any) -> list[np.ndarray]:
    """Number columns of an Arrow array of messages."""
    import pyarrow as pa

    if pa.types.is_struct(array.type):
        return [leaf for i in range(array.type.num_fields) for leaf in arrow_leaves(array.field(i))]
    if pa.types.is_list(array.type) or pa.types.is_large_list(array.type) or pa.types.is_fixed_size_list(array.type):
        values = array.flatten()
        return [] if pa.types.is_string(values.type) else [np.asarray(values).reshape(len(array), -1)]
    return [] if pa.types.is_string(array.type) else [array.to_numpy(zero_copy_only=False).reshape(len(array), 1)]


def arrow_columns(parts: list[tuple[np.ndarray, Any]]) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Numbers and stamps of a topic from batches of (log stamps, messages)."""
    numbers, stamps = [], []
    for log_ns, batch in parts:
        sec, nanosec, *rest = arrow_leaves(batch)
        stamps.append(np.stack([log_ns, sec[:, 0].astype(np.int64) * 10**9 + nanosec[:, 0]], 1))
        numbers.append(np.concatenate(rest, 1))
    return [np.concatenate(numbers)], [np.concatenate(stamps)]


def join(topics: list[tuple[list[np.ndarray], list[np.ndarray]]]) -> Any:
    return [a for numbers, _ in topics for a in numbers], [s for _, stamps in topics for s in stamps]


def rerun(path: Path) -> Callable[[], Any]:
    from rerun.chunk import McapReader

    def run() -> Any:
        parts: dict[str, list[tuple[np.ndarray, Any]]] = {t: [] for t in ROWS}
        for chunk in McapReader(str(path), decoders=["ros2_reflection"]).stream():
            if chunk.is_static or chunk.entity_path not in parts:
                continue
            batch = chunk.to_record_batch()
            names = batch.schema.names
            for i, name in enumerate(names):
                if name.endswith(":message"):
                    log_ns = batch.column(names.index("message_log_time")).to_numpy(zero_copy_only=False)
                    parts[chunk.entity_path].append((log_ns.view(np.int64), batch.column(i).flatten()))
        return join([arrow_columns(p) for p in parts.values()])

    return run


def roboto(path: Path) -> Callable[[], Any]:
    import mcap_codec
    import pyarrow as pa

    def topic(read: Any, size: int, name: str) -> Any:
        parts = []
        with mcap_codec.open_mcap_file(
            read, size, channel=mcap_codec.TopicName(name), timestamp=mcap_codec.TimestampSource("message_log_time")
        ) as batches:
            for batch in batches:
                columns = [batch.column(i) for i in range(2, batch.num_columns)]
                fields = [batch.schema.names[i] for i in range(2, batch.num_columns)]
                log_ns = batch.column(1).to_numpy(zero_copy_only=False).astype(np.int64)
                parts.append((log_ns, pa.StructArray.from_arrays(columns, fields)))
        return arrow_columns(parts)

    def run() -> Any:
        with path.open("rb") as file:
            number, size = file.fileno(), path.stat().st_size
            return join([topic(lambda at, n: os.pread(number, n, at), size, name) for name in ROWS])

    return run


MAKERS: dict[str, Callable[[Path], Callable[[], Any]]] = {
    "floor": lambda path: floor(path, False), "floor+crc": lambda path: floor(path, True), "ours": ours,
    "rerun": rerun, "roboto": roboto, "rosbags": rosbags, "mcap-ros2": mcap_ros2,
}  # fmt: skip
