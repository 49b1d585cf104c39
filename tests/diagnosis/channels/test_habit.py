"""How channels of several kinds are updated is found from what they give."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from diagnosis.channels.habit import EVERY_SAMPLE, Habit, identify_habit, of_kind
from diagnosis.channels.held import held_reference, news_alone
from diagnosis.channels.sample_status import PAIR, SKIP

DT, N = 0.001, 60_000
POLE = 0.003
Array = np.ndarray


def speed() -> Array:
    t = np.arange(N) * DT
    return 0.25 * np.sin(2 * np.pi * t / 23) + 0.08 * np.sin(2 * np.pi * t / 3.1)


def counted(v: Array, window: int = 10, step: float = 4e-5) -> Array:
    place = np.floor(np.cumsum(v) * DT / step)
    ends = place[window - 1 :: window]
    return np.repeat(np.diff(ends, prepend=0.0), window)[: v.size] * step / (window * DT)


def between_poles(v: Array, timeout: float = 0.25) -> Array:
    """Mean speed between two uneven poles, held until the next one."""
    poles = POLE * (1.0 + 0.03 * np.random.default_rng(2).normal(size=48))
    out, travel, last, value, pole = np.zeros(v.size), 0.0, 0, 0.0, 0
    for k, x in enumerate(v):
        travel += x * DT
        width = poles[(pole if travel >= 0.0 else pole - 1) % 48]
        if abs(travel) >= width:
            way = 1 if travel > 0.0 else -1
            value, last, pole = way * POLE / ((k - last) * DT), k, pole + way
            travel -= way * width
        elif (k - last) * DT > timeout:
            value = 0.0
        out[k] = value
    return out


def habit(y: Array) -> Habit:
    return identify_habit(y, np.ones(y.size, dtype=np.bool_), DT)


def test_noise_from_sample_to_sample_is_no_hold() -> None:
    found = habit(np.round((speed() + 0.003 * np.random.default_rng(0).normal(size=N)) / 0.0015) * 0.0015)
    assert not found.stepwise
    assert found.window == pytest.approx(DT)


@pytest.mark.parametrize("faulty", [False, True])
def test_counting_window(faulty: bool) -> None:
    y = counted(speed())
    if faulty:
        y[10_000:22_000] += 0.05 * np.random.default_rng(1).normal(size=12_000)
        y[40_000:52_000] = 0.1
    found = habit(y)
    assert (found.stepwise, found.travel) == (True, 0.0)
    assert found.window == pytest.approx(0.01)


@pytest.mark.parametrize("faulty", [False, True])
def test_travel_between_poles(faulty: bool) -> None:
    y = between_poles(speed())
    if faulty:
        y[10_000:22_000] += 0.05 * np.random.default_rng(1).normal(size=12_000)
        y[40_000:52_000] = 0.1
    found = habit(y)
    assert found.travel == pytest.approx(POLE, rel=0.1)
    assert found.timeout == pytest.approx(0.25, rel=0.1)
    assert found.tick == pytest.approx(DT / POLE, rel=0.02)
    assert found.hold(np.array([0.1, 0.0]))[0] == pytest.approx(POLE / 0.1, rel=0.1)
    assert found.hold(np.array([0.1, 0.0]))[1] == found.timeout


def test_one_that_does_not_show_its_habit_has_that_of_its_kind() -> None:
    shown = Habit(0.01, 0.0, 0.01, stepwise=True)
    assert of_kind([shown, shown, EVERY_SAMPLE]) == [shown, shown, shown]
    assert of_kind([shown, EVERY_SAMPLE, EVERY_SAMPLE]) == [shown, EVERY_SAMPLE, EVERY_SAMPLE]


def test_reference_is_what_the_channel_saw() -> None:
    x = speed()
    window = Habit(0.01, 0.0, 0.01, stepwise=True)
    held = held_reference(x, window, DT)
    places = [20, 5000, N - 1]
    for k in places:
        assert held.mean[k] == pytest.approx(x[k - 9 : k + 1].mean())
        assert held.spread[k] == pytest.approx(0.5 * np.ptp(x[k - 19 : k + 1]))
    poles = Habit(DT, POLE, 0.25, stepwise=True)
    held = held_reference(x, poles, DT)
    y = between_poles(x)
    at = np.flatnonzero(np.diff(y) != 0)[5:] + 1
    assert np.sqrt(np.mean((y[at] - held.mean[at]) ** 2)) < 0.015
    assert np.mean(np.abs(y[1000:] - held.mean[1000:]) <= held.spread[1000:] + 0.025) > 0.97


def test_only_news_count() -> None:
    y = counted(speed())
    status = np.full(N, PAIR, dtype=np.int8)
    out = news_alone(status, y, np.full(N, 0.01), DT)
    assert np.mean(out == PAIR) == pytest.approx(0.1, abs=0.02)
    stuck = news_alone(status, np.full(N, 0.3), np.full(N, 0.01), DT)
    assert np.mean(stuck == PAIR) == pytest.approx(1 / 15, abs=0.01)
    assert_array_equal(np.unique(out), [SKIP, PAIR])


@pytest.mark.parametrize("every", [10, 20])
def test_poles_that_come_faster_than_the_samples_show_where_the_wheel_is_slow(every: int) -> None:
    y = between_poles(speed())[::every]
    found = identify_habit(y, np.ones(y.size, dtype=np.bool_), every * DT)
    assert found.stepwise
    assert found.travel == pytest.approx(POLE, rel=0.5)


@pytest.mark.parametrize("every", [10, 20])
def test_a_sampled_sensor_has_no_poles_at_any_rate(every: int) -> None:
    y = np.round((speed() + 0.003 * np.random.default_rng(0).normal(size=N))[::every] / 0.0015) * 0.0015
    assert not identify_habit(y, np.ones(y.size, dtype=np.bool_), every * DT).stepwise


def test_a_gap_of_the_reference_is_no_standstill() -> None:
    x = speed() + 1.0
    known = x.copy()
    known[4000:4020] = np.nan
    window = Habit(0.01, 0.0, 0.01, stepwise=True)
    whole, held = held_reference(x, window, DT).mean, held_reference(known, window, DT).mean
    assert np.isnan(held[4000:4020]).all()
    assert held[4020:4040] == pytest.approx(whole[4020:4040], abs=0.02)


def test_a_tick_is_found_although_slow_readings_are_rounded_as_well() -> None:
    """A pole sensor timed in milliseconds, whose speed is recorded to three digits."""
    found = habit(np.round(between_poles(speed()) / 1e-3) * 1e-3)
    assert found.tick == pytest.approx(DT / POLE, rel=0.03)
