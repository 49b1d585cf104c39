from __future__ import annotations

import json
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.writer import CompressionType, IndexType, Writer
from rosbags.typesys import Stores, get_typestore

from replay.errors import LogError
from replay.log.source_options import SourceOptions
from replay.readers.mcap.reader import McapReader
from replay.readers.registry import read_log, summarise_log

OPTIONS = SourceOptions()
T0 = 1_760_000_000_000_000_000
STEP = 10_000_000
ODOM = "nav_msgs/msg/Odometry"
JOINTS = "sensor_msgs/msg/JointState"
Make = Callable[..., Any]


@pytest.fixture
def twists(make_message: Make) -> Callable[[int], list[Any]]:
    """Rows of /cmd_vel without header: linear.x counts up."""

    def make(count: int) -> list[Any]:
        rows = []
        for i in range(count):
            linear, angular = (
                make_message("geometry_msgs/msg/Vector3", x=float(i), y=0.0, z=0.0),
                make_message("geometry_msgs/msg/Vector3", x=0.0, y=0.0, z=-float(i)),
            )
            message = make_message("geometry_msgs/msg/Twist", linear=linear, angular=angular)
            rows.append(("/cmd_vel", "geometry_msgs/msg/Twist", message, T0 + i * STEP, T0 + i * STEP - 1000))
        return rows

    return make


@pytest.fixture
def joints(joint_state: Make) -> Callable[..., list[Any]]:
    """Rows of /joint_states with header stamps 1 ms before log time, or `lead` ns from it."""

    def make(count: int, lead: int = -1_000_000, topic: str = "/joint_states") -> list[Any]:
        stamps = [T0 + i * STEP for i in range(count)]
        return [
            (topic, JOINTS, joint_state(t + lead, ["fl", "fr"], [float(i), float(-i)]), t, t)
            for i, t in enumerate(stamps)
        ]

    return make


@pytest.mark.parametrize("compression", [CompressionType.NONE, CompressionType.LZ4, CompressionType.ZSTD])
@pytest.mark.parametrize("chunked", [True, False])
def test_every_compression_gives_the_written_values(
    make_mcap: Make, twists: Make, joints: Make, compression: CompressionType, chunked: bool
) -> None:
    path = make_mcap([*twists(50), *joints(40)], compression=compression, use_chunking=chunked, chunk_size=2000)
    log = read_log(path, OPTIONS)
    np.testing.assert_array_equal(log.channels["/cmd_vel.linear.x"].values, np.arange(50.0))
    np.testing.assert_array_equal(log.channels["/joint_states.velocity[fr]"].values, -np.arange(40.0))
    assert log.summary.damage == ()
    assert [(t.name, t.count) for t in log.summary.topics] == [("/cmd_vel", 50), ("/joint_states", 40)]
    assert (log.summary.start_ns, log.summary.stop_ns) == (T0, T0 + 49 * STEP)


def test_clocks_give_header_log_and_publish_stamps(make_mcap: Make, twists: Make, joints: Make) -> None:
    path = make_mcap([*twists(5), *joints(5)])
    log_time = T0 + np.arange(5) * STEP
    header, log, publish = (read_log(path, OPTIONS, clock=c) for c in ("header", "log", "publish"))
    np.testing.assert_array_equal(header.channels["/joint_states.velocity[fl]"].stamps, log_time - 1_000_000)
    np.testing.assert_array_equal(header.channels["/cmd_vel.linear.x"].stamps, log_time)
    np.testing.assert_array_equal(log.channels["/joint_states.velocity[fl]"].stamps, log_time)
    np.testing.assert_array_equal(publish.channels["/cmd_vel.linear.x"].stamps, log_time - 1000)
    assert any("no header stamps" in n and "/cmd_vel" in n for n in header.summary.notes)


def test_options_choose_the_clock(make_mcap: Make, joints: Make) -> None:
    log = read_log(make_mcap(joints(3)), SourceOptions(stamp="log"))
    assert log.clock == "log"
    assert log.channels["/joint_states.velocity[fl]"].stamps[0] == T0


