"""How finely a result's columns are stored."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from diagnosis.results.stored import grid_of, stored

RNG = np.random.default_rng(1)
NOISE = np.cumsum(RNG.normal(size=20_000))


@given(st.floats(1e-4, 10.0), st.integers(10, 5000))
def test_every_level_of_a_recorded_signal_is_found_again(lsb: float, levels: int) -> None:
    turns = RNG.integers(-levels, levels, 3000)
    kept = stored("wheel.FR.v", turns * lsb, grid_of("wheel.FR.v", turns * lsb, lsb))
    np.testing.assert_array_equal(np.rint(kept / lsb), turns)
    assert np.abs(kept / lsb - turns).max() <= 1 / 8 + 1e-3


@pytest.mark.parametrize(
    ("name", "part", "relative"),
    [
        ("wheel.FR.u", 2**-15, 1e-7),
        ("replay.FR.e", 2**-12, 2**-12),
        ("evidence.FR.sensor.residual", 2**-11, 2**-11),
        ("evidence.FR.sensor.delta_std", 2**-9, 2**-9),
    ],
)
def test_error_is_half_a_step_of_the_range(name: str, part: float, relative: float) -> None:
    low, high = np.quantile(NOISE, [0.001, 0.999])
    wrong = np.abs(stored(name, NOISE, grid_of(name, NOISE)) - NOISE)
    assert np.all(wrong <= part * (high - low) + relative * 1.01 * np.abs(NOISE))
    assert wrong.max() > part * (high - low) / 4


def test_what_is_no_number_and_what_is_absurd_stays() -> None:
    values = np.array([np.nan, np.inf, -np.inf, 1e37, 1.0, -1.0, 0.0] * 100, np.float32)
    kept = stored("wheel.FR.v", values, grid_of("wheel.FR.v", values, 0.01))
    np.testing.assert_array_equal(kept, values)
    assert grid_of("t", NOISE) == 0.0
    assert grid_of("wheel.FR.v", np.full(9, np.nan)) == 0.0
    assert grid_of("wheel.FR.v", np.full(9, 0.3)) == 0.0


def test_probabilities_are_kept_to_a_256th() -> None:
    name, p = "evidence.FR.sensor.p_stuck", np.linspace(0, 1, 1000)
    assert np.abs(stored(name, p, grid_of(name, p)) - p).max() <= 1 / 512 + 1e-9


def test_the_grid_takes_what_is_finite_and_small_enough() -> None:
    huge = 2.0**24
    values = np.array([np.nan, np.inf, -np.inf, -0.0, 0.4, -0.13, huge + 4.0, -3e38, 1e-45], np.float32)
    found = stored("wheel.FR.v", values, 0.25)
    expected = np.array([np.nan, np.inf, -np.inf, 0.0, 0.5, -0.25, huge + 4.0, -3e38, 0.0], np.float32)
    assert np.array_equal(found, expected, equal_nan=True)
    assert not np.signbit(found[[3, 8]]).any()
