"""Velocity-controlled robots: sensors by command, by the other wheels, and by the channel alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.response.assess import Judgement, assess_response
from diagnosis.results.assessment import CODE, Finding, Lack
from diagnosis.results.detectability import Deviation, Powers
from replay.faults import FaultMode, Side, State
from replay.machine.config import Limits
from tests.campaigns import campaign
from tests.diagnosis.response.robot import DT, TRACK, WHEELS, commands, followers_of, geometry, robot_of, speeds

Array = NDArray[np.float64]

LIMITS = Limits(driving_speed=0.05)
PART = slice(round(60 / DT), round(70 / DT))


def judged(measured: dict[str, Array], asked: dict[str, Array], body: Array, yaw: Array | None = None) -> Judgement:
    names = tuple(measured)
    return assess_response(followers_of(measured, asked, body), geometry(names), yaw, LIMITS, DT)


def findings(j: Judgement) -> list[tuple[str, Finding]]:
    return [(w, f) for w, (sensor, _) in j.parts.items() for f in sensor.findings]


def share(j: Judgement, wheel: str, state: State) -> float:
    states = j.parts[wheel][0].states
    driven = states != CODE[State.NOT_EXCITED]
    return float(np.mean(states[driven] == CODE[state]))


def put(y: Array, kind: str) -> Array:
    y, rng = y.copy(), np.random.default_rng(9)
    size = PART.stop - PART.start
    if kind == "no_signal":
        y[PART] = 0.0
    elif kind == "stuck":
        y[PART] = y[PART.start - 1]
    elif kind == "inefficient":
        y[PART] *= 0.5
    elif kind == "noisy":
        y[PART] += rng.uniform(-0.25, 0.25, size)
    else:
        at = PART.start + np.flatnonzero(rng.random(size) < 0.04)
        y[at] += rng.choice([-15.0, 15.0], at.size)
    return y


@pytest.mark.parametrize("seed", campaign([1, 2, 3]))
def test_a_healthy_robot_raises_nothing_and_is_judged_nearly_all_the_time(seed: int) -> None:
    j = judged(*speeds(seed))
    assert findings(j) == []
    assert all(share(j, w, State.HEALTHY) > 0.95 for w in WHEELS)
    assert j.events == ()


@pytest.mark.parametrize("kind", ["no_signal", "stuck", "inefficient", "noisy", "spikes"])
@pytest.mark.parametrize("seed", campaign([4, 5]))
def test_a_fault_of_ten_seconds_is_found_at_its_wheel_and_its_side_left_open_where_20_hz_do_not_tell_it(
    kind: str, seed: int
) -> None:
    measured, asked, body = speeds(seed)
    measured["RL"] = put(measured["RL"], kind)
    ((wheel, found),) = findings(judged(measured, asked, body))
    assert wheel == "RL"
    assert (
        found.side is (Side.SENSOR if kind in ("stuck", "noisy", "spikes") else Side.SENSOR_OR_ACTUATOR)
        or kind == "inefficient"
    )
    assert found.mode is (FaultMode.NOISY if kind == "spikes" else FaultMode(kind))
    assert found.start < PART.stop
    assert found.stop > PART.start
    assert abs(found.start - PART.start) * DT < 1.5


def test_with_two_wheels_and_a_gyro_the_right_one_is_blamed() -> None:
    measured, asked, body = speeds(6, ("FR", "FL"))
    yaw = (measured["FR"] - measured["FL"]) / TRACK + np.random.default_rng(1).normal(0.0, 0.01, body.shape[0])
    measured["FL"] = put(measured["FL"], "inefficient")
    ((wheel, found),) = findings(judged(measured, asked, body, yaw))
    assert (wheel, found.side, found.mode) == ("FL", Side.SENSOR, FaultMode.INEFFICIENT)
    assert found.epsilon is not None
    assert found.epsilon.value == pytest.approx(0.5, abs=0.1)


def test_a_machine_that_stands_while_it_is_commanded_blames_no_wheel() -> None:
    measured, asked, body = speeds(7)
    stop = slice(round(100 / DT), round(120 / DT))
    for y in measured.values():
        y[stop] = 0.0
    j = judged(measured, asked, body)
    assert findings(j) == []
    assert len(j.events) == 1
    assert "no {wheel} is blamed" in j.events[0].text
    assert all(j.parts[w][0].states[stop.start + 100] != CODE[State.HEALTHY] for w in WHEELS)


def test_commands_that_go_elsewhere_are_told_and_blame_no_wheel() -> None:
    measured, asked, body = speeds(8)
    part = slice(round(100 / DT), round(115 / DT))
    body[part] = 0.0
    for c in asked.values():
        c[part] = 0.0
    j = judged(measured, asked, body)
    assert findings(j) == []
    assert any("all drives together did something else" in n for n in j.parts["FR"][0].notes)
    assert len(j.events) == 1
    assert "no {wheel} is blamed" in j.events[0].text


@pytest.mark.parametrize("scale", campaign([0.5, 1.5, 0.7], 2))
def test_a_scale_over_the_whole_mission_is_not_called_healthy(scale: float) -> None:
    measured, asked, body = speeds(9)
    measured["FL"] *= scale
    j = judged(measured, asked, body)
    assert share(j, "FL", State.HEALTHY) == 0.0
    assert "what the other {wheels} make of the same command" in j.parts["FL"][0].reasons[State.NOT_ASSESSED]
    assert share(j, "FR", State.HEALTHY) > 0.9


@pytest.mark.parametrize("seed", campaign([1, 3]))
def test_half_a_speed_that_turns_of_which_nothing_is_logged_would_hide_is_not_called_healthy(seed: int) -> None:
    v, turn = commands(seed)
    measured, asked, _ = robot_of(v, 2.0 * turn, seed, ("FR", "FL"))
    half = slice(PART.start, PART.start + round(20 / DT))
    measured["FL"][half] *= 0.5
    j = judged(measured, dict.fromkeys(asked, v), v[:, np.newaxis])
    sensor, _ = j.parts["FL"]
    assert findings(j) == []
    assert CODE[State.HEALTHY] not in sensor.states[half]
    assert "half of it would not show" in sensor.reasons[State.NOT_ASSESSED]


def test_without_commands_wheels_of_a_side_judge_each_other() -> None:
    measured, asked, body = speeds(10)
    measured["RR"] = put(measured["RR"], "no_signal")
    nothing = {w: np.full_like(c, np.nan) for w, c in asked.items()}
    j = judged(measured, nothing, np.full_like(body, np.nan))
    assert {w for w, _ in findings(j)} <= {"RR", "FR"}
    assert share(j, "FL", State.HEALTHY) > 0.9


def test_no_drive_is_called_healthy_without_its_effort() -> None:
    j = judged(*speeds(11))
    assert all(CODE[State.HEALTHY] not in drive.states for _, drive in j.parts.values())
    assert "effort" in j.parts["FR"][1].reasons[State.NOT_ASSESSED]


@pytest.mark.parametrize("count", campaign([3, 12]))
def test_what_would_have_shown_is_found_when_it_is_there(count: int) -> None:
    measured, asked, body = speeds(12)
    powers = judged(measured, asked, body).parts["FR"][0].powers
    assert isinstance(powers, Powers)
    loss = {(p.deviation, p.for_s): p for p in powers.rows}[Deviation.INEFFICIENT, 10.0]
    assert loss.size is not None
    assert loss.share is not None
    rng = np.random.default_rng(2)
    driven = np.flatnonzero(np.abs(asked["FR"][:-400]) > 0.3)
    found = 0
    places = rng.choice(driven, count)
    for start in places:
        y = measured["FR"].copy()
        y[start : start + 200] *= 1.0 - loss.size
        found += any(w == "FR" for w, _ in findings(judged({**measured, "FR": y}, asked, body)))
    assert found >= len(places) - 1


def test_what_lasts_all_through_shows_by_the_other_wheels_alone() -> None:
    """The response is found in the mission itself: it takes a lasting loss, and lasting noise, for its own."""
    measured, asked, body = speeds(13)
    powers = judged(measured, asked, body).parts["FR"][0].powers
    assert powers is not None
    size = {p.deviation: p.size for p in powers.rows if p.for_s is None}
    loss = size[Deviation.INEFFICIENT]
    assert loss == pytest.approx(0.13, abs=0.04)
    assert size[Deviation.NOISY] is None
    for less, cleared in ((loss - 0.02, True), (loss + 0.02, False)):
        j = judged({**measured, "FR": (1.0 - less) * measured["FR"]}, asked, body)
        assert findings(j) == []
        assert (share(j, "FR", State.HEALTHY) > 0.9) is cleared
    one = judged({"FR": measured["FR"]}, {"FR": asked["FR"]}, body).parts["FR"][0].powers
    assert one is not None
    assert {p.size for p in one.rows if p.for_s is None and p.deviation is Deviation.INEFFICIENT} == {None}


def test_speeds_in_another_unit_than_their_commands_are_not_called_healthy() -> None:
    measured, asked, body = speeds(11)
    for y in measured.values():
        y *= 0.3
    j = judged(measured, asked, body)
    assert all(share(j, w, State.HEALTHY) == 0.0 for w in WHEELS)
    assert "× its command: a wrong unit" in j.parts["FR"][0].reasons[State.NOT_ASSESSED]


def test_drives_that_make_nothing_of_their_commands_are_told_and_blame_no_wheel() -> None:
    measured, asked, body = speeds(12)
    rng = np.random.default_rng(2)
    slow = {w: np.abs(rng.normal(0.1, 0.05, y.size)) for w, y in measured.items()}
    j = judged(
        slow,
        {w: np.full(c.size, 1.0) for w, c in asked.items()},
        np.column_stack([np.ones(len(body)), 0.0 * body[:, 0]]),
    )
    assert findings(j) == []
    assert any("nothing relates the two" in e for e in j.unrelated)


@pytest.mark.parametrize(("others", "told"), [(True, True), (False, False)])
def test_a_channel_that_falls_silent_while_others_go_on_is_the_sensors_fault(others: bool, told: bool) -> None:
    measured, asked, body = speeds(41)
    data = followers_of(measured, asked, body)
    first, last = 1200, 1400
    for w, d in data.items():
        if w == "FL" or not others:
            d.y[first:last] = np.nan
            d.fresh[first:last] = False
    if others:  # as `followers` finds it by what is recorded beside it
        data["FL"] = replace(data["FL"], lost=((first, last),))
    parts = assess_response(data, geometry(), None, Limits(), DT).parts
    found = [f for f in parts["FL"][0].findings if f.mode is FaultMode.NO_SIGNAL]
    assert [(f.start, f.stop, f.side) for f in found] == ([(first, last, Side.SENSOR)] if told else [])
    assert all(not parts[w][0].findings for w in ("FR", "RR", "RL"))


def test_a_wheel_that_drives_while_no_command_is_known_and_nothing_else_shows_its_speed_is_not_healthy() -> None:
    measured, asked, body = speeds(8, ("R", "L"))
    silent = slice(round(60 / DT), round(90 / DT))
    body[silent] = np.nan
    measured["L"][silent] = 0.0
    j = assess_response(followers_of(measured, asked, body), geometry(("R", "L")), None, Limits(driving_speed=0.05), DT)
    for w in ("R", "L"):
        sensor = j.parts[w][0]
        moving = np.abs(measured[w][silent]) > 0.1
        assert not np.any((sensor.states[silent] == CODE[State.HEALTHY])[moving])
        assert np.any(sensor.states[: silent.start] == CODE[State.HEALTHY])


def test_a_log_too_short_to_show_how_drives_answer_says_that_and_not_that_the_command_is_missing() -> None:
    measured, asked, body = speeds(3, ("R", "L"))
    part = slice(200, 420)
    j = judged({w: y[part] for w, y in measured.items()}, {w: y[part] for w, y in asked.items()}, body[part])
    for sensor, _ in j.parts.values():
        assert "how it answers its command does not show" in sensor.reasons[State.NOT_ASSESSED]
        assert sensor.lacks[State.NOT_ASSESSED] is Lack.ANSWER
    without = judged(measured, {w: np.full(y.size, np.nan) for w, y in asked.items()}, np.full(body.shape, np.nan))
    for sensor, _ in without.parts.values():
        assert "without its command" in sensor.reasons[State.NOT_ASSESSED]
