"""Sliding windows against those of `scipy.ndimage`, to the last digit."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from scipy.ndimage import maximum_filter1d, median_filter, minimum_filter1d, uniform_filter1d

from diagnosis.channels.noise import moving_sum
from replay.arrays.sliding import largest_within, mean_within, median_within, smallest_within

_SIZES = (1, 2, 7, 100, 5003)


@pytest.mark.parametrize("size", _SIZES)
@pytest.mark.parametrize("reach", [0, 1, 3, 8, 40])
def test_centred_extremes(size: int, reach: int) -> None:
    x = np.random.default_rng(size + reach).normal(size=size)
    assert_array_equal(largest_within(x, reach, reach), maximum_filter1d(x, 2 * reach + 1))
    assert_array_equal(smallest_within(x, reach, reach), minimum_filter1d(x, 2 * reach + 1))


@pytest.mark.parametrize("size", _SIZES)
@pytest.mark.parametrize("width", [1, 3, 4, 16, 61])
def test_extremes_of_what_came_before(size: int, width: int) -> None:
    x, origin = np.random.default_rng(size + width).normal(size=size), (width - 1) // 2
    assert_array_equal(largest_within(x, width - 1, 0), maximum_filter1d(x, width, origin=origin))
    assert_array_equal(smallest_within(x, width - 1, 0), minimum_filter1d(x, width, origin=origin))


@pytest.mark.parametrize("size", [*_SIZES, 40_000])
@pytest.mark.parametrize("width", [1, 4, 61])
def test_extremes_beside_nearest_values(size: int, width: int) -> None:
    x, origin = np.random.default_rng(size + width).normal(size=size), (width - 1) // 2
    expected = minimum_filter1d(x, width, mode="nearest", origin=origin)
    assert_array_equal(smallest_within(x, width - 1, 0, "edge"), expected)


@pytest.mark.parametrize("size", [*_SIZES, 40_000])
@pytest.mark.parametrize("reach", [0, 3, 7])
def test_medians(size: int, reach: int) -> None:
    x = np.random.default_rng(size + reach).normal(size=size).cumsum()
    assert_array_equal(median_within(x, reach), median_filter(x, 2 * reach + 1, mode="nearest"))


@pytest.mark.parametrize("size", _SIZES)
@pytest.mark.parametrize("width", [1, 3, 4, 300])
def test_means(size: int, width: int) -> None:
    x = np.random.default_rng(size + width).normal(size=size) ** 2
    assert_array_equal(mean_within(x, width), uniform_filter1d(x, width, mode="constant"))
    assert_array_equal(mean_within(x, width, "edge"), uniform_filter1d(x, width, mode="nearest"))


@pytest.mark.parametrize("size", [16384, 32767, 32768, 50_001])
@pytest.mark.parametrize("width", [1, 4, 301, 9000])
def test_long_columns_in_parts(size: int, width: int) -> None:
    x, before = np.random.default_rng(size + width).normal(size=size), width // 2
    assert_array_equal(mean_within(x**2, width), uniform_filter1d(x**2, width, mode="constant"))
    assert_array_equal(largest_within(x, before, before), maximum_filter1d(x, 2 * before + 1))
    assert_array_equal(smallest_within(x, before, before), minimum_filter1d(x, 2 * before + 1))


@pytest.mark.parametrize("size", [16384, 32767, 50_001])
@pytest.mark.parametrize("width", [1, 4, 301, 9000])
def test_sums_in_parts_are_those_of_one_piece(monkeypatch: pytest.MonkeyPatch, size: int, width: int) -> None:
    x = np.random.default_rng(size + width).normal(size=size)
    parted = moving_sum(x, width), moving_sum(x > 0, width)
    monkeypatch.setattr("replay.arrays.sliding._PART", 1 << 20)
    for a, b in zip(parted, (moving_sum(x, width), moving_sum(x > 0, width)), strict=True):
        assert_array_equal(a, b)
