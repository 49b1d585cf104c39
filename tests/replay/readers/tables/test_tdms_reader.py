from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from replay.errors import LogError
from replay.log.source_options import SourceOptions
from replay.readers.registry import open_log, read_log, summarise_log

START = np.datetime64("2022-06-15T10:00:00.000", "us")
START_NS = int(START.astype("M8[ns]").astype(np.int64))


@pytest.fixture
def target(tmp_path: Path) -> Path:
    nptdms = pytest.importorskip("nptdms", reason="npTDMS is an extra")
    wave = {"wf_start_time": START, "wf_increment": 0.001, "wf_start_offset": 0.0, "unit_string": "rpm"}
    path = tmp_path / "run.tdms"
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment(
            [
                nptdms.ChannelObject("Drive", "speed", np.array([1.5, 2.5, -3.5]), wave),
                nptdms.ChannelObject("Drive", "count", np.array([7, 8, 9], np.int16), wave),
                nptdms.ChannelObject("Slow", "Time", START + np.array([0, 500_000]).astype("m8[us]")),
                nptdms.ChannelObject("Slow", "pressure", np.array([100.0, 101.0], np.float32)),
                nptdms.ChannelObject("Slow", "lonely", np.array([1.0, 2.0, 3.0])),
                nptdms.ChannelObject("Slow", "text", np.array(["a", "b"])),
            ]
        )
    return path


def test_waveforms_and_time_channels(target: Path) -> None:
    log = read_log(target, SourceOptions())
    assert open_log(target).format == "tdms"
    assert [*log.channels] == ["Drive/speed", "Drive/count", "Slow/pressure"]
    speed, count, pressure = log.channels.values()
    assert speed.values.tolist() == [1.5, 2.5, -3.5]
    assert (speed.stamps - START_NS).tolist() == [0, 1_000_000, 2_000_000]
    assert (speed.unit, str(count.values.dtype), str(pressure.values.dtype)) == ("rpm", "int16", "float32")
    assert count.stamps is speed.stamps
    assert (pressure.stamps - START_NS).tolist() == [0, 500_000_000]
    assert any("1 channels have no time" in d and "Slow/lonely" in d for d in log.summary.damage)
    index = summarise_log(target, SourceOptions())
    assert (index.topics, index.start_ns, index.stop_ns) == (
        log.summary.topics,
        log.summary.start_ns,
        log.summary.stop_ns,
    )


def test_a_window(target: Path) -> None:
    log = read_log(target, SourceOptions(), window=(START_NS + 1_000_000, START_NS + 2_000_000))
    assert log.channels["Drive/speed"].values.tolist() == [2.5]
    assert len(log.channels["Slow/pressure"].values) == 0


def test_a_given_time_channel(tmp_path: Path) -> None:
    nptdms = pytest.importorskip("nptdms", reason="npTDMS is an extra")
    with nptdms.TdmsWriter(tmp_path / "a.tdms") as writer:
        objects = [nptdms.ChannelObject("G", n, np.array([1.0, 2.0, 4.0])) for n in ("x", "ms")]
        writer.write_segment(objects)
    log = read_log(tmp_path / "a.tdms", SourceOptions(time="ms", time_unit="ms"))
    assert log.channels["G/x"].stamps.tolist() == [1_000_000, 2_000_000, 4_000_000]
    with pytest.raises(LogError, match="none of its channels has a time"):
        read_log(tmp_path / "a.tdms", SourceOptions())


def test_without_the_extra_the_message_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.tdms"
    path.write_bytes(b"TDSm" + bytes(100))
    monkeypatch.setitem(sys.modules, "nptdms", None)
    with pytest.raises(LogError, match=r"pip install 'mfhca-replay\[tdms\]'"):
        read_log(path, SourceOptions())


def test_a_file_that_was_cut_off_or_damaged(target: Path) -> None:
    raw = target.read_bytes()
    target.write_bytes(b"TDSm" + bytes(range(200)))
    with pytest.raises(LogError, match=r"run\.tdms"):
        read_log(target, SourceOptions())
    target.write_bytes(raw + raw[:-30])
    log = read_log(target, SourceOptions())
    assert len(log.channels["Drive/speed"].values) >= 3
    assert any("is cut off or damaged; npTDMS reports" in d for d in log.summary.damage)
    target.write_bytes(raw[:-30])
    with pytest.raises(LogError, match="holds no whole samples"):
        read_log(target, SourceOptions())
    target.write_bytes(raw[:60])
    with pytest.raises(LogError, match=r"run\.tdms"):
        read_log(target, SourceOptions())


def test_channels_that_a_cut_file_lost_are_named(tmp_path: Path) -> None:
    nptdms = pytest.importorskip("nptdms", reason="npTDMS is an extra")
    wave = {"wf_start_time": START, "wf_increment": 0.001, "wf_start_offset": 0.0}
    path = tmp_path / "run.tdms"
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment([nptdms.ChannelObject("g", name, np.arange(1000.0), wave) for name in "abc"])
    path.write_bytes(path.read_bytes()[: -8000 - 3200])
    damage = read_log(path, SourceOptions()).summary.damage
    assert any("1 channels are lost: c" in d for d in damage)
    assert any("shorter than others of the group: b (600 of 1000 samples)" in d for d in damage)
