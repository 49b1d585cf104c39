"""Trend of ε: closed forms, invariances, repairs, outliers, and no forecast without ground."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from diagnosis.audit.trends.line import LEAST_SIGMA, fit_line, sigmas
from diagnosis.audit.trends.trend import Series, Trend, trend_of

RNG = np.random.default_rng


def series(value: list[float] | np.ndarray, half: float = 0.01, x: np.ndarray | None = None) -> Series:
    y = np.asarray(value, dtype=np.float64)
    x = np.arange(len(y)) + 0.5 if x is None else x
    return Series(x, y, y - half, y + half, float(len(y)))


def wear(n: int, slope: float, level: float = 0.01, scatter: float = 0.004, seed: int = 0) -> np.ndarray:
    return level + slope * (np.arange(n) + 0.5) + scatter * RNG(seed).standard_normal(n)


def test_line_is_that_of_the_normal_equations() -> None:
    rng = RNG(3)
    x, sigma = rng.uniform(0, 9, 12), rng.uniform(0.01, 0.05, 12)
    y = 0.1 + 0.02 * x + sigma * rng.standard_normal(12)
    line = fit_line(x, y, sigma)
    w = np.diag(1 / (sigma**2 + line.tau**2))
    design = np.column_stack([np.ones(12), x])
    cov = np.linalg.inv(design.T @ w @ design)
    coefficients = cov @ design.T @ w @ y
    rest = y - design @ coefficients
    q = max(1.0, float(rest @ w @ rest) / 10)
    at = np.array([1.0, 4.0])
    assert line.at(4.0) == pytest.approx(at @ coefficients)
    assert line.half(4.0, 0.95) == pytest.approx(2.228139 * math.sqrt(q * at @ cov @ at), rel=1e-6)
    assert line.slope_var == pytest.approx(q * cov[1, 1])


def test_spread_between_missions_is_that_of_paule_and_mandel() -> None:
    rng = RNG(5)
    x, sigma = np.arange(40.0), rng.uniform(0.005, 0.02, 40)
    y = 0.02 * rng.standard_normal(40) + sigma * rng.standard_normal(40)
    line = fit_line(x, y, sigma)
    w = 1 / (sigma**2 + line.tau**2)
    design = np.column_stack([np.ones(40), x]) * np.sqrt(w)[:, None]
    rest = np.linalg.lstsq(design, y * np.sqrt(w), rcond=None)[1]
    assert float(rest[0]) == pytest.approx(38.0, rel=1e-4)
    assert 0.012 < line.tau < 0.03


def test_equal_scatter_gives_the_interval_of_ordinary_regression() -> None:
    """With bounds far below the scatter the fit is ordinary least squares; its slope interval in closed form."""
    y = wear(20, 0.003, scatter=0.01, seed=2)
    x = np.arange(20) + 0.5
    line = fit_line(x, y, np.full(20, LEAST_SIGMA))
    d = x - x.mean()
    slope = float(d @ y / (d @ d))
    rest = y - y.mean() - slope * d
    assert line.slope == pytest.approx(slope)
    assert line.slope_var == pytest.approx(float(rest @ rest) / 18 / float(d @ d), rel=1e-5)


def test_crossing_is_where_the_bounds_meet_the_limit() -> None:
    t = trend_of(series(wear(20, 0.003)), 0.1)
    line, f = t.line, t.forecast
    assert line is not None
    assert f.state == "crossing"
    assert f.likely is not None
    assert f.latest is not None
    assert line.at(20 + f.likely) == pytest.approx(0.1)
    assert line.at(20 + f.latest) - line.half(20 + f.latest, 0.9) == pytest.approx(0.1)
    assert f.soonest is not None
    assert f.soonest < f.likely < f.latest


def test_ninety_per_cent_of_intervals_hold_the_truth() -> None:
    rng = RNG(17)
    right = 0
    for _ in range(400):
        n = int(rng.integers(6, 30))
        sigma = rng.uniform(0.004, 0.02, n)
        x = np.cumsum(rng.uniform(0.2, 1.5, n))
        truth = float(x[-1] * rng.uniform(1.05, 1.8))
        y = 0.1 * x / truth + 0.008 * rng.standard_normal(n) + sigma * rng.standard_normal(n)
        soonest, _, latest = fit_line(x, y, sigma).crossing(0.1, float(x[-1]), 0.9)
        right += soonest <= truth <= latest
    assert 0.85 <= right / 400 <= 0.95


@settings(max_examples=40, deadline=None)
@given(
    st.integers(0, 10_000),
    st.integers(3, 40),
    st.floats(-1e4, 1e4),
    st.sampled_from([1.0, 3600.0, 1 / 24.0, 7.3]),
)
def test_origin_and_unit_of_time_do_not_matter(seed: int, n: int, shift: float, unit: float) -> None:
    rng = RNG(seed)
    half = rng.uniform(0.005, 0.05, n)
    y = 0.01 + 0.004 * np.arange(n) + half * rng.standard_normal(n) / 2
    x = np.cumsum(rng.uniform(0.1, 2.0, n))
    a = trend_of(Series(x, y, y - half, y + half, float(x[-1])), 0.1)
    moved = x * unit + shift
    b = trend_of(Series(moved, y, y - half, y + half, float(moved[-1])), 0.1)
    assert (a.forecast.state, a.first, a.outliers, a.direction) == (b.forecast.state, b.first, b.outliers, b.direction)
    for name in ("soonest", "likely", "latest", "horizon"):
        one, two = getattr(a.forecast, name), getattr(b.forecast, name)
        assert (one is None) == (two is None)
        assert one is None or two == pytest.approx(one * unit, rel=1e-4, abs=1e-6 * unit)


def changes(t: Trend) -> list[tuple[int, str]]:
    return [(c.index, c.kind) for c in t.changes]


def test_one_mission_off_the_line_is_set_aside() -> None:
    y = wear(20, 0.003)
    y[8] += 0.3
    plain, odd = trend_of(series(wear(20, 0.003)), 0.1), trend_of(series(y), 0.1)
    assert odd.outliers == (8,)
    assert plain.line is not None
    assert odd.line is not None
    assert odd.line.slope == pytest.approx(plain.line.slope, rel=0.1)
    assert changes(odd) == []


def test_a_repair_starts_the_trend_anew() -> None:
    y = np.concatenate([wear(14, 0.012, 0.02), wear(10, 0.004, 0.01, seed=1)])
    t = trend_of(series(y), 0.1)
    assert changes(t) == [(14, "drop")]
    assert t.first == 14
    assert t.line is not None
    assert t.line.slope == pytest.approx(0.004, abs=0.001)
    assert t.changes[0].size == pytest.approx(-0.17, abs=0.05)


def test_a_rise_that_stays_starts_it_anew_too() -> None:
    y = np.concatenate([wear(12, 0.0), wear(8, 0.0, 0.07, seed=1)])
    t = trend_of(series(y), 0.1)
    assert changes(t) == [(12, "rise")]
    assert t.direction == "steady"


def test_wear_that_begins_late_is_not_averaged_with_what_was_before() -> None:
    y = wear(30, 0.0)
    y[18:] += 0.006 * np.arange(12)
    t = trend_of(series(y), 0.1)
    assert changes(t) == [(pytest.approx(18, abs=2), "bend")]
    assert t.line is not None
    assert t.line.slope == pytest.approx(0.006, abs=0.0015)


@pytest.mark.parametrize(
    ("value", "state", "words"),
    [
        ([], "not_known", "no mission"),
        ([0.05], "not_known", "1 mission, 5 are needed"),
        ([0.05] * 4, "not_known", "4 missions, 5 are needed"),
        ([*wear(12, 0.001), 0.5], "not_known", "last mission deviates from the trend"),
        ([*wear(12, 0.012, 0.02), 0.01, 0.012, 0.009], "not_known", "3 missions since the drop"),
        (list(wear(12, 0.0)), "not_within", ""),
        (list(wear(12, 0.012, 0.02)), "above", ""),
        ([0.3] * 8, "above", ""),
    ],
)
def test_no_forecast_without_ground(value: list[float], state: str, words: str) -> None:
    f = trend_of(series(value), 0.1).forecast
    assert f.state == state
    assert words in f.why
    assert f.soonest is f.likely is f.latest is None


def test_missions_at_one_place_give_no_line() -> None:
    t = trend_of(series([0.05] * 6, x=np.full(6, 2.0)), 0.1)
    assert t.line is None
    assert "do not differ in driving time" in t.forecast.why


def test_uncertain_missions_give_an_open_interval() -> None:
    f = trend_of(series(wear(8, 0.004, scatter=0.02, seed=4), half=0.08), 0.1).forecast
    assert f.state == "crossing"
    assert f.latest is None


def test_the_wider_half_of_the_bounds_counts() -> None:
    one = np.ones(1)
    assert sigmas(0.1 * one, 0.0 * one, 0.3 * one) == pytest.approx(0.2 / 1.96, rel=1e-4)
    assert sigmas(one, one, one) == pytest.approx(LEAST_SIGMA)
