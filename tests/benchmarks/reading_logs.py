"""The logs of the reading benchmark, made once and kept: JointState of six and TwistStamped at 1 kHz, Odometry."""

from __future__ import annotations

import shutil
import struct
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

T0 = 1_760_000_000 * 10**9
TOPICS = (
    ("/joint_states", "sensor_msgs/msg/JointState", 1),
    ("/cmd_vel_stamped", "geometry_msgs/msg/TwistStamped", 1),
    ("/odom", "nav_msgs/msg/Odometry", 10),
)
LOGS = {
    "mcap-zstd": "log_zstd.mcap", "mcap-lz4": "log_lz4.mcap", "mcap-none": "log_none.mcap", "bag-none": "log_none.bag",
    "bag-lz4": "log_lz4.bag", "bag-bz2": "log_bz2.bag", "db3": "log_db3",
}  # fmt: skip


def sentinels(ros1: bool) -> list[tuple[Any, int]]:
    """One message per topic whose numbers are all different, and how many floats each holds."""
    from rosbags.typesys import Stores, get_typestore

    types = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE).types
    numbers = iter(1e100 * k for k in range(1, 1000))

    def floats(n: int) -> Any:
        return np.array([next(numbers) for _ in range(n)])

    def make(name: str, *values: Any) -> Any:
        return types[name](*values)

    def header(frame: str) -> Any:
        stamp = make("builtin_interfaces/msg/Time", 0x7A7B7C7D, 0x1A1B1C1D)
        return make("std_msgs/msg/Header", *([0x5A5B5C5D] if ros1 else []), stamp, frame)

    def vector(kind: str, n: int) -> Any:
        return make(f"geometry_msgs/msg/{kind}", *floats(n).tolist())

    def twist() -> Any:
        return make("geometry_msgs/msg/Twist", vector("Vector3", 3), vector("Vector3", 3))

    ends = ("front_left_wheel", "front_right_wheel", "rear_left_wheel", "rear_right_wheel", "front_steer", "rear_steer")
    joints = [f"{end}_joint" for end in ends]
    states = make("sensor_msgs/msg/JointState", header("base_link"), joints, floats(6), floats(6), floats(6))
    command = make("geometry_msgs/msg/TwistStamped", header("base_link"), twist())
    pose = make("geometry_msgs/msg/Pose", vector("Point", 3), vector("Quaternion", 4))
    odometry = make(
        "nav_msgs/msg/Odometry", header("odom"), "base_link",
        make("geometry_msgs/msg/PoseWithCovariance", pose, floats(36)),
        make("geometry_msgs/msg/TwistWithCovariance", twist(), floats(36)),
    )  # fmt: skip
    return [(states, 18), (command, 6), (odometry, 85)]


def signals(topic: int, n: int, step: float) -> np.ndarray:
    """Numbers of one topic, shape (n, k): quantised positions, noisy speeds, float32 efforts, constant covariances."""
    rng = np.random.default_rng(topic)
    t = np.arange(n) * step
    base = 8 + 5 * np.sin(2 * np.pi * (0.05 + 0.01 * np.arange(6)) * t[:, None])
    noisy = base + rng.normal(0, 0.05, base.shape)
    if topic == 0:
        tick = 2 * np.pi / 81920
        position = np.round(np.cumsum(base * step, 0) / tick) * tick
        effort = (0.3 * base + rng.normal(0, 0.02, base.shape)).astype("f4").astype("f8")
        return np.hstack([position, noisy, effort])
    twist = np.zeros((n, 6))
    twist[:, [0, 5]] = noisy[:, :2] * (0.1, 0.01)
    if topic == 1:
        return twist
    out = np.zeros((n, 85))
    out[:, 0], out[:, 1] = 1e-2 * np.arange(n), 2e-3 * np.arange(n)
    out[:, 5], out[:, 6] = np.sin(5e-4 * np.arange(n)), np.cos(5e-4 * np.arange(n))
    out[:, 7], out[:, 42], out[:, 43:49] = 0.01, 0.02, twist
    return out


