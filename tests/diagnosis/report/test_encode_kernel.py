"""The compiled steps of encoding against NumPy's over whole columns."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.report.encode_kernel import quantise, split_planes

_HUGE = 1e30


def test_levels_are_those_of_whole_columns() -> None:
    rng = np.random.default_rng(3)
    y = np.r_[rng.normal(0.0, 4.0, 5000), np.nan, np.inf, -np.inf, 1e31, -1e31, 0.0, -0.0, 0.005, -0.015]
    step, base = 0.01, -1800.0
    known = np.where(np.abs(y) < _HUGE, y, base * step)
    out = np.empty(y.size, np.int32)
    quantise(y, _HUGE, step, base, out)
    np.testing.assert_array_equal(out, np.rint(known / step) - base)
    assert (out[5000:5005] == 0).all()


@pytest.mark.parametrize("most", [1, 100, 30_000, 1 << 24])
def test_planes_are_the_bytes_of_zigzag_differences(most: int) -> None:
    levels = np.random.default_rng(4).integers(0, most, 4001).astype(np.int32)
    delta = np.diff(levels, prepend=np.int32(0))
    coded = ((delta << 1) ^ (delta >> 31)).view(np.uint32)
    rows = np.empty((4, levels.size), np.uint8)
    bits = split_planes(levels, rows, 0, 4)
    np.testing.assert_array_equal(rows, coded.astype("<u4").view(np.uint8).reshape(-1, 4).T)
    assert bits.bit_length() == int(coded.max()).bit_length()
    alone = np.full((4, levels.size), 7, np.uint8)
    assert split_planes(levels, alone, 0, 1) == bits
    np.testing.assert_array_equal(alone, np.vstack([rows[:1], np.full((3, levels.size), 7)]))


def test_nothing_has_no_bits() -> None:
    assert split_planes(np.zeros(0, np.int32), np.empty((4, 0), np.uint8), 0, 1) == 0
