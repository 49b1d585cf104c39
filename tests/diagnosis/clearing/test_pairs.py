"""Two wheels that come to lose alike from some moment on: their own speeds per opening fall, those of the others stay."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.clearing.pairs import FALLS, pairs_fall
from diagnosis.clearing.responses import Responses, Usual

LIMIT = -FALLS * float(np.log1p(-0.25))


def responses(own: np.ndarray[tuple[int, int], np.dtype[np.float64]]) -> Responses:
    count = own.shape[1]
    nothing: list[float | None] = [None] * count
    return Responses(own, own, [Usual()] * count, own, np.ones(own.shape, np.bool_), nothing, nothing, own)


def windows(count: int = 4) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    """A hill that all wheels climb, and what is each wheel's own."""
    rng = np.random.default_rng(4)
    hill = -0.25 * (np.arange(120) > 80)
    return np.asarray(hill[:, np.newaxis] + rng.normal(0.0, 0.02, (120, count)))


@pytest.mark.parametrize("pair", [(0, 2), (0, 1), (1, 2)])
def test_what_two_wheels_lose_at_one_moment_is_theirs(pair: tuple[int, int]) -> None:
    own = windows()
    own[np.ix_(np.arange(120) >= 50, pair)] += np.log(0.7)
    fall = pairs_fall(responses(own))
    assert all(fall[i] > LIMIT for i in pair)
    assert all(fall[i] < LIMIT for i in range(4) if i not in pair)


def test_a_hill_and_a_wheel_alone_are_no_pair() -> None:
    own = windows()
    assert np.nanmax(pairs_fall(responses(own))) < 0.3 * LIMIT
    own[60:, 0] += np.log(0.5)  # for the check of one wheel
    assert np.nanmax(pairs_fall(responses(own))) < 0.3 * LIMIT


def test_of_fewer_wheels_or_little_known_nothing_is_said() -> None:
    assert np.isnan(pairs_fall(responses(windows(3)))).all()
    own = windows()
    own[12:, 1] = np.nan
    assert np.isnan(pairs_fall(responses(own))).all()
