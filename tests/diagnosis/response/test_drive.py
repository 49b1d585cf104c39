"""Drives without effort: what the yaw rate and the other side show of a wheel that does something else than its command."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.response.assess import assess_response
from diagnosis.response.identification import as_another, identify_response
from diagnosis.response.inputs import cells
from diagnosis.results.assessment import Assessment, Finding
from replay.faults import FaultMode, Side
from replay.machine.config import Limits
from tests.campaigns import campaign
from tests.diagnosis.response.robot import DT, TRACK, WHEELS, followers_of, geometry, speeds

Array = NDArray[np.float64]

LIMITS = Limits(driving_speed=0.05)
TWO = ("R", "L")


def yaw_of(wheels: dict[str, Array], seed: int) -> Array:
    """What a gyro shows of wheels that turn so [rad/s]."""
    right, left = (np.mean([y for w, y in wheels.items() if w.endswith(s)], axis=0) for s in "RL")
    noise = np.random.default_rng(seed).normal(0.0, 0.01, right.size)
    return np.asarray((right - left) / TRACK + noise)


def judged(
    wheels: tuple[str, ...], faulty: str, share: float, span: tuple[float, float], *, sensor: bool, seed: int = 3
) -> dict[str, tuple[Assessment, Assessment]]:
    """Both sides of each wheel, where one reads `share` of its speed in seconds `span`: its sensor, or because it turns so."""
    measured, asked, body = speeds(seed, wheels)
    yaw = yaw_of(measured, seed)
    part = slice(round(span[0] / DT), round(span[1] / DT))
    slows = np.minimum(np.arange(part.stop - part.start) * DT / 0.3, 1.0) if share == 0.0 and not sensor else 1.0
    measured[faulty][part] = np.round((1.0 - (1.0 - share) * slows) * measured[faulty][part], 3)
    if not sensor:
        yaw = yaw_of(measured, seed)
    data = followers_of(measured, asked, body)
    return dict(assess_response(data, geometry(wheels), yaw, LIMITS, DT).parts)


def told(parts: dict[str, tuple[Assessment, Assessment]]) -> list[tuple[str, Finding]]:
    found = {id(f): (w, f) for w, sides in parts.items() for side in sides for f in side.findings}
    return list(found.values())


@pytest.mark.turns("wheels")
@pytest.mark.parametrize("wheels", [TWO, WHEELS])
@pytest.mark.parametrize(("share", "mode"), [(0.6, FaultMode.INEFFICIENT), (0.0, FaultMode.NO_SIGNAL)])
def test_a_drive_is_at_fault_where_the_body_turns_as_the_reading_says(
    wheels: tuple[str, ...], share: float, mode: FaultMode
) -> None:
    faulty = wheels[1]
    found = told(judged(wheels, faulty, share, (60.0, 85.0), sensor=False))
    assert {w for w, _ in found} == {faulty}
    assert {f.side for _, f in found} == {Side.ACTUATOR}
    assert mode in {f.mode for _, f in found}


@pytest.mark.parametrize("wheels", campaign([WHEELS, TWO]))
def test_a_sensor_is_at_fault_where_the_body_turns_as_commanded(wheels: tuple[str, ...]) -> None:
    found = told(judged(wheels, wheels[1], 0.6, (60.0, 85.0), sensor=True))
    assert {w for w, _ in found} == {wheels[1]}
    assert Side.ACTUATOR not in {f.side for _, f in found}


def test_a_drive_that_is_weak_for_most_of_the_mission_is_held_against_the_other_one() -> None:
    parts = judged(TWO, "L", 0.55, (45.0, 150.0), sensor=False)
    assert {(w, f.side) for w, f in told(parts)} == {("L", Side.ACTUATOR)}
    seconds = sum(f.stop - f.start for _, f in told(parts)) * DT
    assert seconds > 60.0


def test_wheels_that_stand_together_are_the_machines_however_slow_the_command() -> None:
    measured, asked, body = speeds(4, TWO)
    part = slice(round(60.0 / DT), round(68.0 / DT))
    for k, w in enumerate(TWO):
        asked[w][part] = 0.08 * (1 - 2 * k)
        measured[w][part] = 0.0
    body[part] = 0.0, 0.16 / TRACK
    parts = assess_response(followers_of(measured, asked, body), geometry(TWO), None, LIMITS, DT).parts
    assert told(dict(parts)) == []


def test_a_wheel_of_the_other_side_answers_the_turn_the_other_way() -> None:
    measured, asked, body = speeds(5, TWO)
    columns = np.column_stack([cells(body[:, k], 1) for k in range(2)])
    right = identify_response(measured["R"], columns, DT, 0.05)
    assert right is not None
    left = as_another(right, columns, np.array([1.0, -1.0]), DT)
    assert left.weights == pytest.approx([right.weights[0], -right.weights[1]])
    assert np.median(np.abs(left.expected - measured["L"])) < 0.03
    assert asked["L"].size == left.expected.size


def test_a_reading_that_falls_dead_is_open_though_the_body_of_a_machine_with_more_wheels_turns_so() -> None:
    measured, asked, body = speeds(3, WHEELS)
    measured["RL"][round(60.0 / DT) : round(85.0 / DT)] = 0.0
    data = followers_of(measured, asked, body)
    found = told(dict(assess_response(data, geometry(WHEELS), yaw_of(measured, 3), LIMITS, DT).parts))
    assert {(w, f.side) for w, f in found} == {("RL", Side.SENSOR_OR_ACTUATOR)}


def test_a_wheel_that_reads_nothing_for_most_of_the_mission_is_told_beside_others_that_answer() -> None:
    measured, asked, body = speeds(14)
    part = slice(round(30 / DT), measured["RL"].size)
    measured["RL"][part] *= np.exp(-np.arange(part.stop - part.start) * DT / 0.1)  # a smoothed speed never reads 0
    parts = assess_response(followers_of(measured, asked, body), geometry(), None, LIMITS, DT).parts
    told = {(w, f.mode) for w, sides in parts.items() for a in sides for f in a.findings}
    assert told == {("RL", FaultMode.NO_SIGNAL)}


def test_what_the_beginning_and_end_of_a_jam_do_to_the_other_wheel_hides_it_not() -> None:
    """Both are off their commands for a moment then, as where commands are ignored."""
    measured, asked, body = speeds(15, ("FR", "FL"))
    jam = slice(round(60 / DT), round(76 / DT))
    body[jam], measured["FL"][jam], measured["FR"][jam] = (0.8, 0.0), 0.0, 0.8
    measured["FR"][jam] += np.random.default_rng(6).normal(0.0, 0.01, jam.stop - jam.start)
    for c in asked.values():
        c[jam] = 0.8
    swing = np.sin(np.linspace(0.0, np.pi, round(1.8 / DT)))
    for at in (jam.start, jam.stop):
        measured["FR"][at : at + swing.size] -= 0.45 * swing
    measured["FL"][jam.stop : jam.stop + swing.size] += 0.35 * swing
    yaw = (measured["FR"] - measured["FL"]) / TRACK + np.random.default_rng(5).normal(0.0, 0.01, body.shape[0])
    data = followers_of(measured, asked, body)
    parts = assess_response(data, geometry(("FR", "FL")), yaw, LIMITS, DT).parts
    told = {(w, f.side) for w, sides in parts.items() for a in sides for f in a.findings}
    assert told == {("FL", Side.ACTUATOR)}
