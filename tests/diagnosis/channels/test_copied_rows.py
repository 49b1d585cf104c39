"""Rows that repeat as a whole are no data; a channel that repeats itself alone may be stuck."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from diagnosis.channels.copied_rows import without_copied_rows
from replay.signals.timeline import Timeline

MS = 1_000_000
N = 3000
HOLD = slice(1000, 1250)


def timeline(*held: str, hold: slice = HOLD) -> Timeline:
    """Thirty seconds at 100 Hz of a drive's speed, effort and command, some of them held for 2.5 s."""
    rng = np.random.default_rng(1)
    signals = {
        "wheel.M.v": 2.0 + 0.1 * rng.normal(size=N),
        "wheel.M.u": 5.0 + rng.normal(size=N),
        "wheel.M.v_ref": np.repeat([2.0, 2.2, 1.9], N // 3),
    }
    for name in held:
        signals[name][hold] = signals[name][hold.start]
    names = list(signals)
    fresh = {n: np.ones(N, np.bool_) for n in names}
    groups = {n: f"log.csv t wheel.{n.rsplit('.', 1)[-1]}" for n in names}
    return Timeline(
        0, 10 * MS, N, signals, fresh, dict.fromkeys(names, "log.csv"), dict.fromkeys(names, 10 * MS), groups=groups
    )


def test_rows_repeated_as_a_whole_are_no_data() -> None:
    found = without_copied_rows(timeline("wheel.M.v", "wheel.M.u"))
    inside = slice(HOLD.start + 2, HOLD.stop)
    for name in found.signals:
        assert np.isnan(found.signals[name][inside]).all()
        assert not found.fresh[name][inside].any()
        assert np.isfinite(found.signals[name][: HOLD.start]).all()
        assert np.isfinite(found.signals[name][HOLD.stop :]).all()
    assert "repeated the same values" in found.notes[0]
    assert "10.0–12.5 s" in found.notes[0]


def test_an_inertial_unit_whose_readings_go_on_does_not_hide_copied_rows() -> None:
    """It is another device: a table has its newest reading in each row, whatever the drives' logger does."""
    given = timeline("wheel.M.v", "wheel.M.u")
    more = np.random.default_rng(2).normal(size=N)
    name = "imu.acceleration"
    beside = replace(
        given,
        signals={**given.signals, name: more},
        fresh={**given.fresh, name: np.ones(N, np.bool_)},
        sources={**given.sources, name: "log.csv"},
        periods_ns={**given.periods_ns, name: 10 * MS},
        groups={**given.groups, name: "log.csv t imu.acceleration"},
    )
    assert np.isnan(without_copied_rows(beside).signals["wheel.M.v"][HOLD.start + 2 : HOLD.stop]).all()


def test_a_single_time_is_no_habit_however_short_the_log_is() -> None:
    long = slice(1000, 2200)
    found = without_copied_rows(timeline("wheel.M.v", "wheel.M.u", hold=long))
    assert np.isnan(found.signals["wheel.M.v"][long.start + 2 : long.stop - 200]).all()
    most = timeline("wheel.M.v", "wheel.M.u", hold=slice(1000, 2700))
    assert without_copied_rows(most) is most


def test_a_speed_that_repeats_itself_alone_stays() -> None:
    given = timeline("wheel.M.v")
    assert without_copied_rows(given) is given


def test_an_effort_at_its_limit_says_nothing() -> None:
    given = timeline("wheel.M.v")
    given.signals["wheel.M.u"][HOLD] = 30.0
    assert without_copied_rows(given) is given


def test_a_channel_without_any_number_is_no_part_of_the_rows() -> None:
    given = timeline("wheel.M.v", "wheel.M.u")
    empty = replace(given, signals={**given.signals, "wheel.M.v_ref": np.full(N, np.nan)})
    assert np.isnan(without_copied_rows(empty).signals["wheel.M.v"][HOLD.start + 2 : HOLD.stop]).all()


def test_repeats_that_are_the_sources_habit_stay() -> None:
    given = timeline()
    for name in ("wheel.M.v", "wheel.M.u"):
        given.signals[name][:] = np.repeat(given.signals[name][::150], 150)
    assert without_copied_rows(given) is given


def test_channels_of_different_sources_are_not_one_row() -> None:
    given = timeline("wheel.M.v", "wheel.M.u")
    apart = replace(given, groups={"wheel.M.v": "a /speed", "wheel.M.u": "a /effort", "wheel.M.v_ref": "a /command"})
    assert without_copied_rows(apart) is apart


def test_an_angle_that_is_held_with_its_command_may_be_a_stuck_sensor() -> None:
    given = timeline("wheel.M.v", "wheel.M.u")
    name = {"wheel.M.v": "steer.rear.phi", "wheel.M.u": "steer.rear.u", "wheel.M.v_ref": "steer.rear.phi_ref"}
    one = "log.csv t steer"

    def named(by: Mapping[str, Any]) -> dict[str, Any]:
        return {name[n]: x for n, x in by.items()}

    axle = replace(
        given,
        signals=named(given.signals),
        fresh=named(given.fresh),
        sources=named(given.sources),
        periods_ns=named(given.periods_ns),
        groups=dict.fromkeys(name.values(), one),
    )
    assert without_copied_rows(axle) is axle
