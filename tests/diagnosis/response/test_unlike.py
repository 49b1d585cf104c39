"""A factor on one wheel from the start of a log to its end: nothing is called healthy where nothing tells which wheel is right."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.response.assess import Judgement, assess_response
from diagnosis.response.inputs import FollowerData
from diagnosis.results.assessment import CODE
from diagnosis.results.machine_event import wheels_apart
from replay.faults import State
from replay.machine.config import Limits
from tests.campaigns import campaign
from tests.diagnosis.response.robot import DT, followers_of, geometry, robot_of, speeds

Array = NDArray[np.float64]

LIMITS = Limits(driving_speed=0.05)


def judged(measured: dict[str, Array], asked: dict[str, Array], body: Array, *, told: bool) -> Judgement:
    data: dict[str, FollowerData] = followers_of(measured, asked, body)
    if not told:
        nothing = np.full(body.shape[0], np.nan)
        data = {w: replace(d, commands=np.full_like(d.commands, np.nan), asked=nothing) for w, d in data.items()}
    return assess_response(data, geometry(tuple(measured)), None, LIMITS, DT)


def healthy(j: Judgement, wheel: str) -> float:
    """Share of the driving in which a sensor is called healthy."""
    states = j.parts[wheel][0].states
    return float(np.mean(states[states != CODE[State.NOT_EXCITED]] == CODE[State.HEALTHY]))


def scaled(seed: int, wheels: tuple[str, ...], factor: float) -> tuple[dict[str, Array], dict[str, Array], Array]:
    measured, asked, body = speeds(seed)
    return {w: y * (factor if w in wheels else 1.0) for w, y in measured.items()}, asked, body


@pytest.mark.parametrize("seed", campaign([1, 2, 3, 4]))
@pytest.mark.parametrize("factor", [0.8, 1.3])
def test_one_wheel_by_commands(seed: int, factor: float) -> None:
    j = judged(*scaled(seed, ("RL",), factor), told=True)
    assert healthy(j, "RL") == 0.0
    assert healthy(j, "FR") > 0.8
    assert not [f for sensor, drive in j.parts.values() for f in (*sensor.findings, *drive.findings)]


@pytest.mark.parametrize("factor", [0.8, 1.3])
def test_a_whole_side_by_commands_leaves_both_sides_open(factor: float) -> None:
    j = judged(*scaled(5, ("FL", "RL"), factor), told=True)
    assert [healthy(j, w) for w in j.parts] == [0.0] * 4


@pytest.mark.parametrize("seed", campaign([1, 2, 3]))
def test_without_commands_two_wheels_of_a_side_that_differ_are_open(seed: int) -> None:
    j = judged(*scaled(seed, ("RL",), 0.8), told=False)
    assert healthy(j, "RL") == healthy(j, "FL") == 0.0
    assert healthy(j, "FR") > 0.5
    assert "what FL make of the same motion" in j.parts["RL"][0].reasons[State.NOT_ASSESSED]


@pytest.mark.parametrize("seed", campaign([1, 2, 3]))
def test_without_commands_a_healthy_robot_is_judged_and_what_does_not_show_is_said(seed: int) -> None:
    j = judged(*speeds(seed), told=False)
    assert all(healthy(j, w) > 0.5 for w in j.parts)
    assert all("would not show" in sensor.hidden for sensor, _ in j.parts.values())


def sideways(seed: int) -> dict[str, Array]:
    """Speeds of wheels with rollers that go forward, sideways and around."""
    rng = np.random.default_rng(seed)
    v, lateral, turn = (np.repeat(rng.uniform(-0.5, 0.5, 50), 60) for _ in range(3))
    made = {
        "FR": v + lateral + 0.3 * turn,
        "FL": v - lateral - 0.3 * turn,
        "RR": v - lateral + 0.3 * turn,
        "RL": v + lateral - 0.3 * turn,
    }
    return {w: y + rng.normal(0.0, 0.01, y.size) for w, y in made.items()}


@pytest.mark.parametrize("factor", [1.0, 0.8, 1.3])
def test_wheels_with_rollers_by_the_one_sum_that_is_always_zero(factor: float) -> None:
    measured = sideways(4)
    measured["RR"] = factor * measured["RR"]
    _, asked, body = robot_of(np.zeros(3000), np.zeros(3000), 1)
    j = judged(measured, asked, body, told=False)
    assert (healthy(j, "RR") == 0.0) == (factor != 1.0)
    assert all(healthy(j, w) > 0.5 for w in ("FR", "FL", "RL"))


def test_without_commands_the_wheel_that_contradicts_the_others_is_in_the_verdict() -> None:
    (sentence, *_) = judged(*scaled(1, ("RL",), 0.8), told=False).apart
    assert "what FL make of the same motion" in sentence or "what RL make of the same motion" in sentence
    assert judged(*speeds(1), told=False).apart == ()
    assert judged(*scaled(1, ("RL",), 0.8), told=True).apart == ()
    assert [e.title for e in wheels_apart(("FL speed sensor: x.",))] == ["One {wheel} contradicts the others"]
    assert wheels_apart(()) == ()


def test_a_wheel_that_never_reads_anything_is_told_where_all_others_turn() -> None:
    measured, asked, body = speeds(1)
    dead = {**measured, "RL": np.zeros_like(measured["RL"])}
    j = judged(dead, asked, body, told=False)
    assert (
        [s for s in j.apart if "it reads 0 from start to end" in s] == [s for s in j.apart if s.startswith("RL")] != []
    )
    assert all("it reads 0" in side.reasons[State.NOT_ASSESSED] for side in j.parts["RL"])
    assert not any((side.states == CODE[State.NOT_EXCITED]).any() for side in j.parts["RL"])
    still = {w: np.zeros_like(y) if w != "FR" else y for w, y in measured.items()}
    assert judged(still, asked, body, told=False).apart == ()
