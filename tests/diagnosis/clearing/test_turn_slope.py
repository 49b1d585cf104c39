"""What turns make of the speeds per opening of all wheels alike takes nothing of what is one wheel's own."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.clearing.turn_slope import turn_slope

Array = NDArray[np.float64]
WINDOWS = 160
SIDES = np.array([1.0, -1.0, 1.0, -1.0])  # FR, FL, RR, RL: which of them is outside


def driven(slope: float, *, turns: float = 0.3, noise: float = 0.01) -> tuple[Array, Array]:
    """ln of speed per opening beside the others' and of the command likewise, each (windows, wheels): straight, to the left, straight, to the right."""
    rng = np.random.default_rng(3)
    turn = turns * np.sin(np.linspace(0.0, 4.0 * np.pi, WINDOWS)) ** 3
    asked = turn[:, np.newaxis] * SIDES
    usual = np.array([0.02, -0.03, 0.0, 0.04])
    return usual + slope * asked + noise * rng.standard_normal(asked.shape), asked


def found(log: Array, asked: Array) -> float:
    """Their slope, of a mission that drives forward."""
    return turn_slope(log, asked, np.ones(log.shape, np.bool_))


@pytest.mark.parametrize("slope", [-0.12, 0.2, 0.7])
def test_the_slope_that_all_wheels_have_is_found(slope: float) -> None:
    assert found(*driven(slope)) == pytest.approx(slope, abs=0.02)


def test_both_ways_of_driving_have_their_own_intercept() -> None:
    log, asked = driven(0.4)
    ahead = np.ones(log.shape, np.bool_)
    ahead[::2] = False
    assert turn_slope(np.where(ahead, log, log - 0.5), asked, ahead) == pytest.approx(0.4, abs=0.02)


def test_a_fault_of_one_wheel_is_outvoted() -> None:
    log, asked = driven(0.4)
    log[:, 2] -= np.where(asked[:, 2] > 0.05, 0.29, 0.0)  # which loses a quarter whenever it is outside
    assert found(log, asked) == pytest.approx(0.4, abs=0.02)


def test_wheels_that_disagree_have_none() -> None:
    log, asked = driven(0.0)
    assert found(log + np.array([0.4, -0.4, 0.1, 0.0]) * asked, asked) == 0.0


def test_speeds_that_are_exchanged_across_the_machine_are_no_slope_of_turns() -> None:
    log, asked = driven(-2.0)
    assert found(log, asked) == 0.0


def test_what_hardly_turns_and_what_gains_nothing_has_none() -> None:
    assert found(*driven(0.4, turns=0.02)) == 0.0
    assert found(*driven(0.0)) == 0.0
    log, asked = driven(0.4)
    assert found(log[:, :2], asked[:, :2]) == 0.0
    assert found(log, np.full(log.shape, np.nan)) == 0.0