def test_far_header_stamps_are_told_and_topics_without_header_join_them(
    make_mcap: Make, twists: Make, joints: Make
) -> None:
    lead = -66 * 86_400 * 10**9
    log = read_log(make_mcap([*twists(50), *joints(50, lead)]), OPTIONS)
    np.testing.assert_array_equal(log.channels["/joint_states.velocity[fl]"].stamps, T0 + lead + np.arange(50) * STEP)
    assert np.abs(log.channels["/cmd_vel.linear.x"].stamps - (T0 + lead + np.arange(50) * STEP)).max() < 1000
    assert any("66.0 days before" in n for n in log.summary.notes)


def test_zero_header_stamps_fall_back_to_log_time(make_mcap: Make, joints: Make) -> None:
    rows = [*joints(20), *[(*r[:3], r[3] + 20 * STEP, r[4]) for r in joints(5, lead=-T0 - 4 * STEP)[:1]]]
    rows[-1][2].header.stamp.sec = rows[-1][2].header.stamp.nanosec = 0
    log = read_log(make_mcap(rows), OPTIONS)
    assert log.channels["/joint_states.velocity[fl]"].stamps[-1] == T0 + 20 * STEP
    assert any("1 of 21 header stamps are zero" in n for n in log.summary.notes)


def test_only_the_wanted_topics_are_decoded(make_mcap: Make, twists: Make, joints: Make) -> None:
    log = read_log(make_mcap([*twists(5), *joints(5)]), OPTIONS, ["/cmd_vel"])
    assert {c.topic for c in log.channels.values()} == {"/cmd_vel"}
    assert len(log.summary.topics) == 2


def test_two_types_on_one_topic_are_both_decoded(make_mcap: Make, twists: Make, joints: Make) -> None:
    log = read_log(make_mcap([*twists(3), *joints(4, topic="/cmd_vel")]), OPTIONS)
    assert len(log.channels["/cmd_vel.linear.x"].values) == 3
    assert len(log.channels[f"/cmd_vel ({JOINTS}).velocity[fl]"].values) == 4
    assert any("several message types" in n for n in log.summary.notes)


def test_long_arrays_are_left_out_and_named(make_mcap: Make, make_message: Make) -> None:
    scan = make_message(
        "sensor_msgs/msg/LaserScan", T0, angle_min=0.0, angle_max=1.0, angle_increment=0.1, time_increment=0.0,
        scan_time=0.1, range_min=0.0, range_max=9.0, ranges=np.ones(65, np.float32),
        intensities=np.ones(64, np.float32),
    )  # fmt: skip
    log = read_log(make_mcap([("/scan", "sensor_msgs/msg/LaserScan", scan, T0, T0)]), OPTIONS)
    assert "/scan.intensities[63]" in log.channels
    assert "/scan.ranges[0]" not in log.channels
    assert any("more than 64 elements: ranges" in n for n in log.summary.notes)


def test_backwards_and_equal_stamps_stay_as_recorded(make_mcap: Make, twists: Make) -> None:
    rows = twists(4)
    stamps = [T0, T0 + 5, T0 + 5, T0 + 2]
    rows = [(*r[:3], t, t) for r, t in zip(rows, stamps, strict=True)]
    log = read_log(make_mcap(rows), OPTIONS)
    assert log.channels["/cmd_vel.linear.x"].stamps.tolist() == stamps
    assert log.channels["/cmd_vel.linear.x"].values.tolist() == [0.0, 1.0, 2.0, 3.0]


def write_raw(path: Path, encoding: str, schema: tuple[str, str, bytes], payloads: list[bytes], **options: Any) -> Path:
    with path.open("wb") as file:
        writer = Writer(file, **options)
        writer.start()
        channel = writer.register_channel("/raw", encoding, writer.register_schema(*schema))
        for i, data in enumerate(payloads):
            writer.add_message(channel, T0 + i, data, T0 + i)
        writer.finish()
    return path


