"""Response of a first-order lag where its input begins or is missing."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.estimation.lag import low_passed, low_passed_on

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
