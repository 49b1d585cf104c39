"""Two wheels that come to lose alike from some moment on: their own speeds per opening fall, those of the others stay."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from diagnosis.clearing.cells import Cells
from diagnosis.clearing.pairs import FALLS, _in_spells, pairs_fall
from diagnosis.clearing.responses import Responses, Usual
from replay.machine.config import haulotte

LIMIT = -FALLS * float(np.log1p(-0.25))
FRAME = SimpleNamespace(hop=5)
CELLS = cast(Cells, SimpleNamespace(frame=FRAME, dt=0.1, machine=haulotte()))


def responses(own: np.ndarray[tuple[int, int], np.dtype[np.float64]]) -> Responses:
    count = own.shape[1]
    nothing: list[float | None] = [None] * count
    return Responses(own, own, [Usual()] * count, own, np.ones(own.shape, np.bool_), nothing, nothing, own, own)


def windows(count: int = 4) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    """A hill that all wheels climb, and what is each wheel's own."""
    rng = np.random.default_rng(4)
    hill = -0.25 * (np.arange(120) > 80)
    return np.asarray(hill[:, np.newaxis] + rng.normal(0.0, 0.02, (120, count)))


@pytest.mark.parametrize("pair", [(0, 2), (0, 1), (1, 2)])
def test_what_two_wheels_lose_at_one_moment_is_theirs(pair: tuple[int, int]) -> None:
    own = windows()
    own[np.ix_(np.arange(120) >= 50, pair)] += np.log(0.7)
    fall = pairs_fall(responses(own), CELLS)
    assert all(fall[i] > LIMIT for i in pair)
    assert all(fall[i] < LIMIT for i in range(4) if i not in pair)


def test_a_hill_and_a_wheel_alone_are_no_pair() -> None:
    own = windows()
    assert np.nanmax(pairs_fall(responses(own), CELLS)) < 0.3 * LIMIT
    own[60:, 0] += np.log(0.5)  # for the check of one wheel
    assert np.nanmax(pairs_fall(responses(own), CELLS)) < 0.3 * LIMIT


def test_of_fewer_wheels_or_little_known_nothing_is_said() -> None:
    assert np.isnan(pairs_fall(responses(windows(3)), CELLS)).all()
    own = windows()
    own[12:, 1] = np.nan
    assert np.isnan(pairs_fall(responses(own), CELLS)).all()


@pytest.mark.parametrize(("pair", "found"), [((0, 2), True), ((0, 1), True), ((0, 3), False)])
def test_what_two_wheels_of_one_axle_or_side_lose_for_a_spell_is_theirs(pair: tuple[int, int], *, found: bool) -> None:
    own = windows()
    own[np.ix_(np.arange(36, 50), pair)] += np.log(0.7)
    fall = _in_spells(responses(own), CELLS, own)
    assert all(bool(fall[i] > LIMIT) is found for i in pair)


def test_a_spell_in_which_all_wheels_lose_is_no_pairs() -> None:
    own = windows()
    own[40:60] += np.log(0.6)
    assert np.nanmax(pairs_fall(responses(own), CELLS)) < 0.3 * LIMIT


def test_what_turns_make_of_both_wheels_of_a_side_is_no_fall_of_theirs() -> None:
    own = windows()
    evened = own.copy()
    own[np.ix_(np.arange(120) >= 50, (0, 2))] += np.log(0.7)
    assert np.nanmax(pairs_fall(responses(own), CELLS)) > LIMIT
    assert np.nanmax(pairs_fall(responses(own)._replace(evened=evened), CELLS)) < LIMIT