def test_json_messages_are_flattened(tmp_path: Path) -> None:
    rows = [
        {"timestamp": {"sec": 5, "nsec": 7}, "ok": True, "name": ["a", "b"], "v": [1.5, 2], "text": "x", "big": 2**63},
        {"timestamp": {"sec": 6, "nsec": 0}, "ok": False, "name": ["b", "a"], "v": [3, 4]},
    ]
    payloads = [json.dumps(r).encode() for r in rows]
    path = write_raw(tmp_path / "j.mcap", "json", ("T", "jsonschema", b"{}"), [*payloads, b"{"])
    log = read_log(path, OPTIONS)
    assert log.channels["/raw.v[a]"].values.tolist() == [1.5, 4.0]
    assert log.channels["/raw.v[b]"].values.tolist() == [2, 3]
    assert log.channels["/raw.ok"].values.tolist() == [1, 0]
    assert log.channels["/raw.ok"].stamps.tolist() == [5_000_000_007, 6_000_000_000]
    assert log.channels["/raw.big"].values.dtype == np.uint64
    assert any("1 of 3 messages cannot be decoded: not JSON" in d for d in log.summary.damage)


def test_ros1_messages_in_mcap(tmp_path: Path) -> None:
    store = get_typestore(Stores.ROS1_NOETIC)
    message = store.types["std_msgs/msg/Float64"](2.5)
    payload = bytes(store.serialize_ros1(message, "std_msgs/msg/Float64"))
    path = write_raw(tmp_path / "r.mcap", "ros1", ("std_msgs/Float64", "ros1msg", b"float64 data"), [payload] * 3)
    assert read_log(path, OPTIONS).channels["/raw.data"].values.tolist() == [2.5] * 3


def test_idl_definitions(tmp_path: Path) -> None:
    text = b"module p { module msg { struct T { double v; }; }; };"
    payload = b"\0\1\0\0" + struct.pack("<d", 1.25)
    path = write_raw(tmp_path / "i.mcap", "cdr", ("p/msg/T", "ros2idl", text), [payload])
    assert read_log(path, OPTIONS).channels["/raw.v"].values.tolist() == [1.25]


def test_unsupported_serialisation_costs_no_other_topic(tmp_path: Path) -> None:
    path = write_raw(tmp_path / "p.mcap", "cbor", ("T", "cddl", b"\xff\xfe"), [b"\1"])
    log = read_log(path, OPTIONS)
    assert log.channels == {}
    assert log.summary.topics[0].note == "cbor serialisation is not decoded"
    assert any("/raw is not decoded" in n for n in log.summary.notes)


def test_known_types_without_definition_are_taken_by_name(tmp_path: Path) -> None:
    payload = b"\0\1\0\0" + struct.pack("<d", 1.25)
    path = write_raw(tmp_path / "n.mcap", "cdr", ("std_msgs/msg/Float64", "", b""), [payload])
    assert read_log(path, OPTIONS).channels["/raw.data"].values.tolist() == [1.25]


@pytest.mark.parametrize("share", [0.2, 0.4, 0.6])
def test_a_truncated_file_gives_its_complete_chunks(make_mcap: Make, twists: Make, share: float) -> None:
    path = make_mcap(twists(500), chunk_size=3000)
    raw = path.read_bytes()
    path.write_bytes(raw[: int(len(raw) * share)])
    log = read_log(path, OPTIONS)
    values = log.channels["/cmd_vel.linear.x"].values
    assert 0 < len(values) < 500
    np.testing.assert_array_equal(values, np.arange(len(values), dtype=np.float64))
    assert any("without a footer" in d for d in log.summary.damage)
    assert summarise_log(path, OPTIONS).topics[0].count == len(values)


