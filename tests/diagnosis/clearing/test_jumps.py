"""A steering angle that jumps is not cleared, and its sensor is named where it jumps to and fro."""

from __future__ import annotations

import pytest

from diagnosis.clearing.jumps import fault_of_jumps
from diagnosis.clearing.standing_out import what_stands_out
from diagnosis.results.clearing import Check
from diagnosis.results.machine_words import HYDRAULIC
from replay.faults import FaultMode, FaultSpec, Side
from tests.diagnosis.clearing.missions import LENGTH, checks, in_cells, simulated

KEY = ("rear", "sensor", Check.JUMP)


def loss(start: float, stop: float) -> FaultSpec:
    return FaultSpec("rear", Side.SENSOR, FaultMode.INEFFICIENT, start, stop, 0.4)


@pytest.mark.parametrize("base", [True, False])
def test_a_healthy_angle_does_not_jump(base: bool) -> None:
    found = checks(simulated(), base=base)
    assert found[KEY].passed
    assert found[KEY].worst == 0.0


def test_a_loss_for_a_while_is_its_sensors() -> None:
    mission = simulated(loss(22.0, 25.0), loss(44.0, 47.0))
    check = checks(mission, base=True)[KEY]
    assert not check.passed
    assert "jumps by" in check.text
    assert "°" in check.text
    cells = in_cells(mission, base=True)
    fault = fault_of_jumps(check, cells)
    assert fault is not None
    assert fault.side is Side.SENSOR
    assert fault.start * cells.timeline.dt == pytest.approx(22.0, abs=3.5)
    assert sum(h.p for h in fault.hypotheses) == pytest.approx(1.0)
    assert what_stands_out([check], cells, HYDRAULIC)["rear"].side is Side.SENSOR


def test_one_jump_is_not_cleared_and_not_named() -> None:
    mission = simulated(loss(LENGTH / 2, LENGTH))
    check = checks(mission, base=True)[KEY]
    if not check.passed:
        assert fault_of_jumps(check, in_cells(mission, base=True)) is None
