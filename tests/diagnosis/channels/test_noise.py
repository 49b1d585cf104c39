"""Noise, rounding step and delay of channels, found from data that may hold faults."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from diagnosis.channels.noise import (
    moving_sum,
    relative_lag,
    rounding_step,
    shifted,
    slow_mismatch,
    unresolved,
    white_noise,
    white_part,
)

DT, N = 0.001, 8000
Array = np.ndarray


def drive(n: int = N) -> Array:
    t = np.arange(n) * DT
    return 0.2 * np.sin(2 * np.pi * t / 3.0) + 0.1 * np.sin(2 * np.pi * t / 0.7)


def white(std: float, n: int = N, seed: int = 1) -> Array:
    return std * np.random.default_rng(seed).normal(size=n)


@pytest.mark.parametrize("lsb", [0.0015, 0.61 * 0.0025263, 2 / 4096, 0.02])
def test_rounding_step_is_found(lsb: float) -> None:
    values = np.round((drive() + white(0.004)) / lsb) * lsb
    assert rounding_step(values) == pytest.approx(lsb, rel=1e-6)
    values[::7] = np.nan
    assert rounding_step(values) == pytest.approx(lsb, rel=1e-6)


@pytest.mark.parametrize("values", [drive() + white(0.004), np.zeros(500), np.array([]), np.full(50, np.nan)])
def test_no_rounding_step(values: Array) -> None:
    assert rounding_step(values) == 0.0


@pytest.mark.parametrize("std", [0.0005, 0.004, 0.05])
def test_white_noise_of_a_moving_signal(std: float) -> None:
    assert white_noise(drive() + white(std), DT) == pytest.approx(std, rel=0.1)


def test_white_noise_in_part_of_a_mission_changes_little() -> None:
    x = drive() + white(0.004)
    x[:2000] += white(0.2, 2000, 2)
    x[3000:4000] = 0.21  # stuck: no noise left
    x[5000:5500] = np.nan
    assert white_noise(x, DT) == pytest.approx(0.004, rel=0.25)


def test_white_noise_of_nothing() -> None:
    assert np.isnan(white_noise(np.zeros(1000), DT))
    assert np.isnan(white_noise(np.empty(0), DT))


def test_mismatch_of_the_quieter_parts() -> None:
    residual = white(0.004)
    residual[:3000] += 0.2
    use = np.ones(N, dtype=bool)
    assert slow_mismatch(residual, use, DT) == pytest.approx(0.004, rel=0.1)
    use[1000:] = False
    assert slow_mismatch(residual, use, DT) == pytest.approx(0.2, rel=0.05)
    assert np.isnan(slow_mismatch(residual, np.zeros(N, dtype=bool), DT))


def test_shift_by_whole_and_part_steps() -> None:
    x = np.array([1.0, 2.0, 4.0, 8.0])
    assert_array_equal(shifted(x, 0), x)
    assert_array_equal(shifted(x, 1), [np.nan, 1, 2, 4])
    assert_array_equal(shifted(x, -1), [2, 4, 8, np.nan])
    assert_allclose(shifted(x, 0.5), [np.nan, 1.5, 3, 6])
    assert_allclose(shifted(x, 1.25), [np.nan, np.nan, 1.75, 3.5])


@settings(deadline=None, max_examples=30)
@given(st.integers(-30, 30))
def test_delay_is_found_to_the_step(lag: int) -> None:
    x = drive()
    y = shifted(x, lag) + white(0.002)
    use = np.isfinite(y)
    assert relative_lag(np.nan_to_num(y), x, use, -50, 50) == pytest.approx(lag, abs=0.5)


def test_delay_of_part_of_a_step() -> None:
    x = drive()[::20]  # 50 Hz
    y = np.interp(np.arange(N) * DT - 0.002, np.arange(N) * DT, drive())[::20]
    found = relative_lag(y, x, np.ones(x.size, dtype=bool), -3, 3)
    assert found == pytest.approx(0.1, abs=0.11)


def test_delay_of_too_little_data_is_zero() -> None:
    assert relative_lag(drive(60), drive(60), np.ones(60, dtype=bool), -10, 10) == 0.0
    assert relative_lag(drive(), drive(), np.zeros(N, dtype=bool), -10, 10) == 0.0


@pytest.mark.parametrize("lag", [-4, 0, 6])
def test_delay_at_which_nothing_was_recorded_is_not_the_one(lag: int) -> None:
    x = drive()
    y = shifted(x, lag)
    x[1::2] = y[1::2] = np.nan  # at odd delays there is nothing to compare
    assert relative_lag(y, x, np.ones(N, dtype=bool), -50, 50) == lag
    x[:] = np.nan
    assert relative_lag(y, x, np.ones(N, dtype=bool), -50, 50) == 0.0


def test_delay_where_a_command_is_missing_before_every_measurement() -> None:
    x, y = drive(), drive()
    x[np.arange(N) % 40 != 0] = np.nan
    assert relative_lag(y, x, np.ones(N, dtype=bool), 1, 30) == 1.0


def test_valve_does_not_answer_before_its_command() -> None:
    use = np.ones(N - 20, dtype=bool)
    ahead = shifted(drive(), -20)[: N - 20]
    assert relative_lag(ahead, drive()[: N - 20], use, -50, 50) == pytest.approx(-20, abs=0.5)
    assert relative_lag(ahead, drive()[: N - 20], use, 0, 50) == 0.0


def test_white_part_leaves_smooth_motion_out() -> None:
    t = np.arange(500.0)
    assert_allclose(white_part(3 + 2 * t), 0.0, atol=1e-9)
    assert np.std(white_part(white(0.1))) == pytest.approx(0.1, rel=0.05)
    gap = white(0.1, 50)
    gap[20] = np.nan
    assert_array_equal(white_part(gap)[[0, 19, 20, 21, 49]], 0.0)


def test_reference_that_jumps_from_sample_to_sample_is_not_resolved() -> None:
    x = drive() + white(0.08)
    use = np.ones(N, dtype=bool)
    whole, share = unresolved(white(0.003, N, 2), x, use, 0.003, DT)
    assert not whole.any()
    assert share == 0.0
    between = 0.5 * (x + np.r_[x[:1], x[:-1]]) + white(0.003, N, 2)  # half a step late
    power, share = unresolved(between - x, x, use, 0.003, DT)
    assert np.mean(power > (2 * 0.003) ** 2) > 0.95
    assert share > 0.3
    quiet, _ = unresolved(white(0.003, N, 2), drive(), use, 0.003, DT)
    assert not quiet.any()


@given(st.lists(st.floats(-1e3, 1e3), max_size=60), st.integers(0, 80))
def test_moving_sum_is_a_convolution_with_ones(values: list[float], width: int) -> None:
    x = np.array(values, dtype=np.float64)
    kept = min(width, x.size)
    expected = np.convolve(x, np.ones(kept), mode="same") if kept else np.zeros(x.size)
    assert_allclose(moving_sum(x, width), expected, atol=1e-9)


@given(st.lists(st.booleans(), max_size=60), st.integers(0, 80))
def test_moving_counts_are_moving_sums(values: list[bool], width: int) -> None:
    x = np.array(values, dtype=np.bool_)
    found = moving_sum(x, width)
    assert found.dtype == np.float64
    assert_array_equal(found, moving_sum(x.astype(np.float64), width))


def test_an_outlier_reaches_no_sum_beyond_its_window() -> None:
    x = white(1e-3)
    outlier = x.copy()
    outlier[100] = 1e200
    far = slice(200, None)
    assert_array_equal(moving_sum(outlier, 101)[far], moving_sum(x, 101)[far])
