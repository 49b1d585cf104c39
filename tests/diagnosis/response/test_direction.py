"""Encoders that count pulses without a direction: speeds that are never below 0."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.response.assess import Judgement, assess_response
from diagnosis.response.direction import directed, without_direction
from diagnosis.results.assessment import CODE
from replay.faults import FaultMode, State
from replay.machine.config import Limits
from tests.diagnosis.response.robot import DT, WHEELS, followers_of, geometry, robot_of, speeds

Array = NDArray[np.float64]

LIMITS = Limits(driving_speed=0.05)
PART = slice(round(60 / DT), round(70 / DT))


def back_and_forth(seed: int) -> tuple[dict[str, Array], dict[str, Array], Array]:
    """Four wheels that drive backwards for a third of the mission."""
    rng = np.random.default_rng(seed)
    v = np.repeat(rng.choice([0.8, 0.5, -0.5, -0.7, 0.0], 30), 100)
    return robot_of(v, np.repeat(rng.choice([0.0, 0.3, -0.3], 30), 100), seed)


def judged(measured: dict[str, Array], asked: dict[str, Array], body: Array) -> Judgement:
    data = followers_of(measured, asked, body)
    for w, d in data.items():
        none = without_direction(d.y, d.asked, LIMITS.driving_speed, DT)
        data[w] = replace(d, y=directed(d.y, d.asked, DT) if none else d.y, undirected=none)
    return assess_response(data, geometry(tuple(measured)), None, LIMITS, DT)


def test_a_speed_that_tells_no_direction_is_known_by_its_command() -> None:
    measured, asked, _ = back_and_forth(3)
    y, c = measured["FR"], asked["FR"]
    assert without_direction(np.abs(y), c, 0.05, DT)
    assert not without_direction(y, c, 0.05, DT)
    assert not without_direction(np.clip(y, 0.0, None), c, 0.05, DT)  # a drive that cannot go backwards stands then
    assert not without_direction(0.3 * np.abs(y), c, 0.05, DT)  # nothing like its command
    assert not without_direction(np.abs(y), np.abs(c), 0.05, DT)  # never told to
    assert not without_direction(np.full(y.size, 0.4), c, 0.05, DT) or np.median(np.abs(c)) < 0.6


@pytest.mark.parametrize("seed", [3, 4, 5])
def test_it_is_read_with_the_direction_of_its_command(seed: int) -> None:
    measured, asked, _ = back_and_forth(seed)
    for w, y in measured.items():
        got = directed(np.abs(y), asked[w], DT)
        wrong = np.sign(got) != np.sign(y)
        assert np.mean(wrong & (np.abs(y) > 0.15)) < 0.005


def test_a_machine_of_such_encoders_is_judged_as_any_other() -> None:
    measured, asked, body = back_and_forth(5)
    plain = {w: np.abs(y) for w, y in measured.items()}
    j = judged(plain, asked, body)
    assert j.events == ()
    assert not [f for sides in j.parts.values() for a in sides for f in a.findings]
    healthy = [float(np.mean(s[0].states == CODE[State.HEALTHY])) for s in j.parts.values()]
    assert min(healthy) > 0.5
    assert all("tells no direction" in " ".join(s[0].notes) for s in j.parts.values())
    plain["RL"][PART] = 0.0
    assert {
        w for w, s in judged(plain, asked, body).parts.items() for f in s[0].findings if f.mode is FaultMode.NO_SIGNAL
    } == {"RL"}


def test_speeds_with_a_sign_stay_as_they_are() -> None:
    measured, asked, body = speeds(21)
    assert all("tells no direction" not in " ".join(s[0].notes) for s in judged(measured, asked, body).parts.values())
    assert set(WHEELS) == set(measured)
