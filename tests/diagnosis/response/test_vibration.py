"""How an inertial unit shakes at rest and in motion."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.response.vibration import Unit, levels_of, vibration_of

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

DT, N = 0.02, 5000
MOVES = (np.arange(N) // 500) % 3 > 0
PART = slice(1000, 1500)


def shakes(moves: Flags, seed: int = 0, rest: float = 0.02, motion: float = 0.5) -> Unit:
    a = np.random.default_rng(seed).normal(0.0, 1.0, N) * np.where(moves, motion, rest)
    return Unit(a, np.ones(N, np.bool_))


def test_levels_are_means_of_what_readings_change() -> None:
    rng = np.random.default_rng(1)
    a, fresh = rng.normal(size=203), rng.random(203) < 0.6
    a[100:140] = np.nan
    got, width = levels_of(a, fresh, DT)
    assert width == 25
    known = [k for k in range(203) if fresh[k] and np.isfinite(a[k])]
    sizes = [[abs(a[k] - a[j]) for j, k in pairwise(known) if k // 25 == w] for w in range(got.size)]
    least = max(2, round(0.25 * np.median([len(x) for x in sizes if x])))
    for w, own in enumerate(sizes):
        assert got[w] == pytest.approx(np.mean(own)) if len(own) >= least else np.isnan(got[w])
    assert [len(x) >= least for x in sizes].count(False) == 2


@pytest.mark.parametrize("moves", [True, False])
def test_a_time_in_question_is_told_by_the_rest(moves: bool) -> None:
    truth = MOVES.copy()
    truth[PART] = moves
    speed = np.where(MOVES, 1.0, 0.0)
    speed[PART] = 0.0
    found = vibration_of(shakes(truth), speed, [(PART.start, PART.stop)], DT)
    assert found is not None
    assert (found.moves(PART.start, PART.stop), found.stands(PART.start, PART.stop)) == (moves, not moves)
    assert np.isnan(found.share_moving(PART.start, PART.start + 20))


@pytest.mark.parametrize("why", ["an engine shakes it at rest, too", "it never rests", "dead"])
def test_nothing_is_told_without_a_gap_between_rest_and_motion(why: str) -> None:
    unit = shakes(MOVES, rest=0.4 if why.startswith("an engine") else 0.02)
    unit = Unit(np.zeros(N), unit.fresh) if why == "dead" else unit
    speed = np.where(MOVES | (why == "it never rests"), 1.0, 0.0)
    found = vibration_of(unit, speed, [], DT)
    assert found is not None
    assert not found.moves(PART.start, PART.stop)
    assert not found.stands(PART.start, PART.stop)
    assert vibration_of(unit, np.zeros(N), [], DT) is None
