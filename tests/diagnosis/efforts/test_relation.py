"""Relation of efforts and motion on made-up steps."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.efforts.relation import Shares, fitted, held_share, largest_off, usual_of
from diagnosis.efforts.windows import EffortSteps

LEAST = 0.05
THETA = np.array([0.1, 3.0, 0.8, 5.0, 1.5, -0.6])


def steps_of(seed: int, n: int = 300, wheels: int = 4) -> EffortSteps:
    rng = np.random.default_rng(seed)
    speed = np.repeat(rng.uniform(0.3, 1.0, n // 10) * rng.choice([-1, 1], n // 10), 10)[:, np.newaxis]
    speed = speed + np.repeat(rng.uniform(-0.2, 0.2, n // 10), 10)[:, np.newaxis] * np.where(
        np.arange(wheels) % 2, 1, -1
    )
    rate = rng.normal(0.0, 0.3, speed.shape)
    made = EffortSteps(
        speed, speed, rate, speed - speed.mean(axis=1, keepdims=True), np.ones(speed.shape, bool), 10, speed
    )
    effort = np.column_stack([made.terms(i, LEAST) @ THETA for i in range(wheels)])
    slope = np.repeat(rng.normal(0.0, 0.6, n // 20), 20)[:, np.newaxis]
    return made._replace(effort=effort + slope + rng.normal(0.0, 0.1, effort.shape))


def shares_of(steps: EffortSteps, theta: np.ndarray = THETA) -> Shares:
    m = steps.effort.shape[1]
    expected = np.column_stack([steps.terms(i, LEAST) @ theta for i in range(m)])
    return Shares(
        steps.effort - expected, expected, steps.use, [usual_of(steps.effort[:, i], steps.use[:, i]) for i in range(m)]
    )


def test_coefficients_are_found_among_steps_that_do_not_fit() -> None:
    steps = steps_of(1)
    effort = steps.terms(0, LEAST) @ THETA
    effort[::20] += 40.0
    found = fitted(steps.terms(0, LEAST), effort, steps.use[:, 0])
    assert found is not None
    assert steps.terms(0, LEAST) @ found == pytest.approx(steps.terms(0, LEAST) @ THETA, abs=0.15)


def test_too_little_driving_has_no_relation() -> None:
    steps = steps_of(1)
    use = steps.use[:, 0].copy()
    use[10:] = False
    assert fitted(steps.terms(0, LEAST), steps.effort[:, 0], use) is None


def test_slopes_that_all_wheels_feel_are_nobodys() -> None:
    assert largest_off(shares_of(steps_of(2)), (6, 15, 60)).max() < 0.06


@pytest.mark.parametrize("loss", [0.25, 0.5])
def test_torque_that_is_lost_takes_more_effort_of_its_own_wheel_alone(loss: float) -> None:
    steps = steps_of(3)
    steps.effort[100:180, 2] /= 1.0 - loss
    shares = shares_of(steps)
    found, first, last = shares.over(2, 15)
    inside = (first >= 100) & (last <= 180)
    expected = loss / (1.0 - loss)
    assert 0.5 * expected < np.median(found[inside]) < 1.1 * expected
    assert np.abs(found[(last <= 100) | (first >= 180)]).max() < 0.1
    assert all(np.abs(shares.over(i, 15)[0]).max() < 0.1 for i in (0, 1, 3))


def test_a_brake_takes_more_and_a_dead_motor_less() -> None:
    steps = steps_of(4)
    steps.effort[:150, 0] += 2.0 * np.sign(steps.speed[:150, 0])
    steps.effort[150:, 1] = 0.0
    shares = shares_of(steps)
    assert shares.over(0, 15)[0].max() > 0.3
    assert shares.over(1, 15)[0].min() < -0.5


def test_only_a_loop_with_memory_holds_what_command_and_error_do_not_make() -> None:
    rng = np.random.default_rng(5)
    n = 600
    command = np.repeat(rng.uniform(0.3, 1.0, n // 20), 20)
    load = np.repeat(rng.normal(0.0, 1.0, n // 30), 30)
    use = np.ones(n, bool)
    assert held_share(4.0 * command + 0.5, command, command - 0.05 * load, use) < 0.01
    error = 0.1 * load + rng.normal(0.0, 0.001, n)
    assert held_share(4.0 * command + 10.0 * error, command, command - error, use) < 0.01
    settled = rng.normal(0.0, 0.005, n)
    assert held_share(4.0 * command + load, command, command - settled, use) > 0.1
