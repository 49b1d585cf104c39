"""A speed that reads the reverse for a while is told, and what really turns the other way, or all of it, is not called so."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.response.assess import assess_response
from diagnosis.results.assessment import Finding
from replay.faults import FaultMode
from replay.machine.config import Limits
from tests.diagnosis.response.robot import DT, followers_of, geometry, speeds

LIMITS = Limits(driving_speed=0.05)
SPAN = slice(round(60 / DT), round(72 / DT))


def told(seed: int, wheels: tuple[str, ...]) -> dict[str, list[Finding]]:
    measured, asked, body = speeds(seed)
    for w in wheels:
        measured[w][SPAN] *= -1.0
    parts = assess_response(followers_of(measured, asked, body), geometry(), None, LIMITS, DT).parts
    said = {w: [f for f in sides[0].findings if "−1" in str(f.evidence[0])] for w, sides in parts.items()}
    return {w: f for w, f in said.items() if f}


@pytest.mark.parametrize("seed", [3, 4, 6])
def test_the_reverse_is_told_of_the_wheel_that_reads_it(seed: int) -> None:
    found = told(seed, ("FL",))
    assert list(found) == ["FL"]
    assert all(
        f.mode is FaultMode.OUTSIDE_TABLE and f.epsilon is not None and f.epsilon.value == 2.0 for f in found["FL"]
    )
    first, last = min(f.start for f in found["FL"]), max(f.stop for f in found["FL"])
    assert abs(first - SPAN.start) * DT < 3.0
    assert abs(last - SPAN.stop) * DT < 3.0


@pytest.mark.parametrize("wheels", [(), ("FL", "RR")])
def test_a_healthy_robot_and_two_at_once_are_not_called_so(wheels: tuple[str, ...]) -> None:
    assert not told(3, wheels)


def test_a_mission_of_the_other_sign_is_the_machine_files_matter() -> None:
    measured, asked, body = speeds(5)
    measured["FL"] *= -1.0
    parts = assess_response(followers_of(measured, asked, body), geometry(), None, LIMITS, DT).parts
    assert not any("−1" in str(f.evidence[0]) for sides in parts.values() for f in sides[0].findings)
    assert np.isfinite(measured["FL"]).all()
