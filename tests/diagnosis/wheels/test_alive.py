"""Readings that stay: of a sensor that lives at a steady command, and of one that is stuck."""

from __future__ import annotations

import numpy as np

from diagnosis.wheels.alive import lives

SPAN = 0.8
NOISE, SIZE = 0.004, 800
TREMBLING = 0.24 + np.random.default_rng(1).normal(0.0, NOISE, SIZE)
STEADY = np.full(SIZE, 0.25)


def test_a_reading_that_trembles_at_a_steady_command_lives() -> None:
    assert lives(TREMBLING, STEADY, NOISE, SPAN)


def test_a_reading_that_rests_or_that_its_command_leaves_may_be_stuck() -> None:
    assert not lives(np.full(SIZE, 0.24), STEADY, NOISE, SPAN)
    assert not lives(TREMBLING, np.linspace(0.25, 0.6, SIZE), NOISE, SPAN)
    assert not lives(TREMBLING, np.full(SIZE, 0.5), NOISE, SPAN)


def test_a_wheel_that_nobody_asked_to_move_rests() -> None:
    assert lives(np.zeros(SIZE), np.zeros(SIZE), NOISE, SPAN)
    assert not lives(np.zeros(SIZE), STEADY, NOISE, SPAN)


def test_without_a_command_nothing_is_known() -> None:
    assert not lives(TREMBLING, np.full(SIZE, np.nan), NOISE, SPAN)
