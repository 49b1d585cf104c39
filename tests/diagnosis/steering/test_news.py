"""Readings that are recorded more often than the sensor renews them."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.steering.news import cycle, with_news
from replay.machine.config import haulotte
from replay.signals.timeline import Timeline

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


def timeline(front: np.ndarray, rear: np.ndarray) -> Timeline:
    signals = {"steer.front.phi": front, "steer.rear.phi": rear}
    return Timeline(0, 5_000_000, TIME.size, signals, dict.fromkeys(signals, EVERY), dict.fromkeys(signals, "log"), {})


def test_one_controller_reads_both_axles() -> None:
    found = with_news(timeline(read(ANGLE, 4), read(-ANGLE, 4)), haulotte())
    for fresh in found.fresh.values():
        assert fresh.mean() == pytest.approx(0.25, abs=0.02)


def test_a_sensor_that_alone_is_renewed_rarely_stays_as_it_is() -> None:
    for rear in (read(-ANGLE, 1), read(-ANGLE, 2)):
        line = timeline(read(ANGLE, 4), rear)
        rarely = with_news(line, haulotte()).fresh["steer.front.phi"]
        assert rarely.mean() > 0.3  # by the quicker one, or not at all


def test_what_both_repeat_for_longer_than_a_cycle_is_no_cycle() -> None:
    line = timeline(read(ANGLE, 40), read(-ANGLE, 40))
    assert with_news(line, haulotte()) is line


def test_a_frozen_sensor_still_delivers() -> None:
    frozen = read(ANGLE, 4)
    frozen[4000:6000] = frozen[3999]
    fresh = with_news(timeline(frozen, read(-ANGLE, 4)), haulotte()).fresh["steer.front.phi"]
    assert fresh[4000:6000].sum() > 200
