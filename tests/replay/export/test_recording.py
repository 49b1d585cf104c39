"""Signals written in every format come back with their stamps, values and the open-loop mark."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from replay.errors import ConfigError, OutputError
from replay.export.recording import RECORDING_FORMATS, write_recording
from replay.log.source_options import SignalSource, SourceOptions
from replay.machine.config import Machine, haulotte
from replay.mission import load_mission, read_signals
from replay.signals.signal import Signal, Signals

ENDINGS = {"mcap": ".mcap", "bag": ".bag", "rosbag2": "", "twincat": ".txt", "csv": ".csv", "parquet": ".parquet"}
START = 1_700_000_000_123_456_789
FAST = START + np.arange(400, dtype=np.int64) * 10_000_000
SLOW = FAST[::10].copy()


def signal(name: str, stamps: np.ndarray, seed: int) -> Signal:
    values = 0.3 * np.random.default_rng(seed).standard_normal(stamps.size)
    return Signal(name, stamps, values, SignalSource(column="x"), "drive", False)


def recorded() -> Signals:
    """Two speeds and a valve at 100 Hz, the yaw rate at 10 Hz; the second speed holds NaN for 0.5 s."""
    items = {n: signal(n, FAST, i) for i, n in enumerate(("wheel.FR.v", "wheel.FL.v", "wheel.FR.u"))}
    items["imu.yaw_rate"] = signal("imu.yaw_rate", SLOW, 9)
    items["wheel.FL.v"].values[100:150] = np.nan
    return Signals(items, {}, open_loop=True)


def assert_same(found: Signals, expected: Signals) -> None:
    assert set(found.items) == set(expected.items)
    for name, item in expected.items.items():
        assert np.array_equal(found.items[name].stamps, item.stamps), name
        assert np.allclose(found.items[name].values, item.values, rtol=0, atol=1e-12, equal_nan=True), name


@pytest.mark.parametrize("kind", RECORDING_FORMATS)
def test_every_format_gives_the_same_signals_back(kind: str, tmp_path: Path) -> None:
    path = tmp_path / f"out{ENDINGS[kind]}"
    write_recording(recorded(), path, kind)
    files, found = read_signals([path], haulotte())
    assert files[0].format == kind
    assert files[0].summary.damage == ()
    assert found.open_loop
    assert_same(found, recorded())
    assert load_mission([path], haulotte()).open_loop
    write_recording(replace(recorded(), open_loop=False), path, kind)
    assert not read_signals([path], haulotte())[1].open_loop


@pytest.mark.parametrize("kind", RECORDING_FORMATS)
def test_the_originals_machine_file_still_fits(kind: str, tmp_path: Path) -> None:
    machine: Machine = replace(
        haulotte(),
        signals={
            "wheel.FR.v": SignalSource(column="speed 1", unit="rpm"),
            "wheel.RR.v": SignalSource(column="speed 3"),
        },
        sources={"*": SourceOptions(time="clock", time_unit="ms", epoch="2024-01-01", separator=";", decimal=",")},
    )
    path = tmp_path / f"out{ENDINGS[kind]}"
    write_recording(recorded(), path, kind)
    found = read_signals([path], machine)[1]
    assert_same(found, recorded())
    assert "speed 3" in found.missing["wheel.RR.v"]


def test_a_sensor_that_dropped_samples_leaves_blank_cells_in_a_table(tmp_path: Path) -> None:
    items = dict(recorded().items)
    kept = np.r_[0:100, 200:400]
    items["wheel.FR.v"] = replace(items["wheel.FR.v"], stamps=FAST[kept], values=items["wheel.FR.v"].values[kept])
    write_recording(Signals(items, {}), tmp_path / "out.csv", "csv")
    values = read_signals([tmp_path / "out.csv"], haulotte())[1].items["wheel.FR.v"].values
    assert np.array_equal(np.flatnonzero(np.isnan(values)), np.arange(100, 200))


def test_a_table_refuses_signals_with_clocks_of_their_own(tmp_path: Path) -> None:
    items = dict(recorded().items)
    items["wheel.RR.v"] = signal("wheel.RR.v", START + np.arange(120, dtype=np.int64) * 33_000_001, 4)
    with pytest.raises(ConfigError, match=r"is recorded at other times.*--format mcap or twincat"):
        write_recording(Signals(items, {}), tmp_path / "out.csv", "csv")
    write_recording(Signals(items, {}), tmp_path / "out.mcap", "mcap")
    assert_same(read_signals([tmp_path / "out.mcap"], haulotte())[1], Signals(items, {}))


def test_what_cannot_be_written_is_refused(tmp_path: Path) -> None:
    early = Signals({"wheel.FR.v": signal("wheel.FR.v", FAST - 2 * START, 1)}, {})
    with pytest.raises(OutputError, match="ROS stamps hold 1970 to 2106"):
        write_recording(early, tmp_path / "out.mcap", "mcap")
    with pytest.raises(ConfigError, match="no signal to write"):
        write_recording(Signals({}, {}), tmp_path / "out.mcap", "mcap")
    with pytest.raises(ConfigError, match="is not known; expected one of"):
        write_recording(recorded(), tmp_path / "out.xml", "xml")
