"""Speed at which a wheel rolls by the others and by sensors of the body."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.wheels.shared_kernel import with_sensors

LEAST = 0.008


def test_without_sensors_the_others_count_alone() -> None:
    assert with_sensors(0.3, 0.02, np.nan, np.nan, LEAST) == (0.3, 0.02)


def test_without_others_the_sensors_count_alone() -> None:
    assert with_sensors(np.nan, 0.0, 0.25, 0.03, LEAST) == (0.25, 0.03)


def test_both_weigh_by_their_variances() -> None:
    body, doubt = with_sensors(0.30, 0.012, 0.28, 0.03, LEAST)
    precision = np.array([1 / (0.012 + LEAST) ** 2, 1 / 0.03**2])
    assert body == pytest.approx((precision * [0.30, 0.28]).sum() / precision.sum())
    assert doubt == pytest.approx(precision.sum() ** -0.5)


def test_where_they_contradict_each_other_the_sensor_is_believed() -> None:
    assert with_sensors(0.30, 0.001, 0.15, 0.02, LEAST) == (0.15, 0.02)
