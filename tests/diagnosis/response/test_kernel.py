"""The compiled recursions against scipy and against the sum over all paths."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from scipy.signal import lfilter

from diagnosis.response.kernel import follow, posterior, target


def test_a_drive_without_limits_is_a_first_order_lag() -> None:
    target = np.random.default_rng(1).normal(size=300)
    gain = 0.2
    expected = lfilter([gain], [1.0, gain - 1.0], target)
    assert follow(target, 0.0, gain, np.inf) == pytest.approx(expected, abs=1e-12)


def test_no_step_is_larger_than_the_rate_allows() -> None:
    target = np.repeat([0.0, 1.0, -1.0], 100)
    assert np.max(np.abs(np.diff(follow(target, 0.0, 0.9, 0.05)))) <= 0.05 + 1e-12


@pytest.mark.parametrize("delay", [0.0, 0.4, 3.0, 7.7, 60.0, -1.3])
@pytest.mark.parametrize(("bounds", "limit"), [([np.inf, np.inf], np.inf), ([0.8, 0.3], 0.9)])
def test_a_target_is_what_is_asked_within_its_limits_and_late(delay: float, bounds: list[float], limit: float) -> None:
    commands, weights = np.random.default_rng(2).normal(size=(50, 2)), np.array([1.2, -0.7])
    most = np.array(bounds)
    asked = np.clip(np.clip(commands * weights, -most, most).sum(axis=1), -limit, limit)
    expected = np.interp(np.arange(50) - delay, np.arange(50), asked)
    assert target(commands, weights, most, limit, delay) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_the_posterior_is_the_sum_over_all_paths(seed: int) -> None:
    rng = np.random.default_rng(seed)
    blocks, states = 5, 3
    score = rng.normal(scale=2.0, size=(blocks, states))
    enters, leaves = rng.uniform(0.05, 0.3, (2, blocks))
    expected = np.zeros((blocks, states))
    for path in product(range(states), repeat=blocks):
        weight = 1.0
        for k, m in enumerate(path):
            before = 0 if k == 0 else path[k - 1]
            if before == 0:
                move = 1.0 - enters[k] if m == 0 else enters[k] / (states - 1)
            elif m == 0:
                move = leaves[k]
            else:
                move = (1.0 - leaves[k]) * (m == before)
            weight *= move * np.exp(score[k, m])
        expected[np.arange(blocks), path] += weight
    expected /= expected.sum(axis=1, keepdims=True)
    assert posterior(score, enters, leaves) == pytest.approx(expected, abs=1e-9)
