"""A speed channel beside the position of its own joint."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.response.assess import Judgement, assess_response
from diagnosis.results.assessment import CODE
from replay.faults import FaultMode, Side, State
from replay.machine.config import Limits
from tests.campaigns import campaign
from tests.diagnosis.response.robot import DT, followers_of, geometry, speeds

Array = NDArray[np.float64]

LIMITS = Limits(driving_speed=0.05)
PART = slice(round(60 / DT), round(70 / DT))


def judged(measured: dict[str, Array], rolled: dict[str, Array], asked: dict[str, Array], body: Array) -> Judgement:
    data = {w: replace(d, rolled=rolled[w]) for w, d in followers_of(measured, asked, body).items()}
    return assess_response(data, geometry(tuple(measured)), None, LIMITS, DT)


def found(j: Judgement) -> list[tuple[str, Side, FaultMode]]:
    return [(w, f.side, f.mode) for w, (sensor, _) in j.parts.items() for f in sensor.findings]


def positions(measured: dict[str, Array]) -> dict[str, Array]:
    """Slopes of positions that are whole counts."""
    out = {}
    for w, y in measured.items():
        way = np.round(np.cumsum(y) * DT, 3)
        out[w] = np.gradient(way) / DT
    return out


@pytest.mark.parametrize("seed", campaign([41, 42, 43, 44]))
@pytest.mark.parametrize("factor", [0.5, 1.5])
def test_a_speed_that_leaves_its_own_position_is_the_sensors_fault(seed: int, factor: float) -> None:
    measured, asked, body = speeds(seed, ("FR", "FL"))
    rolled = positions(measured)
    assert found(judged(measured, rolled, asked, body)) == []
    measured["FL"][PART] *= factor
    mode = FaultMode.INEFFICIENT if factor < 1.0 else FaultMode.OUTSIDE_TABLE
    j = judged(measured, rolled, asked, body)
    assert found(j) == [("FL", Side.SENSOR, mode)]
    (finding,) = j.parts["FL"][0].findings
    assert any("the position of its joint (wheel.FL.v_position)" in e for e in finding.evidence)


@pytest.mark.parametrize("seed", campaign([41, 42]))
def test_an_encoder_that_fails_in_both_channels_may_as_well_be_a_jammed_wheel(seed: int) -> None:
    measured, asked, body = speeds(seed)
    rolled = positions(measured)
    measured["RL"][PART] = 0.0
    either, mode = Side.SENSOR_OR_ACTUATOR, FaultMode.NO_SIGNAL
    assert found(judged(measured, positions(measured), asked, body)) == [("RL", either, mode)]
    assert found(judged(measured, rolled, asked, body)) == [("RL", Side.SENSOR, mode)]  # its position goes on


@pytest.mark.parametrize("value", [0.0, 0.5])
def test_a_position_that_fails_blames_no_speed(value: float) -> None:
    measured, asked, body = speeds(45, ("FR", "FL"))
    rolled = positions(measured)
    rolled["FL"][PART] *= value
    assert found(judged(measured, rolled, asked, body)) == []


def test_a_speed_in_another_unit_than_its_position_is_not_called_healthy() -> None:
    measured, asked, body = speeds(46)
    rolled = positions(measured)
    for y in measured.values():
        y *= 0.6
    for c in asked.values():
        c *= 0.6
    j = judged(measured, rolled, asked, 0.6 * body)
    sensor = j.parts["FR"][0]
    assert not np.any(sensor.states == CODE[State.HEALTHY])
    assert "the slope of its own joint's position" in sensor.reasons[State.NOT_ASSESSED]
