"""Responses of drives whose controller limits how fast the body drives and how fast it turns each for itself."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.response.following import followed
from diagnosis.response.identification import Response, as_another, identify_response
from tests.campaigns import campaign

Array = NDArray[np.float64]

H = 0.05
WEIGHTS, BOUNDS, RATES = np.array([1.0, 0.3]), np.array([0.8, 0.45]), np.array([1.5, 0.5])


def steps(seed: int, seconds: float = 300.0) -> Array:
    """Commands of a body that change every six seconds, many of them faster than it goes; columns [m/s] and [rad/s]."""
    rng = np.random.default_rng(seed)
    count = round(seconds / 6.0)
    asked = np.column_stack([rng.uniform(-0.9, 0.9, count), rng.uniform(-6.0, 6.0, count)])
    return np.repeat(asked, round(6.0 / H), axis=0)


def wheel(commands: Array, side: float, seed: int = 1) -> Array:
    """What a wheel makes of them [m/s]; `side` 1: right, -1: left."""
    parts = WEIGHTS * [1.0, side], BOUNDS, RATES
    y = followed(commands, parts, np.inf, 6.0, (0.2, np.inf), H)
    return np.asarray(y + np.random.default_rng(seed).normal(0.0, 0.01, y.size))


def found(seed: int) -> tuple[Array, Array, Response]:
    commands = steps(seed)
    y = wheel(commands, 1.0)
    response = identify_response(y, commands, H, 0.05)
    assert response is not None
    return commands, y, response


@pytest.mark.parametrize("seed", campaign([1, 2, 3]))
def test_limits_of_driving_and_turning_are_found(seed: int) -> None:
    _, y, response = found(seed)
    assert response.bounds[1] == pytest.approx(BOUNDS[1], rel=0.1)
    assert response.weights == pytest.approx(WEIGHTS, rel=0.15)
    assert np.quantile(np.abs(y - response.expected), 0.9) < 0.06
    assert response.rate == pytest.approx(response.rates.sum())


def test_a_turn_faster_than_the_machine_goes_is_no_loss() -> None:
    commands, y, response = found(4)
    fast = np.abs(commands[:, 1]) * WEIGHTS[1] > 2.0 * BOUNDS[1]
    off = np.maximum(response.low - y, y - response.high) / response.noise
    assert np.mean(off[fast] > 3.0) < 0.03


def test_another_wheel_is_limited_alike() -> None:
    commands, _, response = found(5)
    left = as_another(response, commands, np.array([1.0, -1.0]), H)
    assert np.quantile(np.abs(wheel(commands, -1.0) - left.expected), 0.9) < 0.06


def test_what_limits_leave_compares_wheels() -> None:
    commands, _, response = found(6)
    assert abs(response.left(commands)[1]) < 0.7 * abs(response.weights[1])


def test_commands_within_the_limits_need_none() -> None:
    commands = steps(7) * [0.5, 0.2]
    y = followed(commands, (WEIGHTS, np.full(2, np.inf), np.full(2, np.inf)), 5.0, 6.0, (0.2, 3.0), H)
    response = identify_response(y, commands, H, 0.05)
    assert response is not None
    assert np.isinf(response.bounds).all()
    assert response.weights == pytest.approx(WEIGHTS, rel=0.05)
