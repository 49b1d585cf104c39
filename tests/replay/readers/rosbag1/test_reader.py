from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.rosbag1 import Reader, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from replay.errors import LogError
from replay.log.source_options import SourceOptions
from replay.readers.registry import read_log, summarise_log

OPTIONS = SourceOptions()
STORE = get_typestore(Stores.ROS1_NOETIC)
T0 = 1_700_000_000_000_000_000


@pytest.fixture
def make_bag(tmp_path: Path) -> Callable[..., Path]:
    """Write /speed (Float64, counting) and /joint_states (header 2 ms before log time)."""

    def make(compression: Writer.CompressionFormat | None = None, count: int = 200) -> Path:
        path = tmp_path / "log.bag"
        number, joints = STORE.types["std_msgs/msg/Float64"], STORE.types["sensor_msgs/msg/JointState"]
        header, time = STORE.types["std_msgs/msg/Header"], STORE.types["builtin_interfaces/msg/Time"]
        writer = Writer(path)
        writer.chunk_threshold = 2000
        if compression is not None:
            writer.set_compression(compression)
        with writer:
            speed = writer.add_connection("/speed", "std_msgs/msg/Float64", typestore=STORE)
            joint = writer.add_connection("/joint_states", "sensor_msgs/msg/JointState", typestore=STORE)
            for i in range(count):
                stamp = T0 + i * 5_000_000
                writer.write(speed, stamp, bytes(STORE.serialize_ros1(number(float(i)), "std_msgs/msg/Float64")))
                early = stamp - 2_000_000
                head = header(i, time(early // 10**9, early % 10**9), "base")
                message = joints(head, ["l", "r"], np.empty(0), np.array([i * 1.0, i * -1.0]), np.empty(0))
                writer.write(joint, stamp, bytes(STORE.serialize_ros1(message, "sensor_msgs/msg/JointState")))
        return path

    return make


@pytest.mark.parametrize("compression", [None, Writer.CompressionFormat.LZ4, Writer.CompressionFormat.BZ2])
def test_every_compression_gives_the_written_values(make_bag: Callable[..., Path], compression: Any) -> None:
    path = make_bag(compression)
    log = read_log(path, OPTIONS)
    np.testing.assert_array_equal(log.channels["/speed.data"].values, np.arange(200.0))
    np.testing.assert_array_equal(log.channels["/joint_states.velocity[r]"].values, -np.arange(200.0))
    stamps = T0 + np.arange(200) * 5_000_000
    np.testing.assert_array_equal(log.channels["/joint_states.velocity[l]"].stamps, stamps - 2_000_000)
    np.testing.assert_array_equal(log.channels["/speed.data"].stamps, stamps)
    assert log.summary.damage == ()
    assert {t.name: t.count for t in summarise_log(path, OPTIONS).topics} == {"/speed": 200, "/joint_states": 200}


def test_only_the_wanted_topics_are_decoded(make_bag: Callable[..., Path]) -> None:
    assert set(read_log(make_bag(), OPTIONS, ["/speed"]).channels) == {"/speed.data"}


def test_a_bag_without_index_is_read_in_order_and_told(make_bag: Callable[..., Path]) -> None:
    path = make_bag()
    raw = bytearray(path.read_bytes())
    place = raw.index(b"index_pos=") + len(b"index_pos=")
    end = int.from_bytes(raw[place : place + 8], "little")
    raw[place : place + 8] = bytes(8)
    path.write_bytes(raw[:end])
    log = read_log(path, OPTIONS)
    assert len(log.channels["/speed.data"].values) == 200
    assert any("has no index" in d for d in log.summary.damage)
    assert {t.name: t.count for t in summarise_log(path, OPTIONS).topics} == {"/speed": 200, "/joint_states": 200}


@pytest.mark.parametrize("share", [0.2, 0.5, 0.8])
def test_a_truncated_bag_gives_its_complete_chunks(make_bag: Callable[..., Path], share: float) -> None:
    path = make_bag()
    raw = path.read_bytes()
    path.write_bytes(raw[: int(len(raw) * share)])
    log = read_log(path, OPTIONS)
    values = log.channels["/speed.data"].values
    assert 0 < len(values) < 200
    np.testing.assert_array_equal(values, np.arange(len(values)))
    assert log.summary.damage


def test_an_index_that_was_cut_off_does_not_say_how_much_was_recorded(make_bag: Callable[..., Path]) -> None:
    path = make_bag()
    raw = path.read_bytes()
    last = raw.rindex(b"op=\x05", 0, raw.index(b"op=\x06"))  # op 5: a chunk; op 6: what it holds, at the end
    first = raw.index(b"op=\x04", last)  # op 4: its index data, a record for each connection
    path.write_bytes(raw[: raw.index(b"op=\x04", first + 1)])
    log = read_log(path, OPTIONS)
    assert len(log.channels["/speed.data"].values) == 200
    damage = log.summary.damage
    assert any("how many were recorded is not known (/" in d for d in damage)


def test_another_version_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "old.bag"
    path.write_bytes(b"#ROSBAG V1.2\n" + bytes(100))
    with pytest.raises(LogError, match=r"version 2\.0.*rosbag migrate"):
        read_log(path, OPTIONS)


@pytest.mark.parametrize("name", ["robot_localization/test1.bag", "robot_localization/test2.bag"])
def test_real_bags_decode_like_rosbags(reference_data: Path, flatten: Callable[..., Any], name: str) -> None:
    path = reference_data / "reference_logs" / name
    log = read_log(path, OPTIONS)
    assert log.summary.damage == ()
    rows: dict[str, int] = {}
    with Reader(path) as reader:
        store = get_typestore(Stores.EMPTY)
        for connection in reader.connections:
            store.register(get_types_from_msg(connection.msgdef.data, connection.msgtype))
        for k, (connection, _, raw) in enumerate(reader.messages()):
            row = rows.get(connection.topic, 0)
            rows[connection.topic] = row + 1
            if k % 37:
                continue
            message = flatten(store.deserialize_ros1(raw, connection.msgtype))
            for part in ("sec", "nanosec"):
                message.pop(f"header.stamp.{part}")
            assert message
            for field, value in message.items():
                np.testing.assert_array_equal(log.channels[f"{connection.topic}.{field}"].values[row], value)
    assert {t.name: t.count for t in log.summary.topics} == rows


def test_fixtures_of_all_compressions_hold_the_same_channels(reference_data: Path) -> None:
    folder = reference_data / "reference_logs" / "rosbagjs" / "fixtures"
    logs = [read_log(folder / f"example{c}.bag", OPTIONS) for c in ("", "-lz4", "-bz2")]
    assert len(logs[0].channels) == 51
    for log in logs[1:]:
        for name, channel in logs[0].channels.items():
            np.testing.assert_array_equal(channel.values, log.channels[name].values)
            np.testing.assert_array_equal(channel.stamps, log.channels[name].stamps)
    with pytest.raises(LogError, match="is empty"):
        read_log(folder / "empty-file.bag", OPTIONS)
    assert read_log(folder / "no-messages.bag", OPTIONS).channels == {}
    assert sum(t.count for t in summarise_log(folder / "example-unsorted-chunks.bag", OPTIONS).topics) == 3
