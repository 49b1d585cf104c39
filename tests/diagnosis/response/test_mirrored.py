"""Wheels of a robot that turns hardly ever but within a fault: what they make of a turn is learned from the fault."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.response.assess import Judgement, assess_response
from diagnosis.response.identification import identify_response
from diagnosis.response.inputs import FollowerData, cell_of, cells
from diagnosis.response.kernel import follow
from diagnosis.response.mirrored import Mirrored, mirrored
from replay.faults import FaultMode
from replay.machine.config import Limits
from replay.machine.geometry import Geometry, WheelGeometry
from tests.campaigns import campaign

Array = NDArray[np.float64]

DT, SECONDS, TRACK, DRIVING = 1.0 / 50.0, 30.0, 0.235, 0.02
SPELL = slice(round(12.0 / DT), round(22.0 / DT))
SIDES = {"R": 0.5 * TRACK, "L": -0.5 * TRACK}
GEOMETRY = Geometry({w: WheelGeometry(0.0, -y, 0.0, "fixed") for w, y in SIDES.items()}, 0.036)


def drive(seed: int, skids: float = 1.0, turns: slice = SPELL) -> dict[str, FollowerData]:
    """Wheels of a robot that goes straight, and turns within `turns` alone; `skids` times what its track needs."""
    rng, n = np.random.default_rng(seed), round(SECONDS / DT)
    body = np.zeros((n, 2))
    for start in range(0, n, round(2.5 / DT)):
        body[start : start + round(2.0 / DT), 0] = rng.choice([0.1, 0.15, -0.1])
    at = np.arange(n)[turns]
    body[turns] = np.column_stack([np.zeros(at.size), 0.9 * np.sign(np.sin(2.0 * at * DT + 0.3))])
    columns = np.column_stack([cells(body[:, k], cell_of(DT)) for k in range(2)])
    out = {}
    for w, y in SIDES.items():
        asked = body[:, 0] + skids * y * body[:, 1]
        speed = follow(np.r_[np.zeros(3), asked[:-3]], 0.0, 0.3, 0.1) + rng.normal(0.0, 0.003, n)
        out[w] = FollowerData(speed, np.ones(n, np.bool_), columns, asked, f"wheel.{w}.v")
    return out


def judged(data: dict[str, FollowerData]) -> Judgement:
    return assess_response(data, GEOMETRY, None, Limits(driving_speed=DRIVING), DT)


def held(data: dict[str, FollowerData]) -> Mirrored:
    h = cell_of(DT) * DT
    answers = {w: identify_response(cells(d.y, cell_of(DT)), d.commands, h, DRIVING) for w, d in data.items()}
    return mirrored(data, {w: x for w, x in answers.items() if x is not None}, GEOMETRY, cell_of(DT), DT)


@pytest.mark.turns("wheel")
@pytest.mark.parametrize("wheel", list(SIDES))
@pytest.mark.parametrize("share", [0.0, 0.5])
def test_a_wheel_that_fails_in_all_turns_is_found_by_what_the_other_one_makes_of_them(wheel: str, share: float) -> None:
    data = drive(1)
    data[wheel].y[SPELL] *= share
    parts = judged(data).parts
    found = [(w, f) for w, sides in parts.items() for side in sides for f in side.findings]
    assert {w for w, _ in found} == {wheel}
    mode = FaultMode.INEFFICIENT if share else FaultMode.NO_SIGNAL
    assert any(f.mode is mode and f.start < SPELL.stop and SPELL.start < f.stop for _, f in found)


@pytest.mark.parametrize("skids", campaign([1.8, 1.0, 0.8]))
def test_healthy_sides_answer_alike_however_they_skid(skids: float) -> None:
    data = drive(2, skids)
    assert held(data).doubts == {}
    assert all(not side.findings for sides in judged(data).parts.values() for side in sides)
