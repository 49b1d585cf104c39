"""A wheel that keeps one speed whatever it is told has a drive that does not answer; a frozen reading is its sensor's."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.response.assess import assess_response
from diagnosis.results.assessment import Finding
from replay.faults import FaultMode, Side
from replay.machine.config import Limits
from tests.diagnosis.response.robot import DT, WHEELS, followers_of, geometry, speeds

Array = NDArray[np.float64]

LIMITS = Limits(driving_speed=0.05)
SPAN = 60.0, 85.0
PART = slice(round(SPAN[0] / DT), round(SPAN[1] / DT))


def told(measured: dict[str, Array], asked: dict[str, Array], body: Array) -> list[tuple[str, Finding]]:
    parts = assess_response(followers_of(measured, asked, body), geometry(WHEELS), None, LIMITS, DT).parts
    return [(w, f) for w, sides in parts.items() for side in sides for f in side.findings]


@pytest.mark.parametrize("speed", [-0.5, 0.3])
@pytest.mark.parametrize("seed", [3, 8])
def test_a_wheel_that_keeps_its_speed_has_a_stuck_drive(speed: float, seed: int) -> None:
    measured, asked, body = speeds(seed, WHEELS)
    wheel = WHEELS[1]
    shakes = np.random.default_rng(seed).normal(0.0, 0.006, PART.stop - PART.start)
    measured[wheel][PART] = np.round(speed + shakes, 3)
    found = told(measured, asked, body)
    assert {w for w, _ in found} == {wheel}
    (stuck,) = (f for _, f in found if f.side is Side.ACTUATOR)
    assert (stuck.mode, stuck.probability) == (FaultMode.STUCK, 0.85)
    assert (stuck.start * DT, stuck.stop * DT) == pytest.approx(SPAN, abs=4.0)
    assert Side.SENSOR not in {f.side for _, f in found}


def test_a_frozen_reading_is_the_sensors() -> None:
    measured, asked, body = speeds(3, WHEELS)
    measured[WHEELS[1]][PART] = 0.3
    assert {(w, f.side) for w, f in told(measured, asked, body)} == {(WHEELS[1], Side.SENSOR)}


def test_a_machine_that_goes_on_as_it_is_told_to_is_healthy() -> None:
    measured, asked, body = speeds(3, WHEELS)
    assert told(measured, asked, body) == []


def test_wheels_that_all_keep_their_speeds_do_not_follow_their_commands_and_none_is_blamed() -> None:
    measured, asked, body = speeds(3, WHEELS)
    for k, w in enumerate(WHEELS):
        measured[w][PART] = np.round(0.4 + np.random.default_rng(k).normal(0.0, 0.006, PART.stop - PART.start), 3)
    assert [f for _, f in told(measured, asked, body) if f.side is Side.ACTUATOR] == []


def test_one_that_reads_a_speed_while_all_others_stand_and_follows_in_between_may_be_shifted() -> None:
    measured, asked, body = speeds(3, WHEELS)
    wheel, rng = WHEELS[1], np.random.default_rng(1)
    for k, told_to in enumerate((0.5, 0.0, -0.5, 0.0, -0.5, 0.0)):
        part = slice(PART.start + 80 * k, PART.start + 80 * (k + 1))
        for w in WHEELS:
            asked[w][part] = told_to
            measured[w][part] = told_to + (0.006 * rng.normal(size=80) if told_to or w == wheel else 0.0)
        measured[wheel][part] = 0.3 + 0.006 * rng.normal(size=80) if k < 2 else measured[wheel][part] + 0.3
        body[part] = (told_to, 0.0)
    found = [f for w, f in told(measured, asked, body) if w == wheel and f.side is not Side.ACTUATOR]
    assert any("while all other {wheels} stand" in f.evidence[0] for f in found)
