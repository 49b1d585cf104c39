"""What a jump between two readings says of sensor and drive."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.response.at_once import STARTS_S, STOPS_S, Jump, sensor_by_jumps, to_zero, usual_pause, within_a_pause
from diagnosis.response.channel import Samples, samples_of

BEGIN_S, END_S = 20.0, 30.0


def readings(rate: float, *, takes_s: float = 0.0, repeats: int = 1, seed: int = 1) -> Samples:
    """A speed [m/s] with commanded starts and stops that stands for ten seconds, and takes its time for it."""
    t = np.arange(round(60.0 * rate)) / rate
    y = np.clip(1.2 * np.abs(np.mod(t, 12.0) - 6.0) - 1.0, 0.4, 2.0)
    y += np.random.default_rng(seed).normal(0.0, 0.01, t.size)
    y *= np.interp(t, [BEGIN_S - 1e-6, BEGIN_S + takes_s, END_S - 1e-6, END_S + takes_s], [1.0, 0.0, 0.0, 1.0])
    y = y[repeats * (np.arange(t.size) // repeats)]
    return samples_of(y, np.ones(t.size, np.bool_))


def test_a_change_that_takes_no_time_beside_the_pause_lies_within_it_and_a_long_one_does_not() -> None:
    assert within_a_pause(1.0, 1e-3) == pytest.approx(1.0, abs=2e-3)
    assert within_a_pause(0.01, 1.0) == pytest.approx(0.005, abs=1e-4)
    rng = np.random.default_rng(2)
    begins, takes = rng.uniform(0.0, 0.1, 100_000), rng.exponential(STOPS_S, 100_000)
    assert within_a_pause(0.1, STOPS_S) == pytest.approx(np.mean(begins + takes < 0.1), abs=0.01)


@pytest.mark.parametrize(("rate", "least", "most"), [(100.0, 0.95, 1.0), (20.0, 0.9, 1.0), (4.0, 0.6, 0.9)])
def test_the_faster_the_readings_the_surer_is_a_jump_the_sensors(rate: float, least: float, most: float) -> None:
    samples = readings(rate)
    fell, rose = (
        to_zero(samples, round(BEGIN_S * rate), 1.0 / rate),
        to_zero(samples, round(END_S * rate), 1.0 / rate, ends=True),
    )
    assert fell is not None
    assert rose is not None
    assert fell == round(BEGIN_S * rate)
    one = sensor_by_jumps(samples, [Jump(fell, STOPS_S)], 1.0 / rate)
    both = sensor_by_jumps(samples, [Jump(fell, STOPS_S), Jump(rose, STARTS_S)], 1.0 / rate)
    assert 0.5 < one < both
    assert least <= both <= most


def test_no_jump_says_nothing() -> None:
    assert sensor_by_jumps(readings(20.0), [], 0.05) == 0.5


def test_a_speed_that_takes_its_time_to_0_has_no_jump_there() -> None:
    assert to_zero(readings(50.0, takes_s=3.0), round(BEGIN_S * 50.0), 0.02) is None


def test_values_that_a_driver_repeats_are_as_far_apart_as_new_ones() -> None:
    assert usual_pause(readings(100.0), 0.01) == pytest.approx(0.01)
    assert usual_pause(readings(100.0, repeats=20), 0.01) == pytest.approx(0.2)
    fast, slow = (
        sensor_by_jumps(s, [Jump(2000, STOPS_S)], 0.01) for s in (readings(100.0), readings(100.0, repeats=20))
    )
    assert fast > 0.9 > slow
