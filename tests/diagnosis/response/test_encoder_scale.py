"""An encoder that is scaled inside its own loop: reading and command agree, and the yaw rate says that its side goes otherwise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.response.assess import Judgement, assess_response
from diagnosis.response.encoder_scale import Sought
from diagnosis.response.encoder_scale_words import unseen
from diagnosis.results.assessment import CODE
from replay.faults import State
from replay.machine.config import Limits
from tests.diagnosis.response.robot import DT, TRACK, Array, followers_of, geometry, speeds

PAIR = ("R", "L")
N = speeds(3, PAIR)[0]["R"].size
LATER, WHOLE = slice(1200, N), slice(0, N)


def judged(
    factor: float, where: slice, *, wheel: str = "L", wheels: tuple[str, ...] = PAIR, gyro: tuple[float, float] | None = (1.0, 0.0), seed: int = 3
) -> Judgement:  # fmt: skip
    """Wheels read what they are told; the true speed of one is `factor` × its reading; `gyro`: what its yaw rate is of the true one."""
    measured, asked, body = speeds(seed, wheels)
    true = {w: y.copy() for w, y in measured.items()}
    true[wheel][where] *= factor
    right, left = (np.mean([y for w, y in true.items() if w.endswith(side)], axis=0) for side in "RL")
    noise = np.random.default_rng(seed).normal(0.0, 0.01, right.size)
    yaw: Array | None = None if gyro is None else (right - left) / TRACK + noise
    if yaw is not None and gyro is not None:
        yaw[where] = gyro[0] * yaw[where] + gyro[1]
    return assess_response(followers_of(measured, asked, body), geometry(wheels), yaw, Limits(), DT)


@pytest.mark.parametrize("factor", [0.75, 1.4])
@pytest.mark.parametrize("wheel", PAIR)
def test_from_some_moment_on_side_factor_and_time_are_told(factor: float, wheel: str) -> None:
    found = judged(factor, LATER, wheel=wheel)
    assert len(found.scaled) == 1
    text = found.scaled[0].text
    assert f"as if {wheel} went " in text
    assert float(text.split(" went ")[1].split()[0]) == pytest.approx(factor, abs=0.05)
    assert float(text.split()[1]) == pytest.approx(LATER.start * DT, abs=4.0)
    assert "to the end of the log" in text
    assert found.gyro == ()
    sensor = found.parts[wheel][0]
    assert np.mean(sensor.states[LATER.start + 100 :] == CODE[State.HEALTHY]) < 0.1
    assert np.mean(sensor.states[: LATER.start - 100] == CODE[State.HEALTHY]) > 0.5


@pytest.mark.parametrize("factor", [0.75, 1.4])
def test_all_through_a_log_both_sides_are_named(factor: float) -> None:
    found = judged(factor, WHOLE)
    text = found.scaled[0].text
    first, other = (
        float(text.split(before)[1].split()[0]) for before in (" went ", ", or R " if " if L " in text else ", or L ")
    )
    assert sorted([first, other]) == pytest.approx(sorted([factor, 1.0 / factor]), abs=0.05)
    for wheel in PAIR:
        assert np.mean(found.parts[wheel][0].states == CODE[State.HEALTHY]) < 0.1


@pytest.mark.parametrize("gyro", [(1.0, 0.0), (1.6, 0.0), (0.4, 0.0), (1.0, 0.4), (0.0, 0.0)])
@pytest.mark.parametrize("seed", [3, 4])
def test_sound_encoders_are_not_told_whatever_the_gyro_does(gyro: tuple[float, float], seed: int) -> None:
    assert judged(1.0, LATER, gyro=gyro, seed=seed).scaled == ()


def test_what_would_have_shown_is_stated_and_it_does() -> None:
    sound = judged(1.0, WHOLE)
    hidden = {sensor.hidden for sensor, _ in sound.parts.values()}
    assert len(hidden) == 1
    text = hidden.pop()
    least = float(text.split(" from ")[1].split()[0])
    assert 1.1 < least < 1.6
    assert judged(least, LATER).scaled
    assert judged(1.0 / least, LATER).scaled


def test_without_a_gyro_it_is_said_that_none_would_show_and_what_to_log() -> None:
    found = judged(1.4, LATER, gyro=None)
    assert found.scaled == ()
    for sensor, drive in found.parts.values():
        assert "would not show in this log" in sensor.hidden
        assert "imu.yaw_rate" in sensor.hidden
        assert not drive.hidden


def test_of_several_wheels_a_side_one_must_be_off_by_more() -> None:
    four = ("FR", "FL", "RR", "RL")
    one, several = (float(next(iter(judged(1.0, WHOLE, wheels=w, wheel=w[1]).parts.values()))[0].hidden.split(" from ")[1].split()[0]) for w in (PAIR, four))  # fmt: skip
    assert several > one
    assert "the mean of FL and RL" in judged(1.8, LATER, wheel="FL", wheels=four).scaled[0].text


def test_a_car_is_held_against_the_yaw_rate_by_the_axle_that_it_does_not_steer() -> None:
    measured, asked, body = speeds(3)
    true = {w: y * (0.75 if w == "RL" else 1.0) for w, y in measured.items()}
    noise = np.random.default_rng(3).normal(0.0, 0.01, body.shape[0])
    car = geometry()
    steered = {w: replace(p, axle="front") if w.startswith("F") else p for w, p in car.wheels.items()}
    data, place = followers_of(measured, asked, body), replace(car, wheels=steered)
    for speed, told in ((true, True), (measured, False)):
        found = assess_response(data, place, (speed["RR"] - speed["RL"]) / TRACK + noise, Limits(), DT)
        assert bool(found.scaled) is told
        assert found.gyro == ()
        assert np.mean(found.parts["FL"][0].states == CODE[State.HEALTHY]) > 0.5
        assert bool(np.mean(found.parts["RL"][0].states == CODE[State.HEALTHY]) < 0.1) is told


def test_what_to_do_is_nothing_that_the_log_has_already_and_says_of_which_wheels_it_speaks() -> None:
    unsteered = unseen(Sought(smallest=1.2), " of an unsteered {wheel}", several=False)
    steered, without = (
        unseen(Sought(), " of a steered {wheel}", several=False, ground=ground) for ground in (True, False)
    )
    assert "an encoder of an unsteered {wheel}" in unsteered
    assert "an encoder of a steered {wheel}" in steered
    assert "gnss" not in steered
    assert steered.endswith("let each {wheel} make ten turns by its encoder, and count them.")
    assert "log a speed over ground (gnss.speed)" in without
