"""What is usual: the shortest half, and a fit that a third of faulty rows does not move."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from diagnosis.wheels.frames.deviations import shorth, usual_weights


@pytest.mark.parametrize("share", [0.0, 0.2, 0.45])
def test_the_shortest_half_is_that_of_the_healthy(share: float) -> None:
    rng = np.random.default_rng(3)
    x = rng.normal(0.3, 0.02, 4000)
    x[: round(share * x.size)] = rng.uniform(1.0, 5.0, round(share * x.size))
    middle, width = shorth(x)
    assert middle == pytest.approx(0.3, abs=0.012)
    assert 0.015 < width < 0.05


def test_the_shortest_half_by_a_loop() -> None:
    x = np.random.default_rng(5).normal(size=101)
    s = np.sort(x)
    best = min(range(len(s) - 50), key=lambda k: s[k + 50] - s[k])
    assert shorth(np.r_[x, np.nan]) == pytest.approx((0.5 * (s[best] + s[best + 50]), (s[best + 50] - s[best]) / 1.35))
    assert shorth(np.zeros(3)) == (0.0, 1.0)


def test_a_third_of_faulty_rows_does_not_move_what_is_usual() -> None:
    rng = np.random.default_rng(7)
    basis = np.column_stack([rng.uniform(-1, 1, 3000), np.ones(3000)])
    x = basis @ [0.4, 0.05] + 0.005 * rng.normal(size=3000)
    x[:1000] += 0.5
    assert_allclose(usual_weights(x, basis), [0.4, 0.05], atol=0.003)
    assert_allclose(usual_weights(x[:10], basis[:10]), 0.0)  # too few rows
