"""Channels as pandas tables."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.testing import assert_array_equal

from replay.frames import log_frames, timeline_frame
from replay.log.raw_log import Channel, LogSummary, RawLog
from replay.signals.timeline import Timeline

STAMPS = np.array([0, 1, 2], np.int64) * 500_000_000


def log(*channels: Channel) -> RawLog:
    return RawLog("a.mcap", "mcap", "header", {c.name: c for c in channels}, LogSummary("a.mcap", "mcap", 0, 0, ()))


def test_topics_are_tables_in_time() -> None:
    found = log_frames(
        log(
            Channel("/w.v", "/w", "v", STAMPS, np.array([1, 2, 3], np.int16), "m/s"),
            Channel("/w.u", "/w", "u", STAMPS[1:], np.array([0.5, np.nan])),
            Channel("/x.a", "/x", "a", STAMPS[:1], np.array([7.0])),
        )
    )
    assert list(found) == ["/w", "/x"]
    assert_array_equal(found["/w"]["v"], [1, 2, 3])
    assert found["/w"]["v"].dtype == np.int16
    assert_array_equal(found["/w"]["u"], [np.nan, 0.5, np.nan])
    assert found["/w"].attrs["units"] == {"v": "m/s"}
    assert found["/w"].index[1] == pd.Timestamp("1970-01-01 00:00:00.5", tz="UTC")


def test_no_sample_is_lost_where_messages_hold_different_fields() -> None:
    """One message has ``a``, the next ``b``; two have the same stamp."""
    a, b = np.array([0, 2, 2, 6], np.int64), np.array([1, 2, 7], np.int64)
    words = np.array(["x", "y", "z"], object)
    frame = log_frames(log(Channel("/w.a", "/w", "a", a, np.arange(4)), Channel("/w.b", "/w", "b", b, words)))["/w"]
    assert frame.index.astype("int64").tolist() == [0, 1, 2, 2, 6, 7]
    assert_array_equal(frame["a"], [0, np.nan, 1, 2, 3, np.nan])
    assert frame["b"].fillna("").tolist() == ["", "x", "y", "", "", "z"]


def test_tables_are_told_apart_by_their_stamps() -> None:
    fast, slow = STAMPS, STAMPS[:2]
    found = log_frames(log(Channel("a", "", "a", fast, np.arange(3.0)), Channel("b", "", "b", slow, np.arange(2.0))))
    assert {name: list(frame) for name, frame in found.items()} == {"group 1": ["a"], "group 2": ["b"]}


def test_signals_on_one_axis() -> None:
    line = Timeline(1_000, 2_000, 3, {"wheel.FR.v": np.array([0.0, np.nan, 2.0])}, {}, {}, {})
    frame = timeline_frame(line)
    assert list(frame) == ["wheel.FR.v"]
    assert_array_equal(frame.index.asi8, [1_000, 3_000, 5_000])
    assert_array_equal(frame["wheel.FR.v"], [0.0, np.nan, 2.0])
