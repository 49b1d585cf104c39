"""What is stated of the size of a run's fault."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.wheels.estimates import estimate
from diagnosis.wheels.models import A_NONE, A_STUCK, S_NONE, WheelFilterModel

MODEL = WheelFilterModel(
    K=0.5, tau=0.3, noise=0.01, constant_noise=0.001, rounding=0.001, load=0.02, span=0.4, valve_span=0.15
)


@pytest.mark.parametrize(("std", "half"), [(0.001, 0.1425), (0.2, 1.96 * 0.2 / 0.5)])
def test_an_opening_that_only_a_wheel_tells_is_no_surer_than_the_ground_lets_it_be(std: float, half: float) -> None:
    """Of valves that stuck on simulated ground 3 of 22 openings were within what the model's own covariance gives."""
    z, P = np.array([0.05, 1.0, 0.0, 0.05]), np.diag([0.0, 0.0, 0.0, std**2])
    epsilon, sat = estimate(A_STUCK, np.zeros(5), z, P, MODEL)
    assert epsilon is not None
    assert sat is not None
    assert (epsilon.value, sat.mean) == (1.0, pytest.approx(0.1))
    assert (sat.low, sat.high) == (pytest.approx(0.1 - half), pytest.approx(0.1 + half))


def test_a_valve_that_gives_nothing_rests_at_nothing() -> None:
    _, sat = estimate(A_NONE, np.zeros(5), np.zeros(4), np.zeros((4, 4)), MODEL)
    assert sat is not None
    assert sat.mean == 0.0


def test_a_silent_sensor_reads_what_it_reads_for_most_of_its_time() -> None:
    y = np.r_[np.zeros(80), np.full(10, 0.18)]  # it came back before the end of the run
    _, sat = estimate(S_NONE, y, np.zeros(4), np.zeros((4, 4)), MODEL)
    assert sat is not None
    assert sat.mean == 0.0
