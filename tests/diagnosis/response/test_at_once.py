"""What a jump between two readings says of sensor and drive."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.response.assess import assess_response
from diagnosis.response.at_once import (
    back_at_once,
    hardest_change,
    how_hard,
    sensor_by_jumps,
    too_hard,
    usual_pause,
    within_a_pause,
)
from diagnosis.response.channel import Samples, samples_of
from replay.faults import FaultMode, Side
from replay.machine.config import Limits
from tests.diagnosis.response.robot import DT, TRACK, WHEELS, followers_of, geometry, speeds

Array = NDArray[np.float64]

BEGIN_S, END_S = 20.0, 30.0
PAIR = ("R", "L")
PART = slice(round(60.0 / DT), round(70.0 / DT))


def readings(rate: float, share: float = 0.0, *, takes_s: float = 0.0, repeats: int = 1) -> Samples:
    """A speed [m/s] with starts and stops that reads a share of itself for ten seconds, and takes its time for that."""
    t = np.arange(round(60.0 * rate)) / rate
    y = np.clip(1.2 * np.abs(np.mod(t, 12.0) - 6.0) - 1.0, 0.4, 2.0)
    y += np.random.default_rng(1).normal(0.0, 0.01, t.size)
    y *= np.interp(t, [BEGIN_S - 1e-6, BEGIN_S + takes_s, END_S - 1e-6, END_S + takes_s], [1.0, share, share, 1.0])
    y = y[repeats * (np.arange(t.size) // repeats)]
    return samples_of(y, np.ones(t.size, np.bool_))


def told(wheels: tuple[str, ...], reads: Array, seed: int = 3) -> list[tuple[str, Side, FaultMode]]:
    """Findings on a robot whose last wheel reads its speed times `reads`, shape of `PART`."""
    measured, asked, body = speeds(seed, wheels)
    measured[wheels[-1]][PART] = np.round(measured[wheels[-1]][PART] * reads, 3)
    parts = assess_response(followers_of(measured, asked, body), geometry(wheels), None, Limits(driving_speed=0.05), DT)
    found = {id(f): (w, f.side, f.mode) for w, sides in parts.parts.items() for side in sides for f in side.findings}
    return list(found.values())


def test_a_change_that_takes_no_time_beside_the_pause_lies_within_it_and_a_long_one_does_not() -> None:
    assert within_a_pause(1.0, 1e-3) == pytest.approx(1.0, abs=2e-3)
    assert within_a_pause(0.01, 1.0) == pytest.approx(0.005, abs=1e-4)
    rng = np.random.default_rng(2)
    begins, takes = rng.uniform(0.0, 0.1, 100_000), rng.exponential(0.15, 100_000)
    assert within_a_pause(0.1, 0.15) == pytest.approx(np.mean(begins + takes < 0.1), abs=0.01)


def test_the_harder_a_jump_beside_the_starts_of_the_drive_the_surer_is_it_the_sensors() -> None:
    by_rate = [sensor_by_jumps(readings(rate, 0.5), [round(BEGIN_S * rate)], 1.0 / rate) for rate in (4.0, 20.0, 100.0)]
    assert 0.5 < by_rate[0] < by_rate[1] <= by_rate[2] <= 0.92
    samples = readings(20.0, 0.5)
    both = sensor_by_jumps(samples, [round(BEGIN_S * 20.0), round(END_S * 20.0)], 0.05)
    assert by_rate[1] < both <= 0.97
    assert "times as much as at the hardest starts" in how_hard(samples, [round(BEGIN_S * 20.0)])
    assert sensor_by_jumps(samples, [], 0.05) == 0.5


def test_a_wheel_that_hardly_turned_shows_nothing_of_its_drive() -> None:
    samples = samples_of(np.r_[np.zeros(200), np.linspace(0.1, 1.0, 50)], np.ones(250, np.bool_))
    assert hardest_change(samples) == np.inf
    assert sensor_by_jumps(samples, [210], 0.05) == 0.5
    assert how_hard(samples, [210]) == ""


def test_a_jump_is_found_by_its_ratio_and_a_change_that_took_its_time_is_none() -> None:
    at = round(BEGIN_S * 20.0)
    assert too_hard(readings(20.0, 0.5), at + 8, 0.5, 0.05) == at
    assert too_hard(readings(20.0, 0.5), at + 8, 0.9, 0.05) is None
    assert too_hard(readings(20.0, 0.5, takes_s=2.0), at + 8, 0.5, 0.05) is None


def test_only_what_fell_to_0_and_came_back_at_once_is_back_at_once() -> None:
    end = round(END_S * 20.0)
    assert back_at_once(readings(20.0), end - 5, 0.05) == (round(BEGIN_S * 20.0), end)
    assert back_at_once(readings(20.0, takes_s=2.0), end, 0.05) is None
    assert back_at_once(readings(20.0), end - 100, 0.05) is None


def test_values_that_a_driver_repeats_are_as_far_apart_as_new_ones() -> None:
    assert usual_pause(readings(100.0), 0.01) == pytest.approx(0.01)
    assert usual_pause(readings(100.0, repeats=20), 0.01) == pytest.approx(0.2)


@pytest.mark.parametrize(("wheels", "side"), [(PAIR, Side.SENSOR), (WHEELS, Side.SENSOR_OR_ACTUATOR)])
def test_a_reading_that_is_back_at_once_is_the_sensors_where_the_drive_alone_moves_its_side(
    wheels: tuple[str, ...], side: Side
) -> None:
    assert told(wheels, np.zeros(PART.stop - PART.start)) == [(wheels[-1], side, FaultMode.NO_SIGNAL)]


def test_a_wheel_that_stops_at_once_and_starts_as_its_drive_does_may_be_jammed() -> None:
    reads = np.r_[np.zeros(180), np.linspace(0.0, 1.0, PART.stop - PART.start - 180)]
    assert told(PAIR, reads) == [("L", Side.SENSOR_OR_ACTUATOR, FaultMode.NO_SIGNAL)]


def test_a_share_that_comes_and_goes_at_once_is_the_sensors_and_one_that_takes_its_time_is_open() -> None:
    n = PART.stop - PART.start
    assert told(PAIR, np.full(n, 0.5)) == [("L", Side.SENSOR, FaultMode.INEFFICIENT)]
    ramp = np.interp(np.arange(n), [0, 40, n - 40, n], [1.0, 0.5, 0.5, 1.0])
    assert all(side is Side.SENSOR_OR_ACTUATOR for _, side, _ in told(PAIR, ramp))


@pytest.mark.parametrize(("asked_of", "named"), [((0.7, 0.7), []), ((0.6, 0.8), ["L"])])
def test_a_wheel_that_does_what_another_one_that_is_told_the_same_does_is_not_named(
    asked_of: tuple[float, float], named: list[str]
) -> None:
    measured, asked, body = speeds(3, PAIR)
    body[PART] = 0.7, -0.2 / TRACK  # makes .6 of the right wheel and .8 of the left one in the rest of the mission
    for k, w in enumerate(PAIR):
        asked[w][PART] = asked_of[k]
        measured[w][PART] = 0.6 + np.random.default_rng(k).normal(0.0, 0.01, PART.stop - PART.start)
    parts = assess_response(followers_of(measured, asked, body), geometry(PAIR), None, Limits(driving_speed=0.05), DT)
    assert [w for w, sides in parts.parts.items() if any(side.findings for side in sides)] == named
