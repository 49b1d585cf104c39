"""The gyro that alone contradicts the wheels is told; one that agrees, and a wheel that is wrong, are not its fault."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.response.assess import Judgement, assess_response
from replay.machine.config import Limits
from tests.diagnosis.response.robot import DT, TRACK, Array, followers_of, geometry, robot_of, speeds

FAULTY = slice(1000, 1600)


def yaw_of(measured: dict[str, Array], seed: int) -> Array:
    right, left = (np.mean([y for w, y in measured.items() if w.endswith(s)], axis=0) for s in "RL")
    return np.asarray((right - left) / (1.4 * TRACK) + np.random.default_rng(seed).normal(0.0, 0.01, right.size))


def judged(yaw: Array | None, seed: int = 3, wheel: str = "") -> Judgement:
    measured, asked, body = speeds(seed)
    if wheel:
        measured[wheel][FAULTY] *= 0.5
    return assess_response(followers_of(measured, asked, body), geometry(), yaw, Limits(), DT)


@pytest.mark.parametrize(
    ("gain", "constant", "said"),
    [
        (0.0, 0.0, "gives next to nothing"),
        (2.0, 0.0, "× what the"),
        (1.0, 0.5, "°/s more than"),
        (0.0, 0.9, "stays at 52"),
    ],
)
def test_a_wrong_gyro_is_told_with_its_time_and_no_wheel_is_named(gain: float, constant: float, said: str) -> None:
    measured, _, _ = speeds(3)
    yaw = yaw_of(measured, 1)
    yaw[FAULTY] = gain * yaw[FAULTY] + constant
    found = judged(yaw)
    assert any(said in x.text for x in found.gyro), found.gyro
    ((start, stop),) = found.gyro[0].spans
    assert start == pytest.approx(FAULTY.start * DT, abs=6.0)
    assert stop == pytest.approx(FAULTY.stop * DT, abs=6.0)
    assert not any(a.findings for sides in found.parts.values() for a in sides)


def test_a_gyro_that_has_nothing_of_the_turns_is_told() -> None:
    n = speeds(3)[0]["FR"].size
    found = judged(np.random.default_rng(2).normal(0.0, 0.01, n))
    assert "another axis" in found.gyro[0].text
    assert "another axis" in judged(np.zeros(n)).gyro[0].text


def test_a_small_constant_is_told_where_rests_of_the_machine_show_that_it_comes_and_goes() -> None:
    measured, asked, body = speeds(3)
    for x in (*measured.values(), *asked.values(), body):
        x[1300:1400] = 0.0
        x[2000:2100] = 0.0
    yaw = yaw_of(measured, 1)
    usual = float(np.quantile(np.abs(yaw), 0.9))
    assert assess_response(followers_of(measured, asked, body), geometry(), yaw, Limits(), DT).gyro == ()
    yaw[FAULTY] += 0.1 * usual
    (said,) = assess_response(followers_of(measured, asked, body), geometry(), yaw, Limits(), DT).gyro
    assert "°/s more than the" in said.text
    assert said.text.endswith("where they rest as well.")


def test_a_sound_gyro_is_not_told_whatever_a_wheel_does() -> None:
    measured, _, _ = speeds(3)
    assert judged(yaw_of(measured, 1)).gyro == ()
    assert judged(yaw_of(measured, 1), wheel="FL").gyro == ()
    assert judged(None).gyro == ()


def test_a_gyro_of_the_other_sign_is_told_and_one_of_a_skid_steered_machine_is_not() -> None:
    measured, _, _ = speeds(3)
    found = judged(-yaw_of(measured, 1))
    assert "turns against the" in found.gyro[0].text
    assert "−0.71 ×" in found.gyro[0].text
    assert not any(a.findings for sides in found.parts.values() for a in sides)
    assert judged(yaw_of(measured, 1)).gyro == ()


def test_a_gyro_that_is_frozen_in_the_longest_turn_of_a_mission_of_few_is_told() -> None:
    rng, n = np.random.default_rng(5), 1800
    turn = np.zeros(n)
    for start, stop, rate in ((300, 360, -0.4), (360, 500, 0.5), (500, 560, 0.5), (900, 960, -0.8), (1300, 1440, 0.6)):
        turn[start:stop] = rate
    measured, asked, body = robot_of(np.full(n, 0.6), turn, 5)
    yaw = yaw_of(measured, 1)
    yaw[300:500] = 0.003 + rng.normal(0.0, 1e-4, 200)
    found = assess_response(followers_of(measured, asked, body), geometry(), yaw, Limits(), DT).gyro
    assert any("gives next to nothing" in x.text or "stays at" in x.text for x in found), found
    assert found[0].spans[0][0] == pytest.approx(300 * DT, abs=2.0)
