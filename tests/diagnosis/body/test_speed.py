"""Speed of the body by positions, odometry and speed over ground, against paths whose speed is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.body.positions import Positions
from diagnosis.body.rolling import Rolling
from diagnosis.body.sources import BodySensors
from diagnosis.body.speed import BodySpeed, body_speed

Array = np.ndarray
DT, LENGTH, TOP = 0.01, 120.0, 0.36
N = int(LENGTH / DT)
T = (np.arange(N) + 0.5) * DT


def driven() -> tuple[Array, Array]:
    """Speed [m/s] and curvature [1/m] of a machine that drives to and fro, and in curves."""
    raw = 0.3 * np.sign(np.sin(2 * np.pi * T / 37.0)) * (np.sin(2 * np.pi * T / 11.0) > -0.6)
    kernel = np.exp(-np.arange(0, 2.0, DT) / 0.3)
    return np.convolve(raw, kernel / kernel.sum())[:N], 0.25 * np.sin(2 * np.pi * T / 23.0)


def rolling(faulty: int = 0) -> tuple[Rolling, Array]:
    """The wheels, of which some read half the speed from 40 s to 60 s, and the true speed."""
    speed, curvature = driven()
    rng = np.random.default_rng(0)
    wheels = speed[:, None] + 0.002 * rng.standard_normal((N, 4))
    wheels[(T > 40) & (T < 60), :faulty] *= 0.5
    return Rolling(DT, wheels, np.where(faulty > 2, np.nan, speed), curvature, np.zeros(N), TOP), speed


def path(speed: Array, mount: complex = 0.0) -> tuple[Array, Array]:
    """Places at the blocks' ends [m], complex, and heading [rad]."""
    heading = 0.7 + np.cumsum(driven()[1] * speed) * DT
    return np.cumsum(speed * np.exp(1j * heading)) * DT + mount * np.exp(1j * heading), heading


def fixes(speed: Array, every: float = 0.1, noise: float = 0.02, late: float = 0.0, mount: complex = 0.0) -> Positions:
    place, _ = path(speed, mount)
    rng = np.random.default_rng(5)
    t = np.arange(0.5, LENGTH - 0.5, every)
    seen = np.interp(t - late, T + DT / 2, place.real) + 1j * np.interp(t - late, T + DT / 2, place.imag)
    return Positions(t, seen + noise * (rng.standard_normal(t.size) + 1j * rng.standard_normal(t.size)))


def satellite(positions: Positions) -> BodySensors:
    return BodySensors({"satellite positions": positions}, None, None)


def off(found: BodySpeed, speed: Array) -> tuple[Array, Array]:
    """Error [m/s], and the same in standard deviations."""
    error = found.speed - speed
    return error, error / found.std


@pytest.mark.parametrize("faulty", [0, 1, 3])
def test_speed_is_found_within_its_deviation(faulty: int) -> None:
    wheels, speed = rolling(faulty)
    error, share = off(body_speed(satellite(fixes(speed)), wheels), speed)
    assert np.sqrt(np.mean(error**2)) < 0.03
    assert np.mean(np.abs(share) < 2) > 0.9
    if faulty == 3:
        wrong = (T > 42) & (T < 58)
        assert np.sqrt(np.mean(error[wrong] ** 2)) < 0.5 * np.sqrt(np.mean((wheels.speed - speed)[wrong] ** 2))


def test_antenna_beside_the_middle_and_late_fixes_are_recognised() -> None:
    wheels, speed = rolling()
    aside = body_speed(satellite(fixes(speed, noise=0.01, mount=0.5 + 0.6j)), wheels)
    assert np.sqrt(np.mean(off(aside, speed)[0] ** 2)) < 0.02
    late = body_speed(satellite(fixes(speed, noise=0.01, late=0.4)), wheels)
    assert "0.4 s late" in late.notes[0]
    assert np.sqrt(np.mean(off(late, speed)[0] ** 2)) < 0.02


def test_jump_and_outage_make_it_uncertain_not_wrong() -> None:
    wheels, speed = rolling()
    good = fixes(speed)
    place = good.place + np.where(good.t > 50, 30.0 - 12.0j, 0.0)
    kept = (good.t < 80) | (good.t > 95)
    found = body_speed(satellite(Positions(good.t[kept], place[kept])), wheels)
    error, share = off(found, speed)
    assert np.sqrt(np.mean(error**2)) < 0.03
    assert np.abs(share).max() < 5
    quiet = (T > 84) & (T < 91)
    assert np.median(found.std[quiet]) > 1.2 * np.median(found.std[(T > 20) & (T < 45)])


def test_body_that_stands_while_the_wheels_turn_is_left_out() -> None:
    wheels, speed = rolling()
    found = body_speed(satellite(fixes(0 * speed)), wheels)
    assert not found.known
    assert "left out" in found.notes[0]
    assert "times as far as the wheels roll" in found.notes[0]


def test_receiver_that_repeats_itself_says_nothing() -> None:
    wheels, _ = rolling()
    still = Positions(np.arange(0, 100, 0.1), np.full(1000, 3.0 + 4.0j))
    found = body_speed(satellite(still), wheels)
    assert not found.known
    assert "too few" in found.notes[0]


def test_odometry_of_the_wheels_is_left_out_and_other_odometry_is_not() -> None:
    wheels, speed = rolling(1)
    own, _ = path(np.asarray(wheels.by_wheel.mean(axis=1)))
    t = np.arange(0.5, LENGTH - 0.5, 0.05)
    place = np.interp(t, T + DT / 2, own.real) + 1j * np.interp(t, T + DT / 2, own.imag)
    found = body_speed(BodySensors({"odometry": Positions(t, place)}, None, None), wheels)
    assert not found.known
    assert "computed from the wheels' own speeds" in found.notes[0]
    other = body_speed(BodySensors({"odometry": fixes(speed, noise=0.005)}, None, None), wheels)
    assert other.known


def test_speed_over_ground_takes_its_sign_from_the_wheels() -> None:
    wheels, speed = rolling(3)
    t = np.arange(0.5, LENGTH - 0.5, 0.1)
    over_ground = np.abs(np.interp(t, T, speed)) + 0.02 * np.random.default_rng(2).standard_normal(t.size)
    found = body_speed(BodySensors({}, (t, over_ground), None), wheels)
    error, _ = off(found, speed)
    assert np.sqrt(np.mean(error**2)) < 0.03


def test_yaw_rate_of_another_body_is_left_out_and_a_wrong_angle_is_noticed() -> None:
    wheels, speed = rolling()
    rate = driven()[1] * speed
    other = body_speed(replace(satellite(fixes(speed)), yaw_rate=-rate), wheels)
    assert any("yaw rate left out" in note for note in other.notes)
    noisy = rate + 0.002 * np.random.default_rng(3).standard_normal(N)
    bent = np.where((T > 70) & (T < 80), 0.3, 0.0)
    found = body_speed(replace(satellite(fixes(speed)), yaw_rate=noisy), replace(wheels, curvature=driven()[1] + bent))
    moving = np.abs(speed) > 0.1
    assert np.median(found.yaw_doubt[(T > 71) & (T < 79) & moving]) > 0.02
    assert np.median(found.yaw_doubt[(T > 20) & (T < 60)]) == 0.0
