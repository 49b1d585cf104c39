"""Second speeds that come later, or earlier, on all wheels alike are the machine's instruments; one wheel's lag, or loss, is its own."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.clearing.cells import Frame
from diagnosis.clearing.measure import behind
from diagnosis.clearing.seconds import less_at_starts, off_second, slope_off

SIZE, DT, FLOOR = 900, 0.1, 0.1
TRUE = 0.8 * np.sign(np.sin(0.5 * np.arange(SIZE) * DT))[:, np.newaxis] * np.ones(4)
CELLS: Any = SimpleNamespace(frame=Frame(SIZE, 30, 5), dt=DT)


def largest(speed: np.ndarray, second: np.ndarray) -> np.ndarray:
    return np.asarray(np.nanmax(off_second(CELLS, speed, second, FLOOR), axis=0))


@pytest.mark.parametrize("earlier", [False, True])
def test_a_lag_that_all_wheels_share_is_no_fault(*, earlier: bool) -> None:
    late = behind(TRUE, DT, 0.2)
    assert (largest(*((TRUE, late) if earlier else (late, TRUE))) < 0.08).all()


def test_a_wheel_that_is_later_than_the_others_or_loses_is_off() -> None:
    speed = behind(TRUE, DT, 0.2)
    speed[:, 1] = behind(TRUE[:, [1]], DT, 0.8)[:, 0]
    speed[400:440, 2] *= 0.6
    off = largest(speed, TRUE)
    assert (off[[0, 3]] < 0.08).all()
    assert off[1] > 0.3
    assert off[2] == pytest.approx(0.4, abs=0.05)


def test_what_all_lose_stays() -> None:
    assert (largest(0.7 * behind(TRUE, DT, 0.2), TRUE) > 0.28).all()


def test_of_one_wheel_the_lag_is_its_own_and_without_wheels_there_is_nothing() -> None:
    second = np.full(TRUE.shape, np.nan)
    second[:, 0] = TRUE[:, 0]
    assert np.nanmax(off_second(CELLS, behind(TRUE, DT, 0.3), second, FLOOR)[:, 0]) > 0.15
    assert off_second(CELLS, TRUE[:, :0], TRUE[:, :0], FLOOR).shape == (len(CELLS.frame.starts), 0)


def test_the_first_moment_of_a_movement_counts_as_much_as_the_next_one() -> None:
    off = np.array([[np.nan, 0.1], [0.6, 0.9], [0.1, 0.1], [np.nan, 0.3], [0.5, 0.2], [np.nan, np.nan]])
    # a window between two of rest has nothing beside it
    assert less_at_starts(off).tolist()[1] == [0.1, 0.9]
    assert less_at_starts(off)[2:5].tolist()[0] == [0.1, 0.1]
    assert less_at_starts(off)[4, 0] == 0.5
    lasting = np.array([[np.nan], [0.5], [0.45], [0.5], [np.nan]])
    assert less_at_starts(lasting)[:, 0].tolist()[1:4] == [0.45, 0.45, 0.45]


@pytest.mark.parametrize(("gain", "noise"), [(1.0, 0.001), (0.6, 0.001), (1.3, 0.003)])
def test_small_movements_show_a_gain_over_a_mission(gain: float, noise: float) -> None:
    rng = np.random.default_rng(7)
    x = 0.03 * np.sin(np.arange(0.0, 75.0, 0.05) / 6.0)
    y = gain * x + 0.02 + noise * rng.standard_normal(x.size)
    assert slope_off(y, x, 0.05, 0.006) == pytest.approx(abs(gain - 1.0), abs=0.02)


def test_movements_that_noise_hides_show_no_gain() -> None:
    rng = np.random.default_rng(8)
    x = 0.03 * np.sin(np.arange(0.0, 75.0, 0.05) / 6.0)
    assert slope_off(x + 0.1 * rng.standard_normal(x.size), x, 0.05, 0.006) is None
    assert slope_off(0.1 * x, 0.1 * x, 0.05, 0.006) is None
    assert slope_off(np.full_like(x, np.nan), x, 0.05, 0.006) is None
