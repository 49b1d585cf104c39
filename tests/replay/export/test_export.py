"""One mission in every format, read back by other libraries: the same values and stamps."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
import zstandard
from mcap.reader import make_reader
from mcap.records import Chunk, MessageIndex
from mcap.stream_reader import StreamReader
from numpy.testing import assert_allclose, assert_array_equal
from pyarrow import csv
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from replay.errors import ConfigError, OutputError
from replay.export.formats.message_layout import Layout
from replay.export.formats.rosbag2 import write_rosbag2
from replay.export.formats.topics import axle_joint, mission_topics, wheel_joint
from replay.export.formats.twincat import plc_symbol
from replay.export.mission import FORMATS, write_mission
from replay.faults import FaultMode, FaultSpec, Side
from replay.simulation.options import SimulatedMission, SimulationOptions
from replay.simulation.run import simulate_mission

RADIUS = 0.427
WHEELS = ("FR", "FL", "RR", "RL")
JOINTS = [wheel_joint(w) for w in WHEELS] + [axle_joint("front"), axle_joint("rear")]
# Topic, field, and the canonical signals of its six joints.
FIELDS = [
    (topic, field, [f"wheel.{w}.{leaf}" for w in WHEELS] if leaf else [], steer)
    for topic, field, leaf, steer in (
        ("/joint_states", "velocity", "v", ""),
        ("/joint_states", "position", "", "phi"),
        ("/wheel_commands", "velocity", "v_ref", ""),
        ("/wheel_commands", "position", "", "phi_ref"),
        ("/valve_commands", "effort", "u", "u"),
        ("/valve_feedback", "effort", "u_applied", "u_applied"),
        ("/joint_states_redundant", "velocity", "v_true", ""),
        ("/joint_states_redundant", "position", "", "phi_true"),
    )
]


def make(**options: Any) -> SimulatedMission:
    faults = (
        FaultSpec("FL", Side.SENSOR, FaultMode.NO_SIGNAL, 1.0, 1.5),
        FaultSpec("RR", Side.SENSOR, FaultMode.NO_SIGNAL, 1.2, 2.0),
        FaultSpec("FR", Side.SENSOR, FaultMode.NOISY, 0.5, 2.0, 0.3, 0.0, 0.1),
    )
    return simulate_mission(SimulationOptions(scenario="random", duration_s=3.0, rate_hz=200, faults=faults, **options))


@pytest.fixture(scope="module")
def mission() -> SimulatedMission:
    return make()


Message = tuple[str, int, Any]


def read_ros(path: Path) -> Iterator[Message]:
    with AnyReader([path]) as reader:
        for connection, stamp, raw in reader.messages():
            yield connection.topic, stamp, reader.deserialize(raw, connection.msgtype)


def read_mcap(path: Path) -> Iterator[Message]:
    """Decode by the definitions in the file alone."""
    store = get_typestore(Stores.EMPTY)
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None
        for schema in summary.schemas.values():
            types = get_types_from_msg(schema.data.decode(), schema.name)
            store.register({name: fields for name, fields in types.items() if name not in store.types})
        for schema, channel, message in reader.iter_messages():
            assert schema is not None
            yield channel.topic, message.log_time, store.deserialize_cdr(message.data, schema.name)


READERS = {"mcap": read_mcap, "ros1": read_ros, "rosbag2": read_ros}
NAMES = {"mcap": "m.mcap", "ros1": "m.bag", "rosbag2": "m_rosbag2"}


def header_ns(message: Any) -> int:
    return int(message.header.stamp.sec) * 10**9 + int(message.header.stamp.nanosec)


@pytest.mark.parametrize("container", READERS)
def test_message_logs_hold_the_mission(mission: SimulatedMission, tmp_path: Path, container: str) -> None:
    path = tmp_path / NAMES[container]
    write_mission(mission, path, container)
    messages: dict[str, list[tuple[int, Any]]] = {}
    last = 0
    for topic, stamp, message in READERS[container](path):
        assert stamp >= last
        last = stamp
        messages.setdefault(topic, []).append((stamp, message))
    assert len(messages) == 8
    for rows in messages.values():
        delay = np.array([stamp - header_ns(m) for stamp, m in rows])
        assert (delay > 0).all()
        assert delay.max() < 2_000_000
    for topic, field, wheel, steer in FIELDS:
        assert_array_equal([header_ns(m) for _, m in messages[topic]], mission.stamps)
        assert all(list(m.name) == JOINTS for _, m in messages[topic])
        values = np.array([getattr(m, field) for _, m in messages[topic]])
        for i, name in enumerate(wheel):
            factor = RADIUS if field == "velocity" else 1.0
            assert_allclose(values[:, i] * factor, mission.columns[name], rtol=1e-12, atol=0)
        for i, axle in enumerate(("front", "rear"), 4):
            expected = mission.columns[f"steer.{axle}.{steer}"] if steer else np.full(mission.stamps.size, np.nan)
            assert_array_equal(values[:, i], expected)
    twists = [m.twist for _, m in messages["/cmd_vel"]]
    assert_array_equal([t.linear.x for t in twists], mission.columns["cmd.v"])
    assert_array_equal([t.angular.z for t in twists], mission.columns["cmd.omega"])
    assert not any(t.linear.y or t.linear.z or t.angular.x or t.angular.y for t in twists)
    imu, gnss = mission.slow
    assert_array_equal([header_ns(m) for _, m in messages["/imu"]], imu.stamps)
    assert_array_equal([m.angular_velocity.z for _, m in messages["/imu"]], imu.columns["imu.yaw_rate"])
    first = messages["/imu"][0][1]
    assert first.orientation_covariance[0] == first.linear_acceleration_covariance[0] == -1.0
    assert first.angular_velocity_covariance[8] == 4e-6
    assert_array_equal([header_ns(m) for _, m in messages["/gnss/fix"]], gnss.stamps)
    assert_array_equal([m.latitude for _, m in messages["/gnss/fix"]], gnss.columns["gnss.lat"])
    assert_array_equal([m.longitude for _, m in messages["/gnss/fix"]], gnss.columns["gnss.lon"])
    fix = messages["/gnss/fix"][0][1]
    assert (fix.status.status, fix.status.service, fix.position_covariance_type) == (2, 1, 2)
    assert_array_equal(fix.position_covariance, np.diag([0.0025, 0.0025, 0.01]).ravel())


@pytest.mark.parametrize("container", READERS)
def test_a_joint_without_sample_is_left_out(tmp_path: Path, container: str) -> None:
    mission = make(silent="drop", evidence="base")
    path = tmp_path / NAMES[container]
    write_mission(mission, path, container)
    stamps: dict[str, list[int]] = {joint: [] for joint in JOINTS}
    speeds: dict[str, list[float]] = {joint: [] for joint in JOINTS}
    for topic, _, message in READERS[container](path):
        if topic == "/joint_states":
            assert len(message.velocity) == len(message.position) == len(message.name)
            for joint, value in zip(message.name, message.velocity, strict=True):
                stamps[joint].append(header_ns(message))
                speeds[joint].append(value)
    for wheel, joint in zip(WHEELS, JOINTS, strict=False):
        v = mission.columns[f"wheel.{wheel}.v"]
        assert_array_equal(stamps[joint], mission.stamps[~np.isnan(v)])
        assert_allclose(np.array(speeds[joint]) * RADIUS, v[~np.isnan(v)], rtol=1e-12, atol=0)
    assert len(speeds["front_left_wheel"]) == 500
    assert len(speeds["rear_right_wheel"]) == 440


def test_mcap_index_leads_to_every_message(mission: SimulatedMission, tmp_path: Path) -> None:
    path = tmp_path / "m.mcap"
    write_mission(mission, path, "mcap")
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        assert summary.statistics.message_count == 600 * 6 + 300 + 30
        assert summary.statistics.message_start_time == min(c.message_start_time for c in summary.chunk_indexes)
        assert sum(1 for _ in reader.iter_messages(topics=["/valve_commands"])) == 600
    data, indexed = b"", 0
    with path.open("rb") as file:
        for record in StreamReader(file, emit_chunks=True).records:
            if isinstance(record, Chunk):
                data = zstandard.decompress(record.data)
            elif isinstance(record, MessageIndex):
                for stamp, offset in record.records:
                    # opcode, length, channel, sequence, log stamp
                    opcode, _, channel, _, log_stamp = struct.unpack_from("<BQHIQ", data, offset)
                    assert (opcode, channel, log_stamp) == (5, record.channel_id, stamp)
                    indexed += 1
    assert indexed == summary.statistics.message_count


def test_compressed_rosbag2(mission: SimulatedMission, tmp_path: Path) -> None:
    path = tmp_path / "m_rosbag2"
    write_rosbag2(path, mission_topics(mission, "cdr"), compressed=True)
    assert {p.name for p in path.iterdir()} == {"m_rosbag2_0.db3.zstd", "metadata.yaml"}
    assert sum(topic == "/joint_states" for topic, *_ in read_ros(path)) == 600


def test_a_recording_is_replaced_as_a_whole(mission: SimulatedMission, tmp_path: Path) -> None:
    path = tmp_path / "m_rosbag2"
    for compressed in (True, False):
        write_rosbag2(path, mission_topics(mission, "cdr"), compressed=compressed)
    assert {p.name for p in path.iterdir()} == {"m_rosbag2_0.db3", "metadata.yaml"}
    assert [p.name for p in tmp_path.iterdir()] == ["m_rosbag2"]


def test_tables_hold_the_mission(mission: SimulatedMission, tmp_path: Path) -> None:
    for name in ("csv", "parquet"):
        write_mission(mission, tmp_path / f"m.{name}", name)
    text = csv.read_csv(tmp_path / "m.csv").to_pandas()
    binary = pq.read_table(tmp_path / "m.parquet").to_pandas()
    for table in (text, binary):
        assert_array_equal(table["time_ns"], mission.stamps)
        for name, values in mission.columns.items():
            assert_array_equal(table[name].to_numpy(float), values)
        for group in mission.slow:
            rows = np.isin(mission.stamps, group.stamps)
            for name, values in group.columns.items():
                assert_array_equal(table[name][rows], values)
                assert table[name][~rows].isna().all()


@pytest.mark.parametrize("silent", ["zero", "drop"])
@pytest.mark.parametrize("rate", [200.0, 300.0])
def test_twincat_export_holds_the_mission(tmp_path: Path, silent: str, rate: float) -> None:
    faults = (FaultSpec("FL", Side.SENSOR, FaultMode.NO_SIGNAL, 1.0, 1.5),)
    mission = simulate_mission(
        SimulationOptions(duration_s=3.0, rate_hz=rate, faults=faults, silent=silent)  # type: ignore[arg-type]
    )
    path = tmp_path / "m.csv"
    write_mission(mission, path, "twincat")
    octets = path.read_bytes()
    assert octets.count(b"\n") == octets.count(b"\r\n")
    lines = octets.decode().split("\r\n")
    assert lines[-2:] == ["EOF", ""]
    assert lines[2].split("\t")[1] == str(mission.stamps[0] // 100 + 116_444_736_000_000_000)
    assert lines[4:6] == ["", ""]
    keys = [line.split("\t")[0] for line in lines[6:23]]
    assert keys[0] == "Name"
    assert keys[-1] == "Unit Offset"
    assert len(keys) == 17
    assert lines[23] == ""
    head = {line.split("\t")[0]: line.split("\t") for line in lines[6:23]}
    data = [[c.replace(",", ".") for c in line.split("\t")] for line in lines[24:-2]]
    assert len({len(row) for row in data}) == 3  # rows get shorter where a slow group ends
    width = max(len(row) for row in data)
    cells = np.array([[float(c or "nan") for c in row] + [np.nan] * (width - len(row)) for row in data])
    groups = dict.fromkeys(mission.columns, mission.stamps)
    signals = dict(mission.columns)
    for group in mission.slow:
        groups |= dict.fromkeys(group.columns, group.stamps)
        signals |= group.columns
    for name, values in signals.items():
        symbol, unit = plc_symbol(name, WHEELS)
        column = head["SymbolName"].index(symbol)
        assert head["Unit"][column] == unit
        time = max(i for i in range(column) if head["SymbolName"][i] == "SymbolName")
        stamps = mission.stamps[0] + np.rint(cells[:, time] * 1e6)
        assert_array_equal(stamps[: values.size], groups[name])
        factor = {"rpm": np.pi * 0.854 / 17.7 / 60, "%": 0.01}.get(unit, 1.0)
        assert_allclose(cells[: values.size, column] * factor, values, rtol=1e-9, atol=1e-12)
    speeds = head["SymbolName"].index("MAIN.fbWheel[1].fVelocity")
    assert_array_equal(cells[:, speeds] % (2500 / 4096), 0)  # the recorded steps of the sensor, exactly


def test_wrong_formats_and_places_are_named(mission: SimulatedMission, tmp_path: Path) -> None:
    assert set(FORMATS) == {"mcap", "ros1", "rosbag2", "twincat", "csv", "parquet"}
    with pytest.raises(ConfigError, match="mcap, ros1"):
        write_mission(mission, tmp_path / "x", "xlsx")
    (tmp_path / "file").write_text("")
    for container in FORMATS:
        with pytest.raises(OutputError, match="give another"):
            write_mission(mission, tmp_path / "file" / "below", container)


@pytest.mark.parametrize("dialect", ["cdr", "ros1"])
def test_layouts_match_the_serialiser(dialect: str) -> None:
    store = get_typestore(Stores.ROS2_HUMBLE if dialect == "cdr" else Stores.ROS1_NOETIC)
    definition = "string a\nuint8 b\nfloat64[] c\nint16 d\nfloat64[] e\nfloat32 f\n"
    store.register(get_types_from_msg(definition, "x/msg/X"))
    layout = Layout(dialect)  # type: ignore[arg-type]
    layout.text("abc")
    layout.constant("B", 7)
    layout.doubles("c", 2)
    layout.constant("h", -3)
    layout.doubles(None)
    layout.varying("f", "f4")
    row = layout.template.copy().view(layout.dtype)
    row["c"], row["f"] = [1.5, -2.5], 0.25
    message = store.types["x/msg/X"]("abc", 7, np.array([1.5, -2.5]), -3, np.zeros(0), 0.25)
    expected = (store.serialize_cdr if dialect == "cdr" else store.serialize_ros1)(message, "x/msg/X")
    assert row.tobytes() == bytes(expected)


def test_same_options_same_bytes(tmp_path: Path) -> None:
    for name in ("a.mcap", "b.mcap"):
        write_mission(make(), tmp_path / name, "mcap")
    assert (tmp_path / "a.mcap").read_bytes() == (tmp_path / "b.mcap").read_bytes()
