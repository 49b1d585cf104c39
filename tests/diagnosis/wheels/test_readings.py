"""Speed sensors of several kinds as the wheel models see them."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from diagnosis.channels.sample_status import PAIR, SKIP
from diagnosis.wheels.blocks import WheelBlocks, blocks_of
from diagnosis.wheels.readings import habits_of, news, speed_noises, with_readings
from diagnosis.wheels.step_kernel import RESTLESS, RESTS
from tests.diagnosis.channels.test_habit import DT, N, counted, speed

WHEELS = 4
Array = np.ndarray


def wheels(kind: str) -> Array:
    rng = np.random.default_rng(9)
    slow = [speed() * (1.0 + 0.1 * i) for i in range(WHEELS)]
    if kind == "counting":
        return np.stack([counted(v) for v in slow], axis=1)
    share = 0.02 if kind == "tacho" else 0.0
    return np.stack([v + (0.001 + share * np.abs(v)) * rng.normal(size=N) for v in slow], axis=1)


def read(y: Array) -> tuple[WheelBlocks, Array]:
    fresh = [np.ones(N, dtype=np.bool_)] * WHEELS
    habits = habits_of(y, fresh, DT)
    status = news(np.full(y.shape, PAIR, dtype=np.int8), y, habits, DT)
    none, quiet = np.zeros(y.shape), np.zeros(y.shape, dtype=np.bool_)
    blocks = blocks_of(y, none, status, quiet, none + 1, none, [None] * WHEELS, DT)
    return with_readings(blocks, y, habits, speed_noises(y, status, habits, DT), 0.05), status


def test_noise_alone_changes_nothing() -> None:
    blocks, status = read(wheels("plain"))
    assert (status == PAIR).all()
    assert (blocks.white == 1.0).all()
    assert not blocks.slack.any()
    assert not blocks.habit.any()


def test_noise_in_proportion_to_the_speed() -> None:
    blocks, _ = read(wheels("tacho"))
    size = np.abs(blocks.y[:, 0])
    fast, slow = blocks.white[size > 0.25, 0].mean(), blocks.white[size < 0.03, 0].mean()
    assert fast / slow == pytest.approx(((0.001 + 0.02 * 0.28) / 0.0013) ** 2, rel=0.6)


def test_stepwise_sensor_brings_news_once_per_hold() -> None:
    y = wheels("counting")
    blocks, status = read(y)
    assert_array_equal(np.unique(status), [SKIP, PAIR])
    assert np.mean(status == PAIR) == pytest.approx(0.1, abs=0.03)
    assert blocks.count.max() == 1.0
    assert blocks.slack.max() > 0.0
    assert not blocks.habit.any()


def test_stepwise_sensor_that_rests_or_rattles_shows_it() -> None:
    y = wheels("counting")
    y[20_000:26_000, 1] = 0.2
    y[40_000:45_000, 2] += 0.03 * np.random.default_rng(1).normal(size=5000)
    habit = read(y)[0].habit
    assert np.mean(habit[2010:2590, 1] == RESTS) > 0.95
    assert np.mean(habit[4010:4490, 2] == RESTLESS) > 0.8
    habit[2000:2601, 1] = 0
    habit[4000:4501, 2] = 0
    assert not habit.any()
