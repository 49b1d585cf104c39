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


def counted(asked_later: float) -> list[str]:
    """Wheels that are stuck of a short drive that turns on the spot for three seconds, in which its right wheel has four counts in each sample; then it may be told otherwise."""
    rng, n, count, track = np.random.default_rng(5), 380, 0.04, 0.4
    spin = slice(240, 300)
    v, turn = np.full(n, 0.5), np.zeros(n)
    v[:20], v[spin.start - 10 : spin.stop], turn[spin.start - 10 : spin.stop] = 0.0, 0.0, 0.8
    measured, asked = {}, {"R": v + 0.5 * track * turn, "L": v - 0.5 * track * turn}
    for w, x in asked.items():
        moved = np.cumsum((x + rng.normal(0.0, 0.005, n) * (x != 0.0)) * DT)
        measured[w] = np.round(np.diff(np.floor(moved / (count * DT)), prepend=0.0) * count, 6)
    measured["R"][spin] = 4.0 * count
    v[spin.stop - 30 : spin.stop] += asked_later
    asked["R"][spin.stop - 30 : spin.stop] += asked_later
    return [w for w, _ in stuck(measured, asked, np.column_stack([v, turn]))]


def test_a_speed_of_few_counts_that_is_told_to_stay_is_no_stuck_sensor() -> None:
    """At 4.0 counts in a sample each has four; a healthy sensor had been stuck for three seconds (p = .94, stop)."""
    assert counted(0.0) == []


def test_one_of_few_counts_that_stays_while_it_is_told_otherwise_is() -> None:
    assert counted(0.4) == ["R"]
