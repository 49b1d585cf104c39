"""All speeds read nothing though the machine is told to move: by an inertial unit it stands, or goes on."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.response.assess import Judgement, assess_response
from diagnosis.response.vibration import Unit
from replay.machine.config import Limits
from tests.diagnosis.response.robot import DT, followers_of, geometry, speeds

Array = NDArray[np.float64]

STOP = slice(round(60 / DT), round(80 / DT))


def standing(seed: int, *, slowly: bool = False) -> tuple[dict[str, Array], dict[str, Array], Array, Array]:
    """All speeds are 0 for a while in which the machine is told to drive; last: whether it goes on."""
    measured, asked, body = speeds(seed)
    went = np.mean(list(measured.values()), axis=0)
    body[STOP], went[STOP] = (0.7, 0.0), 0.7
    for w, y in measured.items():
        y[STOP.start - 20 : STOP.start], y[STOP.stop : STOP.stop + 20] = 0.7, 0.7
        y[STOP], asked[w][STOP.start - 20 : STOP.stop] = 0.0, 0.7
        if slowly:
            y[STOP.start - 20 : STOP.start] = np.linspace(0.7, 0.0, 20)
            y[STOP.stop : STOP.stop + 20] = np.linspace(0.0, 0.7, 20)
    return measured, asked, body, np.abs(went) > 0.02


def unit_of(moves: NDArray[np.bool_], rest: float = 0.02) -> Unit:
    a = np.random.default_rng(3).normal(0.0, 1.0, moves.size) * np.where(moves, 0.4, rest)
    return Unit(a, np.ones(moves.size, np.bool_))


def judged(measured: dict[str, Array], asked: dict[str, Array], body: Array, unit: Unit | None) -> Judgement:
    return assess_response(
        followers_of(measured, asked, body), geometry(tuple(measured)), None, Limits(driving_speed=0.05), DT, unit=unit
    )


def test_speeds_that_vanish_together_while_the_machine_shakes_on_failed_together() -> None:
    measured, asked, body, moves = standing(7)
    j = judged(measured, asked, body, unit_of(moves))
    assert j.events == ()
    assert "what they have in common failed" in " ".join(x.text for x in j.unshown)
    assert not [f for sides in j.parts.values() for a in sides for f in a.findings]


def test_a_machine_that_is_quiet_really_stood() -> None:
    measured, asked, body, moves = standing(7)
    moves[STOP] = False
    j = judged(measured, asked, body, unit_of(moves))
    (said,) = (x.text for x in j.events if "stood still together" in x.text)
    assert "the machine really stood" in said
    assert j.unshown == ()


@pytest.mark.parametrize("why", ["no unit", "shakes at rest, too", "stops slowly"])
def test_without_such_evidence_it_is_told_as_before(why: str) -> None:
    measured, asked, body, moves = standing(7, slowly=why == "stops slowly")
    unit = None if why == "no unit" else unit_of(moves, 0.3 if why.startswith("shakes") else 0.02)
    j = judged(measured, asked, body, unit)
    (said,) = (x.text for x in j.events if "stood still together" in x.text)
    assert "really stood" not in said
    assert j.unshown == ()
