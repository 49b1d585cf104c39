"""A yaw rate that is wrong, beside wheels that are right, and a wheel that is wrong beside a yaw rate that is right."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.response.assess import assess_response
from diagnosis.response.kernel import follow
from diagnosis.results.assessment import CODE, Finding
from replay.faults import FaultMode, Side, State
from replay.machine.config import Limits
from tests.campaigns import campaign
from tests.diagnosis.response.robot import DT, TRACK, WHEELS, commands, followers_of, geometry, speeds

Array = NDArray[np.float64]
PAIR = ("R", "L")
SPELL = slice(round(60.0 / DT), round(90.0 / DT))


def told(measured: dict[str, Array], yaw: Array, seed: int) -> list[tuple[str, Finding]]:
    """Findings of both sides by wheel."""
    _, asked, body = speeds(seed, PAIR)
    data = followers_of(measured, asked, body)
    parts = assess_response(data, geometry(PAIR), yaw, Limits(), DT).parts
    return [(w, f) for w, sides in parts.items() for side in sides for f in side.findings]


def yaw_of(measured: dict[str, Array], seed: int) -> Array:
    """What a sound gyro reads [rad/s]."""
    rng = np.random.default_rng(seed + 7)
    return (measured["R"] - measured["L"]) / TRACK + rng.normal(0.0, 0.01, measured["R"].size)


@pytest.mark.parametrize("fault", ["dead", "frozen", "half", "shifted"])
@pytest.mark.parametrize("seed", campaign([3, 8]))
def test_no_wheel_is_blamed_for_a_wrong_yaw_rate(fault: str, seed: int) -> None:
    measured, _, _ = speeds(seed, PAIR)
    yaw = yaw_of(measured, seed)
    turning = SPELL.start + int(np.argmax(np.abs(yaw[SPELL])))
    yaw[SPELL] = {
        "dead": 0.0 * yaw[SPELL],
        "frozen": np.full(yaw[SPELL].size, yaw[turning]),
        "half": 0.5 * yaw[SPELL],
        "shifted": yaw[SPELL] + 0.4,
    }[fault]
    assert told(measured, yaw, seed) == []


@pytest.mark.parametrize("wheel", PAIR)
def test_a_wheel_that_reads_half_of_its_speed_is_told_beside_the_yaw_rate(wheel: str) -> None:
    measured, _, _ = speeds(3, PAIR)
    yaw = yaw_of(measured, 3)
    measured[wheel] = measured[wheel].copy()
    measured[wheel][SPELL] *= 0.5
    assert {w for w, _ in told(measured, yaw, 3)} == {wheel}


@pytest.mark.parametrize("shift", campaign([0.3, -0.3]))
@pytest.mark.parametrize("seed", campaign([3, 11]))
def test_a_shifted_wheel_that_its_command_contradicts_too_is_not_the_gyros_fault(shift: float, seed: int) -> None:
    measured, asked, body = speeds(seed, PAIR)
    yaw = yaw_of(measured, seed)
    measured["L"] = measured["L"].copy()
    measured["L"][SPELL] += shift
    found = assess_response(followers_of(measured, asked, body), geometry(PAIR), yaw, Limits(), DT)
    assert found.gyro == ()
    assert {w for w, sides in found.parts.items() for side in sides for _ in side.findings} == {"L"}


def told_without_turns(measured: dict[str, Array], seed: int, wheels: tuple[str, ...]) -> list[tuple[str, Finding]]:
    """Findings of a log that has the commanded speed alone, neither a commanded nor a measured yaw rate."""
    _, _, body = speeds(seed, wheels)
    data = {
        w: replace(d, commands=d.commands[:, :1], asked=body[:, 0])
        for w, d in followers_of(measured, dict.fromkeys(wheels, body[:, 0]), body).items()
    }
    parts = assess_response(data, geometry(wheels), None, Limits(), DT).parts
    return [(w, f) for w, sides in parts.items() for side in sides for f in side.findings]


def straight(seed: int, wheels: tuple[str, ...]) -> dict[str, Array]:
    """A robot that goes straight on but for one curve."""
    rng = np.random.default_rng(seed)
    v = follow(np.r_[np.zeros(6), commands(seed)[0][:-6]], 0.0, 0.15, 0.08)
    curve = np.zeros(v.size)
    curve[SPELL] = 0.2 * np.sin(np.linspace(0.0, np.pi, SPELL.stop - SPELL.start)) * np.sign(v[SPELL])
    return {w: v + curve * (1.0 if w.endswith("R") else -1.0) + rng.normal(0.0, 0.01, v.size) for w in wheels}


@pytest.mark.parametrize("wheels", [PAIR, WHEELS])
@pytest.mark.parametrize("seed", campaign([3, 8, 11, 12]))
def test_a_curve_that_nothing_in_the_log_tells_is_no_wheels_fault(seed: int, wheels: tuple[str, ...]) -> None:
    assert told_without_turns(straight(seed, wheels), seed, wheels) == []


@pytest.mark.parametrize("seed", campaign([3, 8]))
def test_a_wheel_that_is_dead_is_told_where_turns_are_not(seed: int) -> None:
    measured = straight(seed, PAIR)
    measured["R"][SPELL] = 0.0
    assert {(w, f.mode) for w, f in told_without_turns(measured, seed, PAIR)} == {("R", FaultMode.NO_SIGNAL)}


def healthy_anywhere(measured: dict[str, Array], yaw: Array, seed: int) -> list[bool]:
    """Whether anything healthy is said of each sensor."""
    _, asked, body = speeds(seed, PAIR)
    parts = assess_response(followers_of(measured, asked, body), geometry(PAIR), yaw, Limits(), DT).parts.values()
    return [bool((sensor.states == CODE[State.HEALTHY]).any()) for sensor, _ in parts]


@pytest.mark.parametrize("seed", campaign([3, 8]))
def test_nothing_healthy_is_said_of_sides_that_are_exchanged(seed: int) -> None:
    measured, _, _ = speeds(seed, PAIR)
    yaw = yaw_of(measured, seed)
    left, right = PAIR
    assert healthy_anywhere({left: measured[right], right: measured[left]}, yaw, seed) == [False, False]


@pytest.mark.parametrize("seed", campaign([3, 8]))
def test_a_gyro_with_the_other_sign_says_nothing_against_wheels_that_do_as_they_are_told(seed: int) -> None:
    measured, _, _ = speeds(seed, PAIR)
    assert healthy_anywhere(measured, -yaw_of(measured, seed), seed) == [True, True]


@pytest.mark.parametrize("seed", campaign([3, 8]))
def test_no_drive_is_named_by_a_yaw_rate_against_which_the_sides_turn(seed: int) -> None:
    measured, _, _ = speeds(seed, PAIR)
    yaw = -yaw_of(measured, seed)
    part = slice(SPELL.start, SPELL.start + round(8.0 / DT))
    measured["L"] = measured["L"].copy()
    measured["L"][part] *= 0.7
    assert [w for w, f in told(measured, yaw, seed) if f.side is Side.ACTUATOR] == []