def payloads(topic: int, message: Any, kind: str, count: int, n: int, every: int, ros1: bool) -> tuple[Any, Any]:
    """All payloads of one topic as rows of bytes, and their log stamps."""
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE)
    raw = bytes((store.serialize_ros1 if ros1 else store.serialize_cdr)(message, kind))
    rows = np.tile(np.frombuffer(raw, np.uint8), (n, 1))
    own = T0 + topic * 250_000 + np.arange(n) * every * 1_000_000
    cells: list[tuple[bytes, Any]] = [(struct.pack("<I", 0x7A7B7C7D), (own // 10**9).astype("<u4"))]
    cells += [(struct.pack("<I", 0x1A1B1C1D), (own % 10**9).astype("<u4"))]
    cells += [(struct.pack("<I", 0x5A5B5C5D), np.arange(n, dtype="<u4"))] if ros1 else []
    values = signals(topic, n, every * 1e-3)
    first = [0, 18, 24][topic]
    cells += [(struct.pack("<d", 1e100 * (first + k + 1)), values[:, k]) for k in range(count)]
    for mark, column in cells:
        at = raw.index(mark)
        rows[:, at : at + len(mark)] = np.ascontiguousarray(column).view(np.uint8).reshape(n, -1)
    return rows, own + 200_000 + np.random.default_rng(9 + topic).integers(0, 60_000, n)


def messages(duration: float, ros1: bool) -> Iterator[tuple[int, int, bytes]]:
    """Topic number, log stamp and payload of all messages in log order, ten seconds at a time."""
    n = int(duration * 1000)
    made = [
        payloads(i, message, kind, count, n // every, every, ros1)
        for i, ((message, count), (_, kind, every)) in enumerate(zip(sentinels(ros1), TOPICS, strict=True))
    ]
    topic = np.concatenate([np.full(len(stamps), i) for i, (_, stamps) in enumerate(made)])
    row = np.concatenate([np.arange(len(stamps)) for _, stamps in made])
    stamp = np.concatenate([stamps for _, stamps in made])
    for k in np.argsort(stamp, kind="stable"):
        yield int(topic[k]), int(stamp[k]), made[topic[k]][0][row[k]].tobytes()


def make_log(name: str, path: Path, duration: float) -> None:
    """Write one of `LOGS`."""
    from rosbags.typesys import Stores, get_typestore

    container, _, packing = name.partition("-")
    store = get_typestore(Stores.ROS1_NOETIC if container == "bag" else Stores.ROS2_HUMBLE)
    if container == "mcap":
        from mcap.writer import CompressionType, Writer

        with path.open("wb") as file:
            mcap = Writer(file, chunk_size=768 << 10, compression=CompressionType[packing.upper()])
            mcap.start("ros2", "benchmark")
            numbers = []
            for topic, kind, _ in TOPICS:
                text = store.generate_msgdef(kind, ros_version=2)[0].encode()
                numbers.append(mcap.register_channel(topic, "cdr", mcap.register_schema(kind, "ros2msg", text)))
            for which, stamp, raw in messages(duration, False):
                mcap.add_message(numbers[which], stamp, raw, stamp)
            mcap.finish()
        return
    writer: Any
    if container == "bag":
        from rosbags.rosbag1 import Writer as BagWriter

        writer = BagWriter(path)
        if packing != "none":
            writer.set_compression(BagWriter.CompressionFormat[packing.upper()])
    else:
        from rosbags.rosbag2 import StoragePlugin
        from rosbags.rosbag2 import Writer as FolderWriter

        writer = FolderWriter(path, version=9, storage_plugin=StoragePlugin.SQLITE3)
    with writer:
        connections = [writer.add_connection(topic, kind, typestore=store) for topic, kind, _ in TOPICS]
        for which, stamp, raw in messages(duration, container == "bag"):
            writer.write(connections[which], stamp, raw)


def log_at(folder: Path, name: str, duration: float) -> Path:
    """Return a log, made now unless it is there already."""
    path = folder / f"{duration:g}s_{LOGS[name]}"
    if not path.exists():
        print(f"making {path.name} …", file=sys.stderr, flush=True)
        draft = path.with_name("draft_" + path.name)
        if draft.is_dir():
            shutil.rmtree(draft)
        draft.unlink(missing_ok=True)
        make_log(name, draft, duration)
        draft.rename(path)
    return path
