"""One cause beats several faults at one time; what tells sensor from drive."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.response.assess import assess_response
from diagnosis.response.beside import _turned
from diagnosis.response.channel import samples_of, without_holds
from diagnosis.response.nowhere import goes_nowhere
from diagnosis.results.assessment import Finding
from replay.faults import FaultMode, Side
from replay.machine.config import Limits
from tests.campaigns import campaign
from tests.diagnosis.response.robot import DT, TRACK, followers_of, geometry, speeds

Array = NDArray[np.float64]

LIMITS = Limits(driving_speed=0.05)


def found(
    measured: dict[str, Array], asked: dict[str, Array], body: Array, yaw: Array | None = None
) -> list[tuple[str, Side, Finding]]:
    parts = assess_response(followers_of(measured, asked, body), geometry(tuple(measured)), yaw, LIMITS, DT).parts
    out = [(w, f.side, f) for w, sides in parts.items() for a in sides for f in a.findings]
    return list({(w, f.start, f.mode): (w, s, f) for w, s, f in out}.values())


def span(first: float, last: float) -> slice:
    return slice(round(first / DT), round(last / DT))


@pytest.mark.parametrize("kind", ["stuck", "noisy"])
def test_a_stop_of_the_machine_in_the_middle_of_a_sensors_fault_blames_no_other_wheel(kind: str) -> None:
    measured, asked, body = speeds(21)
    fault, stop = span(60, 90), span(70, 80)
    for y in measured.values():
        y[stop] = 0.0
    rng = np.random.default_rng(1)
    y = measured["RL"]
    y[fault] = y[fault.start - 1] if kind == "stuck" else y[fault] + rng.uniform(-0.3, 0.3, y[fault].size)
    told = found(measured, asked, body)
    assert {w for w, _, _ in told} == {"RL"}
    assert any(f.mode is FaultMode(kind) for _, _, f in told)


@pytest.mark.parametrize("seed", campaign([21, 24]))
def test_of_two_wheels_the_one_that_stands_with_the_machine_is_not_blamed_for_a_shift_of_the_other(seed: int) -> None:
    measured, asked, body = speeds(seed, ("FR", "FL"))
    fault, stop = span(60, 85), span(66, 73)
    for w, c in asked.items():
        body[stop], c[stop] = (1.0, 0.0), 1.0
        measured[w][stop] = 0.0
    yaw = (measured["FR"] - measured["FL"]) / TRACK + np.random.default_rng(seed).normal(0.0, 0.01, body.shape[0])
    measured["FL"][fault] += 0.2
    assert {w for w, _, f in found(measured, asked, body, yaw) if f.mode is FaultMode.NO_SIGNAL} == set()


@pytest.mark.parametrize("kind", ["noise", "spikes", "stuck"])
def test_of_two_wheels_the_one_that_stands_is_not_blamed_where_the_other_one_makes_no_way_either(kind: str) -> None:
    """An emergency stop while the other encoder is noisy, wild, or held (its position tells)."""
    measured, asked, body = speeds(27, ("FR", "FL"))
    fault, stop = span(60, 85), span(66, 78)
    for w, c in asked.items():
        body[stop], c[stop] = (0.7, 0.0), 0.7
        measured[w][stop] = 0.0
    rolled = {w: y.copy() for w, y in measured.items()}
    rng, y = np.random.default_rng(4), measured["FL"]
    inside = np.arange(fault.start, fault.stop)
    if kind == "noise":
        y[inside] += rng.normal(0.0, 0.15, inside.size)
    elif kind == "spikes":
        y[rng.choice(inside, 25)] += 6.0
    else:
        y[inside] = y[fault.start - 1]
    positions = kind == "stuck"
    data = {
        w: replace(d, rolled=rolled[w] if positions else None) for w, d in followers_of(measured, asked, body).items()
    }
    parts = assess_response(data, geometry(("FR", "FL")), None, LIMITS, DT).parts
    assert {f.mode for a in parts["FR"] for f in a.findings} == set()
    assert {f.mode for f in parts["FL"][0].findings} <= {FaultMode.NOISY, FaultMode.STUCK}


def test_of_two_wheels_a_dead_one_is_told_beside_a_noisy_one_that_goes_on() -> None:
    measured, asked, body = speeds(27, ("FR", "FL"))
    rng = np.random.default_rng(4)
    measured["FL"][span(60, 85)] += rng.normal(0.0, 0.15, 500)
    measured["FR"][span(66, 78)] = 0.0
    assert ("FR", FaultMode.NO_SIGNAL) in {(w, f.mode) for w, _, f in found(measured, asked, body)}


def test_a_share_of_the_speed_is_no_standstill_and_a_position_that_never_moves_tells_none() -> None:
    rng, part = np.random.default_rng(5), slice(400, 800)
    y, asked = 0.5 + rng.normal(0.0, 0.005, 1200), np.full(1200, 0.5)
    one = followers_of({"FR": y}, {"FR": asked}, np.full((1200, 1), 0.5))["FR"]
    for share, noise, stands in ((0.1, 0.0, False), (0.0, 0.2, True), (0.6, 0.2, False), (1.0, 0.0, False)):
        z = y.copy()
        z[part] = share * y[part] + rng.normal(0.0, noise, 400)
        assert goes_nowhere(replace(one, y=z), part, 0.05, DT) == stands
    assert not goes_nowhere(replace(one, rolled=np.zeros(1200)), part, 0.05, DT)
    still = np.where(np.arange(1200) // 400 == 1, 0.0, y)
    assert goes_nowhere(replace(one, rolled=still), part, 0.05, DT)


def test_wheels_that_a_runaway_neighbour_holds_back_are_no_faults_of_their_own() -> None:
    """A frozen encoder lets its loop run away; two others stand for a while, as it pushes against them."""
    measured, asked, body = speeds(22)
    fault, held = span(60, 80), span(66, 74)
    measured["FR"][fault] = 0.437
    for w in ("RR", "RL"):
        measured[w][held] *= np.r_[np.linspace(1, 0, 30), np.zeros(held.stop - held.start - 60), np.linspace(0, 1, 30)]
    assert {w for w, _, _ in found(measured, asked, body)} == {"FR"}


def test_a_wheel_at_rest_that_creeps_is_no_dead_sensor() -> None:
    measured, asked, body = speeds(23, ("FR", "FL"))
    yaw = (measured["FR"] - measured["FL"]) / TRACK
    part = span(60, 70)
    rng = np.random.default_rng(2)
    measured["FL"][part] = np.round(0.004 + rng.normal(0.0, 0.002, part.stop - part.start), 4)
    assert all(side is not Side.SENSOR for _, side, _ in found(measured, asked, body, yaw))


def test_a_dead_sensor_is_told_where_a_gyro_shows_that_its_wheel_turns() -> None:
    measured, asked, body = speeds(24, ("FR", "FL"))
    yaw = (measured["FR"] - measured["FL"]) / TRACK
    measured["FL"][span(60, 70)] = 0.0
    ((wheel, side, finding),) = found(measured, asked, body, yaw)
    assert (wheel, side, finding.mode) == ("FL", Side.SENSOR, FaultMode.NO_SIGNAL)


def test_a_whirl_of_one_tenth_of_the_mission_does_not_make_the_relation_to_the_yaw_rate() -> None:
    rng = np.random.default_rng(3)
    x, yaw = np.full(400, 0.5), rng.choice([-0.3, 0.0, 0.3], 400)
    y = x + 0.6 * yaw + rng.normal(0.0, 0.005, 400)
    yaw[200:240], y[200:240] = 4.5, 0.0
    speed = _turned(y, x, yaw)
    assert speed is not None
    assert np.median(np.abs(speed - x - 0.6 * yaw)[200:240]) < 0.1


def test_a_value_that_is_held_for_long_is_no_answer_to_a_command() -> None:
    y = np.sin(np.arange(400) * 0.05)
    y[100:300] = 0.7
    out = without_holds(y, samples_of(y, np.ones(400, np.bool_)), DT)
    assert np.isnan(out[101:300]).all()
    assert np.isfinite(out[:100]).all()
    y[100:300] = 0.0  # a wheel at rest is an answer
    assert np.isfinite(without_holds(y, samples_of(y, np.ones(400, np.bool_)), DT)).all()


@pytest.mark.parametrize("seed", campaign([2, 8]))
def test_a_wheel_that_stands_for_most_of_the_mission_is_told_and_not_the_one_beside_it(seed: int) -> None:
    """Nothing is left of its own answer to the command, and the other wheel of its side differs from it just as much."""
    measured, asked, body = speeds(seed)
    measured["RL"][round(45 / DT) :] = 0.0
    j = assess_response(followers_of(measured, asked, body), geometry(), None, LIMITS, DT)
    found = {w: {f.mode for f in sensor.findings} for w, (sensor, _) in j.parts.items()}
    assert found == {"FR": set(), "FL": set(), "RR": set(), "RL": {FaultMode.NO_SIGNAL}}


@pytest.mark.parametrize("kept", [False, True], ids=["unwinds", "goes on"])
def test_what_a_loop_unwinds_after_a_held_sensor_is_no_fault_of_its_own(kept: bool) -> None:
    """The controller saw too little while the sensor stood, and drives the wheel too fast for two seconds when it reads again."""
    measured, asked, body = speeds(21)
    measured["RL"][span(60, 74)] = measured["RL"][span(60, 61)][0] + 0.1
    after = span(74, 82 if kept else 76)
    measured["RL"][after] *= 1.35
    told = [(f.mode, f.start * DT) for w, _, f in found(measured, asked, body) if w == "RL"]
    assert FaultMode.STUCK in {mode for mode, _ in told}
    assert any(start > 73.0 for _, start in told) is kept
