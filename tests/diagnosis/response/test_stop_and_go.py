"""A small robot that stands as often as it moves, with two wheels of coarse encoders and nothing but its commands beside them."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.response.assess import assess_response
from diagnosis.response.inputs import FollowerData, cell_of, cells
from diagnosis.response.kernel import follow
from diagnosis.response.models import NOISY, SCALES, STATES
from diagnosis.response.spells import Spell, where_asked
from diagnosis.results.assessment import Finding
from replay.faults import FaultMode
from replay.machine.config import Limits
from replay.machine.geometry import Geometry, WheelGeometry
from tests.campaigns import campaign

Array = NDArray[np.float64]

DT, SECONDS, STEP_M, TRACK = 1.0 / 64.0, 70.0, 0.000444, 0.235
PAIR = ("R", "L")
PLACES = {w: WheelGeometry(0.0, (-0.5 if w == "R" else 0.5) * TRACK, 0.0, "fixed") for w in PAIR}


def drive(seed: int, fast: slice = slice(0)) -> tuple[dict[str, Array], Array]:
    """Speeds by counts of each wheel [m/s], and the commands of the body, shape (n, 2); `fast` are steps in which it goes without rest, and faster."""
    rng, n = np.random.default_rng(seed), round(SECONDS / DT)
    v, turn = [], []
    while len(v) < n:
        length = round(rng.uniform(1.2, 2.4) / DT)
        spins = rng.random() < 0.4
        v += [0.0 if spins else rng.choice([0.1, 0.15])] * length
        turn += [rng.choice([0.9, -0.9]) if spins else 0.0] * length
        rest = round(rng.uniform(1.2, 2.4) / DT)
        v += [0.0] * rest
        turn += [0.0] * rest
    body = np.column_stack([v[:n], turn[:n]])
    body[fast, 0] = 0.3 + 0.05 * np.sign(np.sin(np.arange(n)[fast] * DT))
    body[fast, 1] = 0.0
    measured = {}
    for w in PAIR:
        asked = body[:, 0] + (0.5 if w == "R" else -0.5) * TRACK * body[:, 1]
        moved = np.cumsum(follow(np.r_[np.zeros(3), asked[:-3]], 0.0, 0.3, 0.1) * DT)
        measured[w] = np.diff(np.floor(moved / STEP_M), prepend=0.0) * STEP_M / DT
    return measured, body


def told(measured: dict[str, Array], body: Array) -> list[tuple[str, Finding]]:
    """Findings by wheel."""
    width = cell_of(DT)
    columns = np.column_stack([cells(body[:, k], width) for k in range(2)])
    data = {
        w: FollowerData(y.copy(), np.ones(y.size, np.bool_), columns, body[:, 0], f"wheel.{w}.v")
        for w, y in measured.items()
    }
    parts = assess_response(data, Geometry(PLACES, 0.036), None, Limits(driving_speed=0.02), DT).parts
    return [(w, f) for w, sides in parts.items() for side in sides for f in side.findings]


@pytest.mark.parametrize("seed", campaign([1, 2, 3]))
def test_a_healthy_robot_that_stops_and_goes_is_not_blamed(seed: int) -> None:
    assert told(*drive(seed)) == []


@pytest.mark.parametrize("seed", campaign([1, 2, 3]))
def test_half_of_a_speed_shows_although_half_of_nothing_is_nothing(seed: int) -> None:
    measured, body = drive(seed)
    spell = slice(round(30.0 / DT), round(42.0 / DT))
    measured["R"][spell] *= 0.5
    found = told(measured, body)
    assert {w for w, _ in found} == {"R"}
    assert any(f.mode is FaultMode.INEFFICIENT and f.start < spell.stop and spell.start < f.stop for _, f in found)


@pytest.mark.parametrize("seed", campaign([4, 5]))
def test_noise_of_most_of_the_fast_driving_is_no_habit_where_the_other_wheel_has_none(seed: int) -> None:
    measured, body = drive(seed, slice(round(45.0 / DT), round(65.0 / DT)))
    spell = slice(round(50.0 / DT), round(63.0 / DT))
    measured["L"][spell] += np.random.default_rng(seed).uniform(-0.15, 0.15, spell.stop - spell.start)
    found = told(measured, body)
    assert {w for w, _ in found} == {"L"}
    assert any(f.mode is FaultMode.NOISY for _, f in found)


def test_what_a_wheel_does_at_rest_makes_a_scale_no_less_probable() -> None:
    posterior = np.zeros((40, STATES))
    posterior[:, 0], posterior[:, NOISY + 1 + SCALES.index(0.48)] = 0.45, 0.55
    posterior[10:30] = 0.0
    posterior[10:30, NOISY + 1 + SCALES.index(0.48)] = 1.0
    asked = np.zeros(40, np.bool_)
    asked[10:30] = True
    (found,) = where_asked([Spell(0, 40, FaultMode.INEFFICIENT, 0.78)], (asked, asked), 4, posterior)
    assert (found.start, found.stop, found.p) == (10, 30, 1.0)
    assert where_asked([Spell(0, 40, FaultMode.INEFFICIENT, 0.78)], (asked & False, asked), 4, posterior) == []
