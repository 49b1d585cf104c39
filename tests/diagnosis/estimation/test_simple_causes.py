"""What comes late is found as by trying everything, although most trials are given up by a bound."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.estimation.simple_causes import Measured, _delayed, _lagged, _least, _surely_more, every_power, power

Array = NDArray[np.float64]
DT, SIZE = 0.01, 3000


def measured(seed: int, noise: float, late: int) -> Measured:
    rng = np.random.default_rng(seed)
    x = np.cumsum(rng.standard_normal(SIZE)) * 0.02
    y = np.roll(x, late) + noise * rng.standard_normal(SIZE) + np.where(rng.random(SIZE) < 0.1, 0.5, 0.0)
    return Measured(y, x, np.ones(SIZE, np.bool_), DT, ("a", "b"), "m/s", max(noise, 1e-3), 0.02)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("noise", [0.0, 0.01, 0.3])
def test_the_least_of_trials_is_that_of_all(seed: int, noise: float) -> None:
    given = measured(seed, noise, late=7 * seed)
    at = np.arange(500, 500 + 300 * (seed + 1))
    y, x = given.y[at], given.x[at]
    for trials in (_delayed, _lagged):
        late = trials(at, x, given)
        every = [(seconds, y - late.reference(k, slice(None))) for k, seconds in enumerate(late.seconds)]
        want = min(every, key=lambda one: (power(one[1], given), every_power(one[1], given)))
        seconds, rest = _least(late, y, given)
        assert seconds == want[0]
        np.testing.assert_array_equal(rest, want[1])


@pytest.mark.parametrize("seed", range(20))
def test_the_bound_is_one(seed: int) -> None:
    rng = np.random.default_rng(seed)
    given = measured(seed, 0.01, 0)
    off = rng.standard_normal(rng.integers(1, 400)) * 10.0 ** rng.uniform(-3, 3)
    own = power(off, given)
    for edge in np.quantile(off**2, [0.0, 0.5, 0.9, 1.0]):
        assert not _surely_more(off, own, float(edge), given)