def test_a_damaged_chunk_is_left_out_and_told(make_mcap: Make, twists: Make) -> None:
    path = make_mcap(twists(500), chunk_size=3000, compression=CompressionType.NONE)
    raw = bytearray(path.read_bytes())
    raw[len(raw) // 3] ^= 1
    path.write_bytes(raw)
    log = read_log(path, OPTIONS)
    assert 400 < len(log.channels["/cmd_vel.linear.x"].values) < 500
    assert any("checksum differs" in d for d in log.summary.damage)


def test_a_damaged_length_of_a_chunk_costs_nothing(make_mcap: Make, twists: Make) -> None:
    path = make_mcap(twists(500), chunk_size=3000)
    raw = bytearray(path.read_bytes())
    place = raw.index(b"zstd", len(raw) // 3) - 4 - 28 - 8  # length of a chunk record
    raw[place : place + 8] = (2**60).to_bytes(8, "little")
    path.write_bytes(raw)
    log = read_log(path, OPTIONS)
    np.testing.assert_array_equal(log.channels["/cmd_vel.linear.x"].values, np.arange(500.0))
    assert any("a length of the chunk at byte" in d for d in log.summary.damage)


def test_a_count_other_than_in_the_statistics_is_told(make_mcap: Make, twists: Make) -> None:
    path = make_mcap(twists(20), use_chunking=False)
    raw = bytearray(path.read_bytes())
    raw[raw.index(b"\x05")] = 0x70  # the first message record turns into an unknown record
    path.write_bytes(raw)
    log = read_log(path, OPTIONS)
    assert any(
        "/cmd_vel: 19 of 20 messages that the log's statistics count were found" in d for d in log.summary.damage
    )


def test_a_declared_size_beyond_reason_is_not_expanded(tmp_path: Path) -> None:
    body = struct.pack("<QQQI", 0, 0, 1 << 40, 0) + struct.pack("<I", 4) + b"zstd" + struct.pack("<Q", 4) + b"abcd"
    path = tmp_path / "bomb.mcap"
    path.write_bytes(b"\x89MCAP0\r\n" + b"\x06" + struct.pack("<Q", len(body)) + body)
    assert any(f"declares {1 << 40} bytes" in d for d in read_log(path, OPTIONS).summary.damage)


def test_without_an_index_nothing_is_missing(make_mcap: Make, twists: Make) -> None:
    path = make_mcap(twists(300), chunk_size=3000, index_types=IndexType.NONE, use_statistics=False)
    assert summarise_log(path, OPTIONS).topics[0].count == 300
    assert len(read_log(path, OPTIONS, ["/cmd_vel"]).channels["/cmd_vel.linear.x"].values) == 300


def test_metadata_are_kept(tmp_path: Path) -> None:
    path = tmp_path / "m.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(library="lib")
        writer.add_metadata("machine", {"id": "H-7"})
        writer.finish()
    found = summarise_log(path, OPTIONS).metadata
    assert (found["machine.id"], found["library"]) == ("H-7", "lib")


def test_an_empty_file_says_so(tmp_path: Path) -> None:
    path = tmp_path / "e.mcap"
    path.touch()
    with pytest.raises(LogError, match=r"is empty \(0 bytes\)"):
        read_log(path, OPTIONS)
    with pytest.raises(LogError, match="is empty"):
        McapReader().read(path, OPTIONS)


def test_conformance_files_hold_the_stated_messages(reference_data: Path) -> None:
    paths = sorted((reference_data / "mcap_conformance").rglob("*.mcap"))
    assert len(paths) > 200
    for path in paths:
        records = json.loads(path.with_suffix(".json").read_text())["records"]
        stamps = [int(dict(r["fields"])["log_time"]) for r in records if r["type"] == "Message"]
        summary = summarise_log(path, OPTIONS)
        assert sum(t.count for t in summary.topics) == len(stamps), path.name
        assert summary.damage == (), path.name
        assert read_log(path, OPTIONS).summary.damage == (), path.name
        if stamps:
            assert (summary.start_ns, summary.stop_ns) == (min(stamps), max(stamps)), path.name


def test_real_joint_states_are_keyed_by_joint(reference_data: Path) -> None:
    path = next((reference_data / "reference_logs" / "abitobot").glob("*.mcap"))
    log = read_log(path, OPTIONS)
    names = [n for n in log.channels if n.startswith("/joint_states.velocity[")]
    assert len(names) == 10
    assert len(log.channels["/joint_states.velocity[wheel_left_back_joint]"].values) == 1866
    assert len(log.channels["/imu/data.angular_velocity.z"].values) == 4712
    assert any("before the log's stamps" in n for n in log.summary.notes)
