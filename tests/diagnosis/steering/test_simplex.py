"""The simplex search takes the same steps as SciPy's."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from scipy.optimize import minimize as oracle

from diagnosis.steering.simplex import minimize
from tests.campaigns import campaign


def rosenbrock(x: np.ndarray) -> float:
    return float(np.sum(100 * (x[1:] - x[:-1] ** 2) ** 2 + (1 - x[:-1]) ** 2))


def steps(x: np.ndarray) -> float:
    return float(np.round(np.abs(x).sum(), 1))


def valley(x: np.ndarray) -> float:
    return float(abs(x[0] * x[1] - 2) + 0.01 * x @ x)


@pytest.mark.parametrize("function", [rosenbrock, steps, valley])
@pytest.mark.parametrize("calls", [2, 5, 17, 45, 46, 47, 400])
@pytest.mark.parametrize("seed", campaign(range(5)))
def test_same_calls_and_result_as_scipy(function: object, calls: int, seed: int) -> None:
    start = np.random.default_rng(seed).normal(size=(4, 3)) * 2
    asked: list[list[np.ndarray]] = [[], []]

    def noted(kind: int) -> object:
        def call(x: np.ndarray) -> float:
            asked[kind].append(x.copy())
            return function(x)  # type: ignore[operator]

        return call

    mine = minimize(noted(0), start, calls=calls, x_tol=1e-3, f_tol=1e-4)  # type: ignore[arg-type]
    options = {"initial_simplex": start, "maxfev": calls, "xatol": 1e-3, "fatol": 1e-4}
    theirs = oracle(noted(1), start[0], method="Nelder-Mead", options=options)
    assert_array_equal(np.array(asked[0]), np.array(asked[1]))
    assert_array_equal(mine, theirs.x)


def test_the_start_is_left_alone() -> None:
    start = np.eye(3, 2)
    minimize(rosenbrock, start, calls=30, x_tol=1e-6, f_tol=1e-6)
    assert_array_equal(start, np.eye(3, 2))
