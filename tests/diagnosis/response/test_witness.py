"""A satellite receiver shows that a machine went as it was told, whatever its speeds say."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.response.assess import Judgement, assess_response
from diagnosis.response.body import BodySpeed
from diagnosis.response.inputs import cells
from diagnosis.response.models import BLOCK_S
from replay.machine.config import Limits
from tests.diagnosis.response.robot import DT, followers_of, geometry, speeds

Array = NDArray[np.float64]

LIMITS = Limits(driving_speed=0.05)
WIDTH = round(BLOCK_S / DT)
STOP = slice(round(60 / DT), round(80 / DT))


def receiver(v: Array, name: str = "speed over ground") -> BodySpeed:
    noisy = np.abs(v + np.random.default_rng(1).normal(0.0, 0.03, v.size))
    return BodySpeed(name, cells(noisy, WIDTH), name == "odometry", 1)


def judged(measured: dict[str, Array], asked: dict[str, Array], body: Array, *sensors: BodySpeed) -> Judgement:
    return assess_response(followers_of(measured, asked, body), geometry(tuple(measured)), None, LIMITS, DT, sensors)


def standing(seed: int) -> tuple[dict[str, Array], dict[str, Array], Array, Array]:
    """All speeds are 0 for a while in which the machine is told to drive; last: how it went on."""
    measured, asked, body = speeds(seed)
    went = np.mean(list(measured.values()), axis=0)
    body[STOP], went[STOP] = (0.7, 0.0), 0.7
    for w in measured:
        measured[w][STOP], asked[w][STOP] = 0.0, 0.7
    return measured, asked, body, went


def test_speeds_that_stand_while_the_receiver_moves_are_no_machine_that_did_not_follow() -> None:
    measured, asked, body, went = standing(7)
    j = judged(measured, asked, body, receiver(went))
    assert j.events == ()
    assert "speed over ground shows that the machine went" in " ".join(x.text for x in j.unshown)
    assert not [f for sides in j.parts.values() for a in sides for f in a.findings]


@pytest.mark.parametrize("sensor", ["stands, too", "odometry", "none"])
def test_without_such_a_receiver_the_machine_did_not_follow(sensor: str) -> None:
    """Odometry may be made of the commands."""
    measured, asked, body, went = standing(7)
    stood = went.copy()
    stood[STOP] = 0.0
    seen = {"stands, too": (receiver(stood),), "odometry": (receiver(went, "odometry"),)}.get(sensor, ())
    j = judged(measured, asked, body, *seen)
    assert any("stood still together" in e.text for e in j.events)
    assert j.unshown == ()


@pytest.mark.parametrize("seen", [True, False])
def test_speeds_that_nothing_relates_to_commands_are_wrong_where_the_receiver_follows_them(seen: bool) -> None:
    measured, asked, body = speeds(8)
    went = np.mean(list(measured.values()), axis=0)
    rng = np.random.default_rng(8)
    measured = {w: np.abs(rng.normal(0.0, 0.02, y.size)) for w, y in measured.items()}
    for c in asked.values():
        c[c == 0.0] = 0.4
    went = np.where(np.abs(went) < 0.1, 0.4, went)
    j = judged(measured, asked, body, *((receiver(went),) if seen else ()))
    assert bool(j.unshown) is seen
    assert bool(j.unrelated) is not seen
    assert j.events == ()


@pytest.mark.parametrize("over_ground", [0.4, 0.01])
def test_a_slow_machine_whose_speeds_contradict_the_receiver_did_not_ignore_its_commands(over_ground: float) -> None:
    """It goes half as fast as it is told, and its speeds read almost nothing; where the receiver reads so, too, it did not follow."""
    measured, asked, body = speeds(8)
    rng = np.random.default_rng(8)
    measured = {w: np.abs(rng.normal(0.0, 0.02, y.size)) for w, y in measured.items()}
    asked = {w: np.full(c.size, 0.8) for w, c in asked.items()}
    j = judged(measured, asked, body, receiver(np.full(body.shape[0], over_ground)))
    seen = over_ground > 0.1
    assert any("went at" in e.text for e in j.unshown) is seen
    assert bool(j.unrelated) is not seen
    assert j.events == ()


@pytest.mark.parametrize("over_ground", [0.4, 0.01])
def test_so_of_drives_that_were_judged_but_did_not_answer(over_ground: float) -> None:
    """Their readings are of something else, and vary enough to be judged."""
    measured, asked, body = speeds(8)
    rng = np.random.default_rng(8)
    slow = np.repeat(rng.uniform(0.0, 0.2, body.shape[0] // 100 + 1), 100)[: body.shape[0]]
    measured = {w: slow + rng.normal(0.0, 0.005, slow.size) for w in measured}
    asked = {w: np.full(c.size, 0.8) for w, c in asked.items()}
    j = judged(measured, asked, body, receiver(np.full(body.shape[0], over_ground)))
    seen = over_ground > 0.1
    assert j.parts
    assert any("went at" in e.text for e in j.unshown) is seen
    assert bool(j.unrelated) is not seen
    assert j.events == ()
