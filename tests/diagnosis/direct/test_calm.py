"""Which steady row leaves hardly anything of a deviation."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.direct.calm import calm_row, is_one_value
from diagnosis.estimation.fault_models import INEFFICIENT, STUCK

T = np.arange(4000) * 0.01
X = 0.8 * np.sin(0.7 * T)


@pytest.mark.parametrize(
    ("y", "row"),
    [
        (0.3 * X + 0.01 * np.cos(40.0 * T), INEFFICIENT),
        (-0.2 + 0.005 * np.cos(40.0 * T), STUCK),
        (0.6 * X + 0.15 * np.cos(40.0 * T), None),
        (X + 0.1, None),
        (1.4 * X, None),
        (0.5 * X - 0.008 + 0.08 * (np.abs(np.sin(3.0 * T)) < 0.05), INEFFICIENT),
    ],
)
def test_the_steady_row_that_leaves_hardly_anything(y: np.ndarray, row: int | None) -> None:
    assert calm_row(y, X, 0.02, 0.01) == row


def test_a_reference_that_is_nothing_tells_nothing() -> None:
    assert calm_row(X, np.zeros_like(X), 0.02) is None


@pytest.mark.parametrize(
    ("y", "one"), [(0.31 + 0.002 * np.cos(40.0 * T), True), (0.27 + 0.02 * X, False), (T[:0], False)]
)
def test_one_value_beside_a_reference_that_rests(y: np.ndarray, one: bool) -> None:
    assert is_one_value(y, np.full(y.size, 0.25), 0.05) is one
