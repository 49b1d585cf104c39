"""Logs as tables: every topic on its own clock, texts as text, losses said."""

from __future__ import annotations

from pathlib import Path

import pytest
from numpy.testing import assert_array_equal

import mfhca
from replay.log.source_options import SourceOptions
from replay.readers.registry import read_log

ROOT = Path(__file__).parents[3]
SPOOL = ROOT / "sample_logs" / "spool.mcap"


@pytest.fixture(scope="module")
def log() -> mfhca.Log:
    return mfhca.read_log(str(SPOOL))


def test_every_number_at_its_own_stamp(log: mfhca.Log) -> None:
    for name, channel in read_log(SPOOL, SourceOptions()).channels.items():
        frame = log[channel.topic]
        assert_array_equal(frame[channel.field].dropna(), channel.values[~(channel.values != channel.values)])
        assert frame[channel.field].dtype == channel.values.dtype or len(frame) != len(channel.stamps), name
        if len(frame) == len(channel.stamps):
            assert_array_equal(frame.index.astype("int64"), channel.stamps)
    assert set(log["/joint_states"]["header.frame_id"]) == {"base_link"}
    assert log["/joint_states"].attrs["type"] == "sensor_msgs/msg/JointState"


def test_a_log_is_a_mapping_that_describes_itself(log: mfhca.Log) -> None:
    assert list(log) == list(log.topics.index)
    assert len(log) == len(list(log))
    assert log.format == "mcap"
    assert not log.damage
    assert log.channels.loc["/cmd_vel.twist.linear.x", "topic"] == "/cmd_vel"
    assert "whole" in repr(log)
    assert "/joint_states" in log._repr_html_()


def test_a_part_of_a_log(log: mfhca.Log) -> None:
    part = mfhca.read_log(SPOOL, topics=["/cmd_vel"], start_s=1.0, stop_s=2.0, clock="log")
    assert list(part) == ["/cmd_vel"]
    assert 0 < len(part["/cmd_vel"]) < len(log["/cmd_vel"])
    seconds = (part["/cmd_vel"].index - log["/cmd_vel"].index[0]).total_seconds()
    assert (seconds.min() > 0.9, seconds.max() < 2.1) == (True, True)


def test_damage_is_said(tmp_path: Path) -> None:
    path = tmp_path / "cut.mcap"
    path.write_bytes(SPOOL.read_bytes()[: SPOOL.stat().st_size // 2])
    log = mfhca.read_log(path)
    assert log.damage
    assert "degraded" in repr(log)
    assert "Degraded" in log._repr_html_()


def test_what_cannot_be_read_is_said(tmp_path: Path) -> None:
    with pytest.raises(mfhca.LogError, match="does not exist"):
        mfhca.read_log(tmp_path / "no.mcap")
    with pytest.raises(mfhca.ConfigError, match="holds no topic '/nothing'; it has /"):
        mfhca.read_log(SPOOL, topics="/nothing")
    with pytest.raises(mfhca.ConfigError, match="clock = 'sun' is not known"):
        mfhca.read_log(SPOOL, clock="sun")  # type: ignore[arg-type]
    with pytest.raises(mfhca.ConfigError, match="start_s nan"):
        mfhca.read_log(SPOOL, start_s=float("nan"))
