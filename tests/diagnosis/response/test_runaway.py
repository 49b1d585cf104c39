"""A drive that pulls away from its command runs away; a wrong reading, a load and an override of all drives do not."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.response.assess import assess_response
from diagnosis.response.inputs import FollowerData
from diagnosis.response.machine import Judged
from diagnosis.response.runaway import _finding
from diagnosis.results.assessment import Finding
from replay.faults import FaultMode, Side
from replay.machine.config import Limits
from tests.diagnosis.response.robot import DT, followers_of, geometry, speeds

Array = NDArray[np.float64]

LIMITS = Limits(driving_speed=0.05)
SPAN = slice(round(60 / DT), round(65 / DT))


def robot(speed: dict[str, float], pull: dict[str, float], *, unsigned: bool = False) -> dict[str, FollowerData]:
    """A robot of which some wheels read a speed [m/s] for five seconds, and some drives pull so much meanwhile."""
    measured, asked, body = speeds(5)
    rng = np.random.default_rng(5)
    efforts = {w: 2.0 * y + 3.0 * np.gradient(y, DT) + rng.normal(0.0, 0.2, y.size) for w, y in measured.items()}
    for w, x in speed.items():
        measured[w][SPAN] = np.round(x + rng.normal(0.0, 0.01, SPAN.stop - SPAN.start), 3)
    for w, x in pull.items():
        efforts[w][SPAN] = x + rng.normal(0.0, 0.2, SPAN.stop - SPAN.start)
    data = followers_of(measured, asked, body)
    return {w: replace(d, effort=np.abs(efforts[w]) if unsigned else efforts[w]) for w, d in data.items()}


def runaways(data: dict[str, FollowerData]) -> dict[str, list[Finding]]:
    parts = assess_response(data, geometry(), None, LIMITS, DT).parts
    said = {
        w: [f for f in drive.findings if any("runs away" in str(e) for e in f.evidence)]
        for w, (_, drive) in parts.items()
    }
    return {w: found for w, found in said.items() if found}


@pytest.mark.parametrize(("speed", "pull"), [(1.9, 12.0), (-1.2, -12.0)])
def test_a_drive_that_pulls_away_from_its_command_runs_away(speed: float, pull: float) -> None:
    found = runaways(robot({"RR": speed}, {"RR": pull, "FR": -4.0}))
    assert list(found) == ["RR"]
    one = found["RR"][0]
    assert (one.side, one.mode) == (Side.ACTUATOR, FaultMode.STUCK)
    assert one.probability > 0.9
    assert abs(one.start - SPAN.start) * DT < 0.6
    assert abs(one.stop - SPAN.stop) * DT < 0.6


def test_a_wrong_reading_takes_the_usual_effort_or_has_its_loop_pull_the_other_way() -> None:
    assert not runaways(robot({"RR": 1.9}, {}))
    assert not runaways(robot({"RR": 1.9}, {"RR": -12.0}))


def test_a_load_holds_a_wheel_back_against_its_drive() -> None:
    assert not runaways(robot({"RR": 0.1}, {"RR": 12.0}))


def test_what_several_drives_do_is_another_command() -> None:
    assert not runaways(robot({"RR": 1.9, "FL": 1.9}, {"RR": 12.0, "FL": 12.0}))


def test_an_effort_without_direction_tells_nothing() -> None:
    assert not runaways(robot({"RR": 1.9}, {"RR": 12.0}, unsigned=True))


def test_a_wheel_that_is_braked_at_many_times_its_usual_speed_does_not_turn_the_sign_of_its_effort() -> None:
    """Its encoder was frozen, and its loop has wound up behind it: the way of an effort is that of driving as usual."""
    data = robot({"RR": -1.2}, {"RR": 12.0})
    after = slice(SPAN.stop, SPAN.stop + round(1.0 / DT))
    y, effort = data["RR"].y.copy(), data["RR"].effort
    assert effort is not None
    effort = effort.copy()
    y[after], effort[after] = np.linspace(40.0, 1.0, after.stop - after.start), -50.0
    assert not runaways({**data, "RR": replace(data["RR"], y=y, effort=effort)})


def test_a_command_of_nearly_nothing_is_told_as_nothing() -> None:
    still = np.full(20, -6.1e-8)
    blocks = SimpleNamespace(start=np.arange(20) * 10, mean=np.full(20, 0.69), low=still, high=still)
    one = SimpleNamespace(
        data=SimpleNamespace(name="v", y=np.zeros(200)), wheel=SimpleNamespace(blocks=blocks), alone=False
    )
    found = _finding(cast(Judged, one), (5, 15), np.r_[np.ones(5), np.full(10, 9.0), np.ones(5)], 0.1)
    assert "is at 0.69 {speed_unit} where its command makes it 0 {speed_unit}" in found.evidence[0]
