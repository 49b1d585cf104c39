"""A gyro and the heading of odometry that part are told, with what the command says of them; where they agree nothing is."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.response.heading import agree, contradictions

BLOCK_S = 0.25
N = 600
PART = slice(300, 360)


def rates(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of gyro and odometry, and the commanded one, half a second before."""
    rng = np.random.default_rng(seed)
    asked = np.repeat(rng.uniform(-0.6, 0.6, N // 12), 12)
    turned = np.r_[np.zeros(2), asked[:-2]]
    gyro = turned + 0.02 + rng.normal(0.0, 0.01, N)
    return gyro, 1.05 * turned + rng.normal(0.0, 0.01, N), asked


@pytest.mark.parametrize("seed", range(5))
def test_two_that_agree_are_told_nothing_of(seed: int) -> None:
    assert contradictions(*rates(seed), BLOCK_S) == ()


@pytest.mark.parametrize("gain", [0.0, 0.4, 1.9])
def test_a_gyro_that_leaves_command_and_odometry_may_be_wheels_that_slip(gain: float) -> None:
    gyro, odometry, asked = rates(1)
    gyro[PART] *= gain
    (found,) = contradictions(gyro, odometry, asked, BLOCK_S)
    assert found.start == pytest.approx(PART.start, abs=12)
    assert found.stop == pytest.approx(PART.stop, abs=12)
    assert "Odometry does as the command has it turn: the gyro is wrong, or the wheels slip" in found.said.text


def test_a_heading_that_leaves_command_and_gyro_is_odometrys() -> None:
    gyro, odometry, asked = rates(2)
    odometry[PART] *= 0.3
    (found,) = contradictions(gyro, odometry, asked, BLOCK_S)
    assert "the heading of odometry is wrong" in found.said.text


def test_without_a_command_nobody_is_told() -> None:
    gyro, odometry, _ = rates(3)
    gyro[PART] = 0.0
    (found,) = contradictions(gyro, odometry, None, BLOCK_S)
    assert "cannot be told" in found.said.text


def test_what_was_never_alike_says_nothing() -> None:
    gyro, _, asked = rates(4)
    assert contradictions(gyro, np.random.default_rng(0).normal(0.0, 0.3, N), asked, BLOCK_S) == ()


def test_a_heading_that_has_what_the_gyro_has_acquits_it() -> None:
    gyro, odometry, _ = rates(5)
    wheels = odometry.copy()
    wheels[PART] = 2.0
    assert agree(gyro, odometry, wheels, PART)
    assert not agree(gyro, wheels, wheels, PART)
