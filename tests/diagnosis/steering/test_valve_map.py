"""The valve's map: its kinks, its mean over an uncertain opening, and the way back."""

from __future__ import annotations

import math

import numpy as np
import pytest

from diagnosis.steering.valve_map import ValveMap, _beyond, expected_rate, opening_for, rate_at, rates_at

VALVE = ValveMap(4.0, 5.0, 0.02, 0.03, 0.25, 0.2)


@pytest.mark.parametrize(
    ("u", "rate"), [(0.0, 0.0), (0.02, 0.0), (-0.03, 0.0), (0.03, 0.04), (-0.05, -0.1), (0.5, 0.25), (-0.5, -0.2)]
)
def test_rate_has_a_dead_band_a_slope_and_a_limit_of_each_direction(u: float, rate: float) -> None:
    assert rate_at(u, VALVE) == pytest.approx(rate)
    assert rates_at(np.array([u]), VALVE)[0] == pytest.approx(rate)


@pytest.mark.parametrize("u", [-0.2, -0.05, -0.03, 0.0, 0.01, 0.04, 0.09])
@pytest.mark.parametrize("std", [0.003, 0.02, 0.1])
def test_expected_rate_is_the_mean_over_draws(u: float, std: float) -> None:
    draws = u + std * np.random.default_rng(3).normal(size=400_000)
    mean, slope = expected_rate(u, std, VALVE)
    assert mean == pytest.approx(rates_at(draws, VALVE).mean(), abs=4e-4)
    moved = rates_at(draws + 1e-4, VALVE).mean() - rates_at(draws - 1e-4, VALVE).mean()
    assert slope == pytest.approx(moved / 2e-4, abs=0.03)


@pytest.mark.parametrize("u", [0.0, -0.3, 0.017, 1.0])
def test_what_lies_far_from_an_edge_is_the_same_to_the_last_bit(u: float) -> None:
    far = np.concatenate(
        [np.linspace(-60.0, 60.0, 4801), np.array([8.999, 9.001, 38.999, 39.001]), -np.geomspace(1, 1e9, 50)]
    )
    for std in (2e-7, 0.003, 0.1, 2.0):
        for z in far:
            edge = u - z * std
            d = (u - edge) / std
            above = 0.5 * (1.0 + math.erf(d / math.sqrt(2.0)))
            mean = (u - edge) * above + std * math.exp(-0.5 * d * d) / math.sqrt(2.0 * math.pi)
            assert _beyond.py_func(u, std, edge) == (mean, above)
            assert _beyond(u, std, edge) == (mean, above)


@pytest.mark.parametrize("rate", [-0.19, -0.01, 0.05, 0.24])
def test_opening_for_a_rate_gives_it(rate: float) -> None:
    assert rate_at(opening_for(rate, VALVE), VALVE) == pytest.approx(rate)


def test_opening_at_rest_is_none_and_at_the_limit_the_smallest() -> None:
    assert opening_for(0.0, VALVE) == 0.0
    assert opening_for(0.3, VALVE) == pytest.approx(0.02 + 0.25 / 4.0)
