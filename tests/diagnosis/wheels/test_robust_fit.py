"""Least trimmed squares: normal equations and solutions against numpy and scipy, and windows of which most are spoiled."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.optimize import nnls

from diagnosis.wheels.robust_fit import Normal, misfits, normal_equations, solve, trimmed

LENGTH, WINDOWS = 25, 120
TRUE = np.array([1.5, 0.0, 0.7])
FLOOR = 0.05
Array = np.ndarray
NONE = np.zeros((3, 3))


def data(seed: int = 1, noise: float = 0.01) -> tuple[Array, Array]:
    rng = np.random.default_rng(seed)
    x = rng.uniform(0.0, 1.0, size=(WINDOWS * LENGTH + 7, 3))
    return x, x @ TRUE + noise * rng.normal(size=len(x))


def windows(x: Array, y: Array, use: Array | None = None) -> Normal:
    return normal_equations(x, y, np.ones(y.size, dtype=np.bool_) if use is None else use, LENGTH)


def test_normal_equations_are_sums_over_windows() -> None:
    x, y = data()
    use = np.random.default_rng(2).random(y.size) < 0.8
    got = windows(x, y, use)
    assert got.samples.size == WINDOWS  # what is left of the last one is no window
    for w in (0, 17, WINDOWS - 1):
        part = np.flatnonzero(use[w * LENGTH : (w + 1) * LENGTH]) + w * LENGTH
        assert_allclose(got.gram[w], x[part].T @ x[part])
        assert_allclose(got.moment[w], x[part].T @ y[part])
        assert got.power[w] == pytest.approx(float(y[part] @ y[part]))
        assert got.samples[w] == part.size
    few = got.part(np.array([3, 5]))
    assert_array_equal(few.gram, got.gram[[3, 5]])


def test_solution_is_that_of_all_samples() -> None:
    x, y = data()
    n = WINDOWS * LENGTH
    got = solve(windows(x, y), NONE)
    assert_allclose(got, nnls(x[:n], y[:n])[0], atol=1e-6)
    # where no coefficient wants to be negative, that is ordinary least squares
    inside = y + 0.5 * x[:, 1]
    ordinary = np.linalg.lstsq(x[:n], inside[:n])[0]
    assert ordinary.min() > 0
    assert_allclose(solve(windows(x, inside), NONE), ordinary, atol=1e-6)
    # where one does, it is nothing instead
    against = y - 0.5 * x[:, 1]
    bound = solve(windows(x, against), NONE)
    assert_allclose(bound, nnls(x[:n], against[:n])[0], atol=1e-6)
    assert bound[1] == 0.0


def test_ridge_pulls_towards_what_is_given() -> None:
    x, y = data()
    n = WINDOWS * LENGTH
    penalty, prior = np.diag([0.5, 0.0, 2.0]), np.array([3.0, 0.0, 0.1])
    rows = np.vstack([x[:n], np.sqrt(n * penalty)])
    aim = np.r_[y[:n], np.sqrt(n * np.diag(penalty)) * prior]
    assert_allclose(solve(windows(x, y), penalty, prior), nnls(rows, aim)[0], atol=1e-6)
    rows_to_zero = np.r_[y[:n], np.zeros(3)]
    assert_allclose(solve(windows(x, y), penalty), nnls(rows, rows_to_zero)[0], atol=1e-6)


def test_misfit_is_what_a_window_leaves_over_its_own_size() -> None:
    x, y = data(noise=0.1)
    x[:LENGTH] = 0.0
    y[:LENGTH] = 0.02
    w, values = windows(x, y), np.array([1.4, 0.1, 0.7])
    got = misfits(w, values, FLOOR)
    for k in (0, 1, 60):
        part = slice(k * LENGTH, (k + 1) * LENGTH)
        left = np.mean((y[part] - x[part] @ values) ** 2)
        assert got[k] == pytest.approx(left / max(np.mean(y[part] ** 2), FLOOR**2))
    assert got[0] == pytest.approx(0.02**2 / FLOOR**2)  # hardly any motion: the floor counts


@pytest.mark.parametrize("seed", range(5))
def test_most_windows_may_be_spoiled(seed: int) -> None:
    x, y = data(seed)
    rng = np.random.default_rng(100 + seed)
    spoiled = rng.choice(WINDOWS, round(0.6 * WINDOWS), replace=False)
    for k in spoiled:
        part = slice(k * LENGTH, (k + 1) * LENGTH)
        kind = rng.integers(3)
        y[part] = (rng.uniform(0.0, 0.8) * y[part], np.full(LENGTH, rng.uniform(-1, 1)), y[part] + rng.normal())[kind]
    w = windows(x, y)
    got = trimmed(w, NONE, 0.3, FLOOR, starts=16)
    assert_allclose(got.values, TRUE, atol=0.02)
    assert not set(got.chosen) & set(spoiled)
    assert got.chosen.size == round(0.3 * WINDOWS)
    assert got.score == pytest.approx(misfits(w, got.values, FLOOR)[got.chosen].mean(), rel=0.05)
    assert np.median(got.misfit[spoiled]) > 20 * got.score
    # all windows together say something else
    assert np.abs(solve(w, NONE) - TRUE).max() > 0.1


def test_a_run_gives_what_another_gave() -> None:
    w = windows(*data(noise=0.3))
    first, second = (trimmed(w, NONE, 0.5, FLOOR, starts=4) for _ in range(2))
    assert_array_equal(first.values, second.values)
    assert_array_equal(first.chosen, second.chosen)


def test_a_start_that_is_given_is_used() -> None:
    """Two halves that obey different laws: the windows to start from decide, where chance has no say."""
    x, y = data()
    half = WINDOWS // 2 * LENGTH
    y[:half] = x[:half] @ [0.2, 1.0, 0.0]
    got = trimmed(windows(x, y), NONE, 0.4, FLOOR, starts=0, given=np.arange(WINDOWS // 2, WINDOWS))
    assert_allclose(got.values, TRUE, atol=0.02)
    other = trimmed(windows(x, y), NONE, 0.4, FLOOR, starts=0, given=np.arange(WINDOWS // 2))
    assert_allclose(other.values, [0.2, 1.0, 0.0], atol=0.02)


def test_few_windows_are_all_used() -> None:
    x, y = data()
    w = windows(x[: 5 * LENGTH], y[: 5 * LENGTH])
    got = trimmed(w, NONE, 0.3, FLOOR, starts=3)
    assert_array_equal(np.sort(got.chosen), np.arange(5))
    assert_allclose(got.values, TRUE, atol=0.03)
