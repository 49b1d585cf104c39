"""L1 and L2 against an independent derivation: the wheel's place in the world, differentiated by SymPy."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest
import sympy as sp
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from replay.control.kinematics import (
    WheelCommands,
    _scan_low_pass,
    commands_by_angles,
    low_pass,
    steering_angle,
    wheel_angles,
    wheel_commands,
)
from replay.machine.config import PhiDot, haulotte
from replay.machine.geometry import Geometry, WheelGeometry, own_axle

Array = np.ndarray
MAX = 1.5


@cache
def rolling_speed(steered: bool) -> Callable[..., Array]:
    """Speed of a wheel's centre along its rolling direction, from its path in the world.

    The body moves with speed v ahead and yaw rate ω; a joint stands at (x, y) in it, turned by φ about the vertical,
    and carries the wheel d to its left.
    """
    t, x, y, d = sp.symbols("t x y d", real=True)
    v, omega, dv, dw = sp.symbols("v omega dv dw", real=True)
    X, Y, theta, V, W = (sp.Function(name)(t) for name in ("X", "Y", "theta", "V", "W"))
    frame = sp.Matrix([[sp.cos(theta), -sp.sin(theta)], [sp.sin(theta), sp.cos(theta)]])
    moves = {X.diff(t): V * sp.cos(theta), Y.diff(t): V * sp.sin(theta), theta.diff(t): W}
    joint = sp.Matrix([X, Y]) + frame * sp.Matrix([x, y])
    joint_velocity = frame.T * joint.diff(t).subs(moves)
    phi = sp.atan(joint_velocity[1] / joint_velocity[0]) if steered else sp.Integer(0)
    turn = sp.Matrix([[sp.cos(phi), -sp.sin(phi)], [sp.sin(phi), sp.cos(phi)]])
    centre = joint + frame * turn * sp.Matrix([0, d])
    rolling = frame * turn * sp.Matrix([1, 0])
    speed = (centre.diff(t).subs(moves).T * rolling)[0]
    speed = speed.subs({V.diff(t): dv, W.diff(t): dw}).subs({V: v, W: omega, theta: sp.Rational(7, 10)})
    return sp.lambdify((v, omega, dv, dw, x, y, d), speed, "numpy")  # type: ignore[no-any-return]


def commands(
    v: Array, omega: Array, geometry: Geometry, dt: float = 0.01, phi_dot: PhiDot = "command", **more: Any
) -> WheelCommands:
    return wheel_commands(v, omega, geometry, dt=dt, max_steer=MAX, phi_dot=phi_dot, **more)


def four() -> Geometry:
    geometry = haulotte().geometry
    assert geometry is not None
    return geometry


@given(st.floats(-0.36, 0.36), st.floats(-0.3, 0.3), st.floats(-0.4, 0.4))
def test_steady_motion_is_exact(v: float, omega: float, offset: float) -> None:
    geometry = Geometry({"W": WheelGeometry(1.05, -0.73, offset, "W")}, 0.854)
    v_x, v_y = v + 0.73 * omega, 1.05 * omega
    assume(abs(v_x) > 2e-3 and abs(np.arctan(v_y / v_x)) < MAX)
    got = commands(np.full(5, v), np.full(5, omega), geometry)
    expected = rolling_speed(True)(v, omega, 0.0, 0.0, 1.05, -0.73, offset)
    assert_allclose(got.speed[:, 0], expected, atol=1e-12)
    assert_allclose(got.angle[:, 0], np.arctan(v_y / v_x), atol=1e-12)


@pytest.mark.parametrize("direction", [1.0, -1.0], ids=["forward", "reverse"])
def test_changing_motion_takes_the_steering_rate_along(direction: float) -> None:
    dt = 1e-4
    t = np.arange(0, 2, dt)
    v, dv = direction * (0.25 + 0.05 * np.sin(t)), direction * 0.05 * np.cos(t)
    omega, dw = 0.08 * np.sin(2 * t), 0.16 * np.cos(2 * t)
    got = commands(v, omega, four(), dt, phi_dot_hz=1e6)  # a cut-off above the rate: no low-pass
    for i, w in enumerate(four().wheels.values()):
        expected = rolling_speed(True)(v, omega, dv, dw, w.x, w.y, w.offset)
        assert_allclose(got.speed[1:, i], expected[1:], atol=2e-5)
        without = commands(v, omega, four(), dt, "zero").speed[:, i]
        # φ̇ is worth some 0.04 m/s and no less than the tolerance above
        assert np.abs(without - expected).max() > 0.02


def test_low_pass_on_the_steering_rate_takes_out_a_step() -> None:
    v, omega = np.full(2000, 0.3), np.where(np.arange(2000) < 1000, 0.0, 0.1)
    sharp = commands(v, omega, four(), 1e-3, phi_dot_hz=1e6).speed[:, 0]
    soft = commands(v, omega, four(), 1e-3).speed[:, 0]
    assert np.ptp(sharp) > 10 * np.ptp(soft)
    assert_allclose(soft[-1], sharp[-1], atol=1e-9)


def test_measured_steering_rate() -> None:
    dt, n = 1e-3, 500
    v, omega = np.full(n, 0.3), np.zeros(n)
    turning = np.outer(np.arange(n) * dt * 0.2, np.ones(4))  # φ̇ = 0.2 rad/s
    got = commands(v, omega, four(), dt, "measured", measured_angle=turning, phi_dot_hz=50.0)
    # v_c,i = |v_k| − φ̇ d_i, d = −0.2 m right, +0.2 m left
    assert_allclose(got.speed[-1], [0.34, 0.26, 0.34, 0.26], atol=1e-9)
    blank = commands(v, omega, four(), dt, "measured")
    assert_allclose(blank.speed, 0.3)


def test_reversing_keeps_the_wheels_where_they_point() -> None:
    v, omega = np.array([0.3, -0.3]), np.array([0.1, -0.1])
    got = commands(v, omega, four(), phi_dot="zero")
    assert_allclose(got.angle[0], got.angle[1], atol=1e-15)
    assert_allclose(got.axle_angle[0], got.axle_angle[1], atol=1e-15)
    assert_allclose(got.speed[0], -got.speed[1], atol=1e-15)
    assert np.all(np.abs(got.angle) < np.pi / 4)


def test_left_turn_by_hand() -> None:
    got = commands(np.array([0.3, 0.3]), np.array([0.1, 0.1]), four())
    # FR: joint at (1.05, −0.73): v_k = (0.3 + 0.073, 0.105); wheel 0.2 m outside
    assert_allclose(got.speed[0, 0], np.hypot(0.373, 0.105) + 0.1 * 0.2, atol=1e-12)
    assert_allclose(got.angle[0], np.arctan2([0.105, 0.105, -0.105, -0.105], [0.373, 0.227, 0.373, 0.227]))
    assert_allclose(got.axle_angle[0], np.arctan2([0.105, -0.105], 0.3))


def test_pure_rotation_drives_right_and_left_against_each_other() -> None:
    machine = haulotte()
    got = wheel_commands(np.zeros(3), np.full(3, 0.2), four(), dt=0.01, max_steer=machine.max_steer)
    # |v_k| = ω·√(1.05² + 0.73²) at every joint, plus ω·0.2 m at the wheels, which stand outside
    assert_allclose(got.speed[0], 0.2 * (np.hypot(1.05, 0.73) + 0.2) * np.array([1, -1, 1, -1]), atol=1e-12)
    assert_allclose(np.abs(got.angle), machine.max_steer)
    assert_allclose(np.sign(got.angle[0]), [1, -1, -1, 1])


def test_steering_is_clipped() -> None:
    angle = steering_angle(np.array([0.1, 0.1, -0.1]), np.array([0.3, -0.3, 0.3]), 0.5)
    assert_array_equal(angle, [0.5, -0.5, -0.5])


def test_standstill_holds_the_last_angle() -> None:
    v_x = np.array([0.0, 0.3, 0.0, 5e-4, np.nan, -0.3])
    v_y = np.array([0.0, 0.1, 0.0, 5e-4, 0.0, 0.0])
    before, driving = 0.0, np.arctan2(0.1, 0.3)
    assert_allclose(steering_angle(v_x, v_y, MAX), [before, driving, driving, driving, driving, 0.0], atol=1e-15)


def test_standstill_commands_no_speed() -> None:
    v = np.r_[np.full(50, 0.3), np.zeros(200)]
    omega = np.r_[np.full(50, 0.1), np.zeros(200)]
    got = commands(v, omega, four())
    assert_allclose(got.speed[-1], 0.0, atol=1e-9)
    assert_allclose(got.angle[-1], got.angle[49])


def test_unknown_command_stays_unknown() -> None:
    v, omega = np.array([0.3, np.nan, 0.3]), np.zeros(3)
    got = commands(v, omega, four(), phi_dot="zero")
    assert_array_equal(np.isnan(got.speed).all(axis=1), [False, True, False])


def test_fixed_wheels_roll_ahead() -> None:
    geometry = Geometry(
        {"L": WheelGeometry(-0.5, 0.4, 0.1, "fixed"), "R": WheelGeometry(-0.5, -0.4, -0.1, "fixed")}, 0.5
    )
    v, omega = np.array([0.3, -0.2, 0.0]), np.array([0.1, 0.2, 0.2])
    got = commands(v, omega, geometry)
    assert got.axle_angle.shape == (3, 0)
    assert_array_equal(got.angle, 0.0)
    for i, w in enumerate(geometry.wheels.values()):
        assert_allclose(got.speed[:, i], rolling_speed(False)(v, omega, 0.0, 0.0, w.x, w.y, w.offset), atol=1e-12)
    assert_allclose(got.speed[2], [-0.1, 0.1])  # the track is 1 m wide at the wheels


@given(st.floats(0.05, 0.36), st.sampled_from([1.0, -1.0]), st.floats(-0.06, 0.06))
def test_axle_angles_give_back_the_wheels_angles(speed: float, sign: float, omega: float) -> None:
    got = commands(np.full(3, sign * speed), np.full(3, omega), four())
    assert_allclose(wheel_angles(got.axle_angle, four()), got.angle, atol=1e-12)


def test_axle_angles_with_one_steered_axle_and_own_wheels() -> None:
    car = Geometry(
        {
            "FL": WheelGeometry(1.5, 0.5, 0.0, "front"),
            "FR": WheelGeometry(1.5, -0.5, 0.0, "front"),
            "RL": WheelGeometry(0.0, 0.5, 0.0, "fixed"),
            "RR": WheelGeometry(0.0, -0.5, 0.0, "fixed"),
        },
        0.6,
    )
    v, omega = np.full(4, 0.3), np.array([0.0, 0.05, -0.05, 0.1])
    got = commands(v, omega, car)
    assert_allclose(wheel_angles(got.axle_angle, car), got.angle, atol=1e-12)
    own = Geometry({w: WheelGeometry(g.x, g.y, 0.1, own_axle(w)) for w, g in car.wheels.items()}, 0.6)
    got = commands(v, omega, own)
    assert own.axles == ("FL_steer", "FR_steer", "RL_steer", "RR_steer")
    assert_allclose(got.axle_angle, got.angle, atol=1e-15)
    assert_allclose(wheel_angles(got.axle_angle, own), got.angle, atol=1e-15)


def test_unknown_axle_angle_stays_unknown() -> None:
    angles = wheel_angles(np.array([[0.1, np.nan], [0.1, -0.1]]), four())
    assert_array_equal(np.isnan(angles), [[True] * 4, [False] * 4])


def test_low_pass_is_the_first_order_lag() -> None:
    t = np.arange(2000) * 1e-3
    got = low_pass(np.where(t > 0, 1.0, 0.0), 1e-3, 5.0)
    assert_allclose(got, 1 - np.exp(-2 * np.pi * 5.0 * t), atol=1e-12)
    assert_array_equal(low_pass(np.array([np.nan, 2.0, np.nan, 2.0]), 1e-3, 5.0), [np.nan, 2.0, 2.0, 2.0])


def test_low_pass_in_blocks_is_the_whole() -> None:
    x = np.random.default_rng(1).normal(size=300)
    whole = low_pass(x, 0.01, 3.0)
    a = 1 - np.exp(-2 * np.pi * 3.0 * 0.01)
    state, parts = np.nan, []
    for block in np.split(x, [1, 50, 211]):
        out, state = _scan_low_pass(block, a, state)
        parts.append(out)
    assert_array_equal(np.concatenate(parts), whole)


@pytest.mark.parametrize("middle", [0.0, 0.6, -0.4])
def test_a_car_turns_about_its_unsteered_axle(middle: float) -> None:
    """Wherever the file's origin lies: the single-track model's steering angle comes back, and a front wheel's own angle."""
    base, track, v, delta = 1.2, 0.7, 1.0, 0.3
    places = {
        name: WheelGeometry(middle + x, y, 0.0, "front" if x else "fixed")
        for name, x, y in (
            ("FR", base, -track / 2),
            ("FL", base, track / 2),
            ("RR", 0.0, -track / 2),
            ("RL", 0.0, track / 2),
        )
    }
    omega = v * np.tan(delta) / base
    found = wheel_commands(np.full(3, v), np.full(3, omega), Geometry(places, 0.3), dt=0.01, max_steer=MAX)
    assert_allclose(found.axle_angle[:, 0], delta)
    assert_allclose(np.tan(found.angle[:, 1]), base / (base / np.tan(delta) - track / 2))
    assert_allclose(found.speed[:, 1], np.hypot(v - omega * track / 2, omega * base))
    assert_allclose(found.speed[:, 3], v - omega * track / 2)


