"""Readings that are recorded more often than the sensor renews them."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.steering.news import cycle

TIME = np.arange(0.0, 40.0, 0.005)
ANGLE = 0.3 * np.sin(0.7 * TIME)
EVERY = np.ones(TIME.size, dtype=np.bool_)


def read(angle: np.ndarray, every: int, noise: float = 5e-4, step: float = 0.0) -> np.ndarray:
    """An angle as a controller reads it once in so many rows."""
    seen = angle + np.random.default_rng(0).normal(0.0, noise, angle.size)
    held = seen[np.arange(angle.size) // every * every]
    return np.round(held / step) * step if step else held


@pytest.mark.parametrize("every", [2, 3, 5])
def test_the_cycle_is_told_while_the_axle_turns(every: int) -> None:
    assert cycle(read(ANGLE, every), EVERY) == every


def test_a_sensor_that_is_read_for_every_row_has_none() -> None:
    assert cycle(read(ANGLE, 1), EVERY) is None


def test_a_coarse_rounding_is_no_cycle() -> None:
    """Between two steps of the rounding a slow axle reads the same again: nothing tells whether the reading was renewed."""
    assert cycle(read(ANGLE, 1, noise=0.0, step=0.002), EVERY) is None


def test_a_resting_axle_tells_none() -> None:
    assert cycle(read(np.zeros(TIME.size), 4, noise=0.0), EVERY) is None


def test_rows_that_come_more_rarely_than_steps_count_in_steps() -> None:
    fresh = np.arange(TIME.size) % 4 == 0
    assert cycle(read(ANGLE, 12), fresh) == 12
