"""Readings that all wheels hold while nothing changes, and that a lone channel holds again and again, prove no stuck sensor."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.response.assess import assess_response
from diagnosis.results.assessment import Finding
from replay.faults import FaultMode, Side
from replay.machine.config import Limits
from tests.diagnosis.response.robot import DT, Array, followers_of, geometry, robot_of, speeds

STEADY = slice(1_000, 1_080)


def stuck(measured: dict[str, Array], asked: dict[str, Array], body: Array) -> list[tuple[str, Finding]]:
    found = assess_response(followers_of(measured, asked, body), geometry(tuple(measured)), None, Limits(), DT).parts
    return [(w, f) for w, (sensor, _) in found.items() for f in sensor.findings if f.mode is FaultMode.STUCK]


def calm() -> tuple[dict[str, Array], dict[str, Array], Array]:
    _, _, body = speeds(7)
    v, turn = body[:, 0].copy(), body[:, 1].copy()
    v[STEADY.start - 100 : STEADY.stop + 20], turn[STEADY.start - 100 : STEADY.stop + 20] = 0.4, 0.0
    return robot_of(v, turn, 7)


def test_a_machine_that_goes_on_as_it_does_is_no_fault_of_all_its_sensors() -> None:
    measured, asked, body = calm()
    for y in measured.values():
        y[STEADY] = y[STEADY.start]
    assert stuck(measured, asked, body) == []


def test_one_of_them_that_is_held_alone_is_stuck() -> None:
    measured, asked, body = calm()
    measured["FR"][STEADY] = measured["FR"][STEADY.start]
    assert {w for w, _ in stuck(measured, asked, body)} == {"FR"}


@pytest.mark.parametrize("back", [True, False])
def test_a_lone_speed_that_ends_where_it_was_held_may_be_a_machine_that_goes_on(*, back: bool) -> None:
    measured, asked, body = speeds(9, ("FR",))
    y = measured["FR"]
    held = slice(1_000, 1_200)
    y[held] = 0.5
    if back:
        y[held.stop : held.stop + 100] = 0.5 + 0.004 * np.random.default_rng(1).normal(size=100)
    else:
        y[held.stop : held.stop + 100] = -0.4 + 0.004 * np.random.default_rng(1).normal(size=100)
    found = [f for _, f in stuck(measured, asked, body[:, :1])]
    assert found
    assert all(f.side is Side.SENSOR for f in found)
    assert (max(f.probability for f in found) < 0.6) is back