def test_without_a_commanded_yaw_rate_the_angles_say_how_the_wheels_turn() -> None:
    """Held angles ask for the yaw rate that would have been commanded; measured ones stand in where none are."""
    v, omega, geometry = np.full(400, 0.5), np.linspace(-0.3, 0.3, 400), four()
    asked = commands(v, omega, geometry, phi_dot="zero")
    measured = np.zeros_like(asked.axle_angle)
    assert_allclose(commands_by_angles(asked.axle_angle, measured, v, geometry), asked.speed, atol=1e-9)
    unlogged = np.full_like(measured, np.nan)
    assert_allclose(commands_by_angles(unlogged, asked.axle_angle, v, geometry), asked.speed, atol=1e-9)


def test_without_a_commanded_yaw_rate_and_a_steered_axle_only_the_middle_line_is_known() -> None:
    geometry = Geometry({"L": WheelGeometry(0.0, 0.3, 0.0, "fixed"), "D": WheelGeometry(0.0, 0.0, 0.0, "fixed")}, 0.7)
    found = commands_by_angles(np.zeros((3, 0)), np.zeros((3, 0)), np.array([0.1, 0.2, 0.3]), geometry)
    assert np.isnan(found[:, 0]).all()
    assert_allclose(found[:, 1], [0.1, 0.2, 0.3])
