"""The replayed loop as a table and as MCAP, read back by other readers."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pyarrow.csv
import pyarrow.parquet as pq
import pytest
from mcap.reader import make_reader
from rosbags.typesys import Stores, get_typestore

from replay.control.loop import Replay, replay_loop
from replay.control.loop_columns import replay_columns
from replay.errors import ConfigError, OutputError
from replay.export.replay_log import format_of, write_replay
from replay.machine.config import Machine, haulotte
from replay.signals.timeline import Timeline

START = 1_760_000_000_000_000_000
N = 300


def example(start_ns: int = START, command: bool = True) -> tuple[Timeline, Replay, Machine]:
    """Three seconds of driving with a gap in FR's speed."""
    t = np.arange(N) * 0.01
    signals = {"cmd.v": 0.2 + 0.05 * np.sin(t), "cmd.omega": np.zeros(N), "steer.front.phi": 0.1 * np.sin(t)}
    for i, wheel in enumerate(haulotte().wheels):
        signals[f"wheel.{wheel}.v"] = signals["cmd.v"] - 0.01 * (i + 1)
        if command:
            signals[f"wheel.{wheel}.u"] = 0.1 + 0.01 * np.cos(3 * t + i)
    signals["wheel.FR.v"][100:110] = np.nan
    timeline = Timeline(
        start_ns,
        10_000_000,
        N,
        signals,
        {k: np.isfinite(v) for k, v in signals.items()},
        dict.fromkeys(signals, "log"),
        dict.fromkeys(signals, 10_000_000),
    )
    return timeline, replay_loop(timeline, haulotte()), haulotte()


def test_columns_follow_their_names() -> None:
    timeline, replay, machine = example()
    columns = replay_columns(timeline, replay, machine)
    assert list(columns)[:3] == ["t", "cmd.v", "cmd.omega"]
    np.testing.assert_array_equal(columns["replay.FL.e"], replay.e[:, 1])
    np.testing.assert_array_equal(columns["replay.front.u"], replay.steer_u[:, 0])
    assert "replay.FR.psi_forcing" not in columns
    assert "replay.FR.psi_forcing" in replay_columns(timeline, replay, machine, detail=True)


def test_what_is_nowhere_defined_has_no_column() -> None:
    columns = replay_columns(*example(command=False))
    assert "replay.FR.psi_printed" in columns
    assert not {"replay.FR.psi_implied", "replay.FR.u_difference", "replay.rear.u"} & set(columns)


def test_parquet_holds_stamps_columns_and_readings(tmp_path: Path) -> None:
    timeline, replay, machine = example()
    written = write_replay(tmp_path / "loop.parquet", timeline, replay, machine, "parquet")
    table = pq.read_table(tmp_path / "loop.parquet")
    assert tuple(table.column_names) == written
    np.testing.assert_array_equal(table["stamp_ns"].to_numpy(), START + np.arange(N) * 10_000_000)
    np.testing.assert_array_equal(table["replay.FR.rho"].to_numpy(), replay.rho[:, 0])
    assert np.isnan(table["replay.FR.e"].to_numpy()[100:110]).all()
    readings = json.loads(table.schema.metadata[b"mfhca.readings"])
    assert [r[0] for r in readings] == [r.name for r in replay.readings]


def test_csv_keeps_every_digit(tmp_path: Path) -> None:
    timeline, replay, machine = example()
    write_replay(tmp_path / "loop.csv", timeline, replay, machine, "csv")
    table = pyarrow.csv.read_csv(tmp_path / "loop.csv")
    np.testing.assert_array_equal(table["replay.RL.psi_implied"].to_numpy(), replay.psi_implied[:, 3])
    assert table["stamp_ns"][1].as_py() == START + 10_000_000


def test_mcap_holds_a_joint_state_topic_per_quantity_at_the_steps_of_the_log(tmp_path: Path) -> None:
    timeline, replay, machine = example()
    path = tmp_path / "loop.mcap"
    written = write_replay(path, timeline, replay, machine, "mcap")
    store = get_typestore(Stores.ROS2_HUMBLE)
    rows: dict[str, list[np.ndarray]] = {}
    stamps: list[int] = []
    with path.open("rb") as file:
        for schema, channel, message in make_reader(file, validate_crcs=True).iter_messages():
            assert schema is not None
            decoded = store.deserialize_cdr(message.data, "sensor_msgs/msg/JointState")
            assert schema.name == "sensor_msgs/msg/JointState"
            assert message.log_time == decoded.header.stamp.sec * 10**9 + decoded.header.stamp.nanosec
            assert decoded.name == list(machine.axles if "steer" in channel.topic else machine.wheels)
            rows.setdefault(channel.topic, []).append(decoded.position)
            if channel.topic == "/mfhca/e":
                stamps.append(message.log_time)
    assert tuple(rows) == written or set(rows) == set(written)
    np.testing.assert_array_equal(np.stack(rows["/mfhca/e"]), replay.e)
    np.testing.assert_array_equal(np.stack(rows["/mfhca/psi_hat_implied"]), replay.psi_implied)
    np.testing.assert_array_equal(np.stack(rows["/mfhca/u_replayed"]), replay.u)
    np.testing.assert_array_equal(np.stack(rows["/mfhca/steer_u_replayed"]), replay.steer_u)
    np.testing.assert_array_equal(stamps, START + np.arange(N) * 10_000_000)


def test_stamps_that_ros_cannot_hold(tmp_path: Path) -> None:
    timeline, replay, machine = example(start_ns=-1_000_000_000)
    with pytest.raises(OutputError, match="write Parquet or CSV"):
        write_replay(tmp_path / "loop.mcap", timeline, replay, machine, "mcap")
    write_replay(tmp_path / "loop.csv", timeline, replay, machine, "csv")


def test_formats_by_name() -> None:
    assert [format_of(Path(n)) for n in ("a.parquet", "b.CSV", "c.x.mcap")] == ["parquet", "csv", "mcap"]
    with pytest.raises(ConfigError, match=r"expected \.parquet"):
        format_of(Path("a.xlsx"))


def test_an_unknown_format(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="'xls' is not known"):
        write_replay(tmp_path / "a.xls", *example(), "xls")
