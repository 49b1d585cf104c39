"""Motors, wheels, ground and body: forces by slip, a speed loop around the encoder of each wheel."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from .faults import Fault
from .machines import STEERED, Course, H, Robot

Array = NDArray[np.float64]


class Driven(NamedTuple):
    """What happened, by steps of the physics.

    Attributes
    ----------
    wheel, seen : Array, shape (n, wheels)
        True speed, and that of the encoder [rad/s].
    torque : Array, shape (n, wheels)
        Of each motor at its wheel, as its current tells it [N·m].
    duty : Array, shape (n, wheels)
        What its controller asks of it [1], be it done or not.
    body : Array, shape (n, 3)
        Forward, lateral [m/s] and yaw rate [rad/s].
    steer : Array, shape (n,)
        Steering angle [rad].
    """

    wheel: Array
    seen: Array
    torque: Array
    duty: Array
    body: Array
    steer: Array


def drive(robot: Robot, course: Course, fault: Fault | None, rng: np.random.Generator) -> Driven:
    """Run a mission."""
    x, y, roller = (np.array([getattr(w, k) for w in robot.wheels]) for k in ("x", "y", "roller"))
    n, m = course.v.size, x.size
    late = round(robot.dead_time / H)
    v, lateral, omega = (np.r_[np.zeros(late), c[: n - late]] for c in (course.v, course.lateral, course.omega))
    live = ~(np.r_[np.zeros(late, np.bool_), course.silent[: n - late]])
    v, lateral, omega = v * live, lateral * live, omega * live
    if fault is not None and fault.kind == "ignored":
        held = slice(fault.first, fault.last)
        v[held], lateral[held], omega[held] = v[fault.first], lateral[fault.first], omega[fault.first]
    by_steering = robot.kind in STEERED
    steer = _steering(v, omega, robot.wheelbase) if by_steering else np.zeros(n)
    heading = np.where([w.steered for w in robot.wheels], np.cos(steer)[:, None], 1.0)
    if robot.kind == "mecanum":
        target = v[:, None] - omega[:, None] * (y + np.sign(y) * np.abs(x)) - roller * lateral[:, None]
    else:
        turn = v * np.tan(steer) / robot.wheelbase if by_steering else omega
        target = (v[:, None] - turn[:, None] * y) / heading
    effect, scale = np.zeros((n, m), np.int64), np.ones((n, m))
    stop = course.stop.copy()
    if fault is not None:
        if fault.kind == "estop":
            stop[fault.first : fault.last] = True
        codes = {
            "motor_dead": 1, "motor_gone": 1, "motor_weak": 2, "motor_on": 3, "jammed": 4, "torque_lost": 6, "brake_drags": 7,
            "motor_faint": 2, "torque_gone": 6, "brake_on": 7,
        }  # fmt: skip
        if fault.kind in codes:
            effect[fault.first : fault.last, fault.wheel] = codes[fault.kind]
            scale[fault.first : fault.last, fault.wheel] = fault.size
        if fault.kind in ("encoder_dead", "encoder_scaled", "encoder_off") and fault.counted:
            scale[fault.first : fault.last, fault.wheel] = 0.0 if fault.kind == "encoder_dead" else fault.size
            effect[fault.first : fault.last, fault.wheel] = 5
    bias = 1.0 + rng.normal(0.0, 0.01, m)
    grip = float(rng.uniform(0.5, 0.9))
    numbers = np.array(
        [robot.radius, robot.mass, robot.rail, robot.lag, robot.accel, robot.deadband, 1.7 * robot.top, grip,
         robot.wheelbase if by_steering else 0.0, float(robot.closed)]
    )  # fmt: skip
    out = _scan(
        target,
        steer,
        heading,
        effect,
        scale,
        stop,
        course.slope,
        course.load,
        course.kerbs,
        x,
        y,
        roller,
        bias,
        numbers,
    )
    return Driven(*out, steer)


def _steering(v: Array, omega: Array, base: float) -> Array:
    """Angle of a steering servo with a rate limit [rad]."""
    asked = np.clip(np.arctan(base * omega / np.where(np.abs(v) < 0.1, np.inf, v)), -0.5, 0.5)
    from diagnosis.response.kernel import follow

    return np.asarray(follow(asked, 0.0, 1 - np.exp(-H / 0.08), 2.5 * H))


@njit(cache=True)
def _scan(target: Any, steer: Any, heading: Any, effect: Any, scale: Any, stop: Any, slope: Any, load: Any, kerbs: Any, xs: Any, ys: Any,
          roller: Any, bias: Any, numbers: Any) -> Any:  # fmt: skip
    """One mission; one function, for its state is one."""
    radius, mass, rail, lag, accel, deadband, free, grip, base, closed = numbers
    n, m = target.shape
    wheel, seen, pull, body = np.zeros((n, m)), np.zeros((n, m)), np.zeros((n, m)), np.zeros((n, 3))
    duty = np.zeros((n, m))
    ref, total, u, speed, asked = np.zeros(m), np.zeros(m), np.zeros(m), np.zeros(m), np.zeros(m)
    vx = vy = wz = 0.0
    own = 0.15 * mass / m  # a wheel's and motor's own mass at the rim [kg]
    gain = (own + mass / m) / lag / rail
    inertia = mass * (np.max(np.abs(ys)) ** 2 + 0.1)
    weight = mass * 9.81 / m
    for k in range(n):
        heavy = mass * load[k]
        push_x = push_y = moment = 0.0
        for i in range(m):
            code = effect[k, i]
            shown = speed[i] * (scale[k, i] if code == 5 else 1.0)
            if k % 10 == 0:
                goal = target[k, i] if not stop[k] else 0.0
                ref[i] += min(max(goal - ref[i], -accel * 0.01), accel * 0.01)
                if closed > 0.5:
                    off = ref[i] - shown
                    total[i] = min(max(total[i] + off * gain * 0.01 / (2.0 * lag), -1.0), 1.0)
                    if goal == 0.0 and abs(shown) < 0.02:
                        total[i] *= 0.9
                    value = ref[i] / free + gain * off + total[i]
                else:
                    value = 1.25 * ref[i] / free
                value = min(max(value, -1.0), 1.0)
                asked[i] = 0.0 if stop[k] else value
                if code == 1:
                    value = 0.0
                elif code == 2:
                    value = value * scale[k, i]
                elif code == 3:
                    value = scale[k, i]
                u[i] = 0.0 if stop[k] else value
            live = u[i]
            live = 0.0 if abs(live) < deadband else live
            torque = bias[i] * rail * (live - speed[i] / free)
            if code == 1:
                torque = 0.0  # without power
            pull[k, i], duty[k, i] = torque * radius, asked[i]
            if code == 6:
                torque *= scale[k, i]  # the current is there, and makes less of a torque
            torque -= rail * (0.03 + (scale[k, i] if code == 7 else 0.0)) * np.tanh(speed[i] / 0.02)
            along = (vx - ys[i] * wz) / heading[k, i]
            across = vy + xs[i] * wz
            slip = speed[i] - (along - roller[i] * across) if roller[i] != 0.0 else speed[i] - along
            force = grip * weight * load[k] * np.tanh(slip / 0.06)
            push_x += force * heading[k, i] - kerbs[k, i] * np.tanh(along / 0.05)
            moment += -ys[i] * (force - kerbs[k, i] * np.tanh(along / 0.05))
            side = -roller[i] * force if roller[i] != 0.0 else -0.6 * grip * weight * load[k] * np.tanh(across / 0.1)
            push_y += side
            moment += xs[i] * side
            if code == 4:
                speed[i] *= 1.0 - 1e-3 / scale[k, i]
                speed[i] = 0.0 if abs(speed[i]) < 1e-3 else speed[i]
            elif stop[k]:
                speed[i] *= 0.97  # brakes
            else:
                speed[i] += 1e-3 * (torque - force) / own
            wheel[k, i] = speed[i] / radius
            seen[k, i] = speed[i] * (scale[k, i] if code == 5 else 1.0) / radius
        vx += 1e-3 * (push_x / heavy - 9.81 * np.sin(slope[k]) - 0.02 * 9.81 * np.tanh(vx / 0.05))
        if base > 0.0:
            vy = 0.0
            wz = vx * np.tan(steer[k]) / base
        else:
            wz += 1e-3 * (moment / inertia - 0.2 * wz)
            vy += 1e-3 * push_y / heavy
        body[k, 0], body[k, 1], body[k, 2] = vx, vy, wz
    return wheel, seen, pull, duty, body
