"""Machines on rollers that go sideways are known by their wheels where no command says so."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.response.assess import Judgement, assess_response
from diagnosis.response.blame import blame_by_commands
from diagnosis.response.inputs import FollowerData
from diagnosis.response.models import Blocks
from diagnosis.response.sideways import crossed, goes_sideways
from replay.faults import FaultMode
from replay.machine.config import Limits
from tests.diagnosis.response.robot import DT, WHEELS, followers_of, geometry, speeds

Array = NDArray[np.float64]

FAULT = slice(round(60 / DT), round(80 / DT))
#: Share of the speed to the left in the speed of each wheel with rollers.
LEFTWARD = {"FR": 1.0, "FL": -1.0, "RR": -1.0, "RL": 1.0}


def rollers(seed: int) -> dict[str, Array]:
    """Speeds of a mecanum base of which no command is recorded."""
    measured, _, _ = speeds(seed)
    forward, _, _ = speeds(seed + 50, ("FR",))
    left = 0.6 * np.roll(forward["FR"], round(20 / DT))
    rng = np.random.default_rng(seed)
    return {w: y + LEFTWARD[w] * left + rng.normal(0.0, 0.01, y.size) for w, y in measured.items()}


def judged(measured: dict[str, Array]) -> Judgement:
    nothing = {w: np.full(y.size, np.nan) for w, y in measured.items()}
    size = next(iter(measured.values())).size
    data: dict[str, FollowerData] = followers_of(measured, nothing, np.full((size, 2), np.nan))
    data = {w: replace(d, commands=d.commands[:, :1]) for w, d in data.items()}
    return assess_response(data, geometry(), None, Limits(driving_speed=0.05), DT)


def told(j: Judgement) -> set[tuple[str, FaultMode]]:
    return {(w, f.mode) for w, sides in j.parts.items() for a in sides for f in a.findings}


def test_a_healthy_base_on_rollers_raises_no_alarm_and_a_wrong_sensor_is_told_on_its_wheel() -> None:
    assert told(judged(rollers(5))) == set()
    halved = rollers(5)
    halved["RL"][FAULT] *= 0.5
    assert told(judged(halved)) == {("RL", FaultMode.INEFFICIENT)}


@pytest.mark.parametrize("wrong", ["", "dead", "half"])
def test_wheels_without_rollers_do_not_go_sideways_whatever_one_sensor_says(wrong: str) -> None:
    measured, _, _ = speeds(6)
    measured["FL"][FAULT] *= {"dead": 0.0, "half": 0.5}.get(wrong, 1.0)
    assert not goes_sideways(measured, geometry(), DT)
    turned = rollers(6)
    turned["FL"][FAULT] *= {"dead": 0.0, "half": 0.5}.get(wrong, 1.0)
    assert goes_sideways(turned, geometry(), DT)
    assert not goes_sideways(turned, None, DT)
    assert not goes_sideways({w: turned[w] for w in WHEELS[:2]}, geometry(), DT)


def test_wheels_of_one_axle_that_are_exchanged_follow_the_turns_and_those_on_rollers_do_not() -> None:
    measured, _, _ = speeds(6)
    yaw = measured["FR"] - measured["FL"]
    measured["FL"], measured["FR"] = measured["FR"], measured["FL"]
    assert goes_sideways(measured, geometry(), DT)
    assert crossed(measured, geometry(), yaw)
    assert not crossed(measured, geometry(), None)
    turned = rollers(6)
    assert not crossed(turned, geometry(), turned["FR"] + turned["RR"] - turned["FL"] - turned["RL"])


def test_a_wheel_that_keeps_to_its_command_is_not_blamed_where_rollers_slip() -> None:
    """The others slip as they are set going; what this exact one misses of its command is far less than what it differs from them."""
    number, top = 400, 1.0
    asked = np.repeat(np.random.default_rng(2).choice([-0.8, -0.3, 0.4, 0.9], number // 10), 10)
    slip = np.zeros(number)
    slip[200:216] = 0.3
    blocks = {
        w: _blocks(asked + (0.02 if w == "RR" else -0.03) * (slip > 0.0), asked, 0.001 if w == "RR" else 0.01)
        for w in WHEELS
    }
    apart = asked + slip
    blame, nobody = blame_by_commands(blocks["RR"], [blocks[w] for w in WHEELS[:2]], apart)
    assert blame[204:212].max() < 0.2
    assert nobody is not None
    assert nobody[204:212].min() > 0.5
    wrong = blocks["RR"]._replace(mean=np.where(slip > 0.0, 0.6 * asked, asked))
    assert blame_by_commands(wrong, [blocks[w] for w in WHEELS[:2]], asked * top)[0][204:212].min() > 0.9


def _blocks(mean: Array, asked: Array, noise: float) -> Blocks:
    flat, none = np.full(mean.size, noise), np.zeros(mean.size)
    readings = np.full(mean.size, 25.0)
    return Blocks(np.arange(mean.size) * 25, mean, asked, asked, flat, readings, none, none, flat, flat)
