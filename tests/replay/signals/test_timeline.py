"""One axis for all signals: lost samples stay lost, each sample counts once."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal

from replay.errors import LogError
from replay.log.source_options import SignalSource
from replay.signals.signal import Signal, Signals
from replay.signals.timeline import Timeline, align, median_period

START = 1_760_000_000_000_000_000
MS = 1_000_000


def signal(name: str, stamps: np.ndarray, values: np.ndarray | None = None, source: str = "a.mcap") -> Signal:
    numbers = np.arange(stamps.size, dtype=np.float64) if values is None else values
    return Signal(name, stamps.astype(np.int64), numbers, SignalSource(column=name), source, guessed=False)


def every(period_ms: float, count: int, first_ms: float = 0.0) -> np.ndarray:
    return START + np.rint((first_ms + period_ms * np.arange(count)) * MS).astype(np.int64)


def signals(*items: Signal) -> Signals:
    return Signals({s.name: s for s in items}, {})


def test_even_samples_are_taken_as_they_are() -> None:
    values = np.sin(np.arange(50))
    got = align(signals(signal("wheel.FR.v", every(1, 50), values)))
    assert (got.start_ns, got.step_ns, got.size, got.dt) == (START, MS, 50, 0.001)
    assert_array_equal(got.signals["wheel.FR.v"], values)
    assert got.fresh["wheel.FR.v"].all()
    assert_array_equal(got.t, np.arange(50) * 0.001)
    assert got.sources == {"wheel.FR.v": "a.mcap"}
    assert got.periods_ns == {"wheel.FR.v": MS}
    assert got.get("wheel.FL.v") is None


@given(jitter=st.lists(st.floats(-0.45, 0.45), min_size=20, max_size=20))
def test_jitter_below_half_a_step_moves_no_sample(jitter: list[float]) -> None:
    stamps = every(10, 41)
    stamps[1::2] += np.rint(np.array(jitter) * 10 * MS).astype(np.int64)  # every other sample is early or late
    got = align(signals(signal("wheel.FR.v", stamps)))
    assert_array_equal(got.signals["wheel.FR.v"], np.arange(41.0))
    assert got.fresh["wheel.FR.v"].all()


@pytest.mark.parametrize("period_ns", [1_000_312, 991_000, 4_001_000, 20_300_000])
def test_measured_period_becomes_the_usual_one(period_ns: int) -> None:
    stamps = START + period_ns * np.arange(100, dtype=np.int64)
    assert align(signals(signal("wheel.FR.v", stamps))).step_ns == round(period_ns / MS) * MS


def test_unusual_period_is_kept_to_the_microsecond() -> None:
    stamps = START + 3_333_333 * np.arange(100, dtype=np.int64)
    assert align(signals(signal("wheel.FR.v", stamps))).step_ns == 3_333_000


def test_dropped_samples_become_nan() -> None:
    kept = np.r_[0:100, 130:200]
    got = align(signals(signal("wheel.FR.v", every(1, 200)[kept], kept.astype(float))))
    v, fresh = got.signals["wheel.FR.v"], got.fresh["wheel.FR.v"]
    # the sample before the gap holds for 2.5 periods and no longer
    assert_array_equal(v[98:103], [98, 99, 99, 99, np.nan])
    assert np.isnan(v[102:130]).all()
    assert_array_equal(v[130:], np.arange(130, 200))
    assert_array_equal(np.flatnonzero(~fresh), np.arange(100, 130))


def test_recorded_nan_is_no_sample_and_is_not_held_over() -> None:
    values = np.arange(20.0)
    values[5:8] = np.nan
    got = align(signals(signal("wheel.FR.v", every(1, 20), values)))
    assert_array_equal(got.signals["wheel.FR.v"], values)
    assert_array_equal(np.flatnonzero(~got.fresh["wheel.FR.v"]), [5, 6, 7])


def test_before_the_first_and_after_the_last_sample_nothing_is_known() -> None:
    got = align(signals(signal("wheel.FR.v", every(1, 100)), signal("wheel.FL.v", every(1, 40, first_ms=30))))
    v = got.signals["wheel.FL.v"]
    assert np.isnan(v[:30]).all()
    assert_array_equal(v[30:70], np.arange(40))
    assert np.isnan(v[72:]).all()
    assert got.fresh["wheel.FL.v"].sum() == 40


def test_uneven_rates_count_each_sample_once() -> None:
    got = align(
        signals(
            signal("wheel.FR.v", every(2, 500)),
            signal("wheel.FR.u", every(5, 200)),
            signal("imu.yaw_rate", every(10, 100)),
        )
    )
    assert got.step_ns == 2 * MS
    assert np.isfinite(got.signals["wheel.FR.u"]).all()
    assert got.fresh["wheel.FR.u"].sum() == 200
    assert got.fresh["imu.yaw_rate"].sum() == 100
    assert_array_equal(got.signals["imu.yaw_rate"], np.arange(500) // 5)
    assert_array_equal(got.signals["imu.yaw_rate"][got.fresh["imu.yaw_rate"]], np.arange(100))


def test_fast_other_signals_do_not_set_the_step() -> None:
    got = align(signals(signal("wheel.FR.v", every(10, 100)), signal("imu.yaw_rate", every(1, 1000))))
    assert (got.step_ns, got.size) == (10 * MS, 100)
    assert_array_equal(got.signals["imu.yaw_rate"][1:-1], 10 * np.arange(1, 99) + 5)


@pytest.mark.parametrize("name", ["cmd.v", "wheel.FR.v_ref", "steer.front.phi_ref"])
def test_slow_command_is_held_for_half_a_second(name: str) -> None:
    wheel = signal("wheel.FR.v", every(1, 3000))
    command = signal(name, every(100, 11))
    held = np.isfinite(align(signals(wheel, command)).signals[name])
    # the last command came after 1 s
    assert held[:1501].all()
    assert not held[1501:].any()


def test_command_sent_once_a_second_is_held_from_one_to_the_next() -> None:
    got = align(signals(signal("wheel.FR.v", every(1, 3000)), signal("cmd.v", every(1000, 3))))
    assert_array_equal(got.signals["cmd.v"], np.arange(3000) // 1000)
    assert got.fresh["cmd.v"].sum() == 3


def test_measurement_is_not_held_like_a_command() -> None:
    got = align(signals(signal("wheel.FR.v", every(1, 3000)), signal("wheel.FR.u", every(100, 11))))
    held = np.isfinite(got.signals["wheel.FR.u"])
    assert held[:1251].all()
    assert not held[1251:].any()


def test_part_of_a_mission() -> None:
    items = signals(signal("wheel.FR.v", every(10, 1000)))
    got = align(items, 2.0, 3.0)
    assert got.start_ns == START + 2_000 * MS
    assert_array_equal(got.signals["wheel.FR.v"], np.arange(200, 301))
    assert_array_equal(align(items, stop_s=0.05).signals["wheel.FR.v"], np.arange(6))
    assert_array_equal(align(items, start_s=9.95).signals["wheel.FR.v"], np.arange(995, 1000))
    assert align(items, 0.0, 99.0).size == 1000


@pytest.mark.parametrize(("start", "stop"), [(11.0, None), (5.0, 4.0), (5.0, 5.0), (None, -1.0)])
def test_empty_part_is_refused(start: float | None, stop: float | None) -> None:
    with pytest.raises(LogError, match=r"asked part of the mission is empty: the log lasts 9\.990 s"):
        align(signals(signal("wheel.FR.v", every(10, 1000))), start, stop)


def test_no_wheel_is_refused() -> None:
    with pytest.raises(LogError, match="no wheel signal with at least two samples"):
        align(signals(signal("cmd.v", every(1, 50)), signal("wheel.FR.v", every(1, 1))))
    with pytest.raises(LogError, match="mfhca channels"):
        align(signals())


def test_sources_that_do_not_overlap_are_refused() -> None:
    later = signal("wheel.FR.u", every(1, 100, first_ms=500), source="plc.csv")
    with pytest.raises(LogError, match="do not overlap in time") as caught:
        align(signals(signal("wheel.FR.v", every(1, 100)), later))
    for word in ("a.mcap: 2025-10-09T08:53:20.000000000", "plc.csv: 2025-10-09T08:53:20.5", "epoch"):
        assert word in str(caught.value)


def test_sources_that_barely_overlap_are_noted() -> None:
    late = signal("wheel.FR.u", every(1, 1000, first_ms=900), source="plc.csv")
    got = align(signals(signal("wheel.FR.v", every(1, 1000)), late))
    assert "overlap for 0.1 s only, of 1.0 s" in got.notes[0]
    most = signal("wheel.FR.u", every(1, 1000, first_ms=300), source="plc.csv")
    assert align(signals(signal("wheel.FR.v", every(1, 1000)), most)).notes == ()


def test_clock_jump_is_refused() -> None:
    stamps = every(1, 100)
    stamps[50:] += 5_000_000 * 1_000_000_000
    with pytest.raises(LogError, match=r'stamps span 5000000 s in steps of 1 ms.*stamp = "log"'):
        align(signals(signal("wheel.FR.v", stamps)))
    # a part on one side of the jump can be had
    assert align(signals(signal("wheel.FR.v", stamps)), stop_s=0.04).size == 41


def test_signal_without_samples_is_absent() -> None:
    got = align(signals(signal("wheel.FR.v", every(1, 50)), signal("wheel.FL.v", every(1, 0))))
    assert "wheel.FL.v" not in got.signals


@given(shift=st.integers(-(10**18), 10**18), drop=st.sets(st.integers(1, 58), max_size=30))
def test_shifting_the_clock_shifts_the_start_alone(shift: int, drop: set[int]) -> None:
    kept = np.array([k for k in range(60) if k not in drop])
    here = align(signals(signal("wheel.FR.v", every(5, 60)[kept]), signal("wheel.FL.v", every(5, 60))))
    there = align(signals(signal("wheel.FR.v", every(5, 60)[kept] + shift), signal("wheel.FL.v", every(5, 60) + shift)))
    assert there.start_ns == here.start_ns + shift
    for name in here.signals:
        assert_array_equal(there.signals[name], here.signals[name])
        assert_array_equal(there.fresh[name], here.fresh[name])


def test_median_period() -> None:
    assert median_period(np.array([0, 10, 20, 50, 60])) == 10
    assert median_period(np.array([5])) == 0
    bunches = np.repeat(np.arange(100) * 40_000_000, 8) + np.arange(800) % 8 * 5_000
    assert 2_000_000 < median_period(bunches) <= 5_000_000


def test_a_changed_timeline_keeps_no_columns_of_the_former_one() -> None:
    line = Timeline(0, 10, 3, {"a": np.arange(3.0)}, {}, {}, {})
    assert_array_equal(line.beside(["a"])[:, 0], [0, 1, 2])
    assert line.beside(["a"]) is line.beside(["a"])
    changed = replace(line, signals={"a": np.full(3, 7.0)})
    assert_array_equal(changed.beside(["a"])[:, 0], [7, 7, 7])


def test_names_that_no_log_holds_are_said_where_no_wheel_is_found() -> None:
    missing = {"wheel.FR.v": "the machine file names 'velocity[fr]', which no source holds; similar: velocity[f_r]"}
    with pytest.raises(
        LogError, match=r"wheel\.FR\.v: the machine file names 'velocity\[fr\]'.*similar.*correct its \[signals\]"
    ):
        align(Signals({}, missing))


def test_signals_of_the_same_stamps_have_their_period_found_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each topic of a recording brings stamps of its own, though one computer sampled them all."""
    found: list[np.ndarray] = []

    def counted(stamps: np.ndarray) -> int:
        found.append(stamps)
        return median_period(stamps)

    monkeypatch.setattr("replay.signals.timeline.median_period", counted)
    names = ("wheel.FR.v", "wheel.FL.v", "wheel.FR.u")
    got = align(signals(*(signal(name, every(1, 50)) for name in names), signal("cmd.v", every(2, 25))))
    assert [s.size for s in found] == [50, 25]
    assert got.periods_ns == {**dict.fromkeys(names, MS), "cmd.v": 2 * MS}
