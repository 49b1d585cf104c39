"""Response of a first-order lag where its input begins or is missing."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.estimation.lag import low_passed, low_passed_at, low_passed_on

DT, TAU = 0.01, 0.05
U = np.array([np.nan, np.inf, 2.0, 4.0, np.nan, 4.0])


def test_it_starts_from_the_first_finite_value() -> None:
    a = np.exp(-DT / TAU)
    assert low_passed(U[[0, 2, 3, 4, 5]], TAU, DT) == pytest.approx([2.0, 2.0, 2.0, x := 2 * a + 4 * (1 - a), x])
    assert low_passed(U, TAU, DT)[0] == 2.0
    assert low_passed(U[:1], TAU, DT).tolist() == [0.0]


def test_parts_give_what_the_whole_gives() -> None:
    u = np.random.default_rng(1).normal(size=50)
    u[[0, 1, 20]] = np.nan
    first, state = low_passed_on(u[:10], TAU, DT, None)
    second, _ = low_passed_on(u[10:], TAU, DT, state)
    np.testing.assert_array_equal(np.concatenate([first, second]), low_passed(u, TAU, DT))


def test_several_lags_at_some_steps_are_those_of_each_one_alone() -> None:
    rng = np.random.default_rng(2)
    u = rng.normal(size=3000)
    u[:7], u[rng.random(u.size) < 0.05] = np.nan, np.nan
    taus, at = (0.004, 0.1, 2.7), np.flatnonzero(rng.random(u.size) < 0.3)
    found = low_passed_at(u, taus, 0.001, at)
    np.testing.assert_array_equal(found, [low_passed(u, tau, 0.001)[at] for tau in taus])
    assert low_passed_at(u, taus, 0.001, at[:0]).shape == (3, 0)
    np.testing.assert_array_equal(low_passed_at(np.full(9, np.nan), taus, 0.001, np.arange(9)), np.zeros((3, 9)))
