"""What drives the machine of `tug.py`: its controller, which trims the speeds that it tells its inverters, and a mission step by step."""

from __future__ import annotations

import math

import numba as nb
import numpy as np
from electric_control import refs_of
from electric_physics import angle_of
from electrohydraulic_physics import hit, places
from tug_physics import (
    A_MOTOR,
    ANGLE,
    ASKED,
    CHARGE,
    HEAT,
    LIMITED,
    READ,
    SET,
    TORQUE,
    TRIM,
    TURN,
    VOLTS,
    Array,
    Build,
    H,
    motor,
    rolls_at,
    sensor,
    source,
    steer,
    tow,
    turn_wheel,
    tyre,
)  # fmt: skip

_BRAKES_S, _RELEASE_S = 1.5, 0.3


@nb.njit(cache=True)
def rounded(x: float, quantum: float) -> float:
    """As a message carries it."""
    return math.floor(x / quantum + 0.5) * quantum


@nb.njit(cache=True)
def wheel_law(w: Array, ref: float, y: float, held: bool, t: float, b: Build) -> None:
    """Speed that an inverter is told [of full]: what is asked, and a trim that creeps to what it lacks, not beyond a cap nor at its limit."""
    if held or ref == 0.0:
        w[TRIM] *= 1.0 - t / 0.5
        w[ASKED] = 0.0
        return
    wrong = (ref - y) / b.top
    if w[LIMITED] == 0.0:
        w[TRIM] = min(max(w[TRIM] + t * (b.integral * wrong - 0.03 * w[TRIM]), -b.cap), b.cap)
    line = b.forward * ref / (b.radius * b.full) + min(abs(ref) / (0.1 * b.top), 1.0) * w[TRIM]
    w[ASKED] = min(max(rounded(line, 0.0005), -1.0), 1.0)


@nb.njit(cache=True)
def steer_law(wrong: float, turning: float, last: float, b: Build) -> float:
    """Speed of a steering motor [of full]: by the angle that lacks, once that is more than a tolerance, until it is a fifth of it."""
    if abs(wrong) < (b.tolerance if last == 0.0 else b.tolerance / 5) and turning == 0.0:
        return 0.0
    return min(max(rounded(b.steer_gain * wrong + 0.95 * turning / b.steer_rate, 0.002), -1.0), 1.0)


@nb.njit(cache=True)
def ground(x: float, y: float, field: Array, b: Build) -> float:
    """How slick the apron is at a place, 0 … 1: ice and wet paint."""
    patch = math.sin(x / 2.1 + field[2]) * math.sin(y / 1.3 + field[3]) + 0.5 * math.sin(x / 6.0 + field[4])
    return b.slick * min(max(2.0 * patch - 1.2, 0.0), 1.0)


@nb.njit(cache=True)
def drive(
    asked_v: Array, asked_angle: Array, load_towed: Array, loss: Array, sat: Array, noise: Array, field: Array, parts: Array, b: Build,
) -> tuple[Array, ...]:  # fmt: skip
    """References, true values, what the controller reads, commands, what inverters follow, body (speed, sideways, yaw rate, speed and
    curvature asked), source (voltage, largest torque, charge, hottest motor, inverters at their limits), per millisecond.

    `load_towed`: mass of an aircraft [of the machine], 0 where none hangs on it.
    """
    n, t = asked_v.size, b.cycle * H
    six = np.zeros((5, n, 6))
    ref, true, read, given, done = six[0], six[1], six[2], six[3], six[4]
    body, supply = np.zeros((n, 5)), np.zeros((n, 5))
    w, x, s, at = np.zeros((4, 15)), np.zeros((2, 3)), np.zeros(4), places(b)
    said, refs, held, us, angles, turning, before = (
        np.zeros(6), np.zeros(4), np.zeros(12), np.zeros(2), np.zeros(2), np.zeros(2), np.zeros(2),
    )  # fmt: skip
    load = np.full(4, b.mass * 9.81 / 4)
    s[CHARGE], s[VOLTS], w[:, HEAT] = b.charge, 0.9 + 0.1 * b.charge, 0.4
    v = side = r = th = px = py = ax = ay = bend = slow_v = resting = waiting = 0.0
    brake, takes = 1.0, 1.0
    for k in range(2 * n):
        m = k // 2
        for i in range(4):
            w[i, READ] = sensor(w[i], parts[i], b)
        if k % b.cycle == 0:
            for i in range(4):
                said[i] = hit(rounded(w[i, READ] + noise[m, i], b.quantum), loss[m, i], sat[m, i], held, i)
            resting = resting + t if asked_v[m] == 0.0 and slow_v == 0.0 else 0.0
            waiting = waiting + t if asked_v[m] != 0.0 and brake > 0.0 else 0.0
            brake = 1.0 if resting > _BRAKES_S or (brake > 0.0 and waiting < _RELEASE_S) else 0.0
            goal = asked_v[m] if brake == 0.0 else 0.0
            step = (b.ramp if load_towed[m] == 0.0 else b.tow_ramp) * t
            slow_v += min(max(goal - slow_v, -1.4 * step), 1.4 * step if goal * slow_v < 0.0 else step)
            for a in range(2):
                good = rounded(x[a, ANGLE] + noise[m, 4 + a], b.angle_quantum)
                said[4 + a] = hit(good, loss[m, 4 + a], sat[m, 4 + a], held, 4 + a)
                step = 0.7 * b.steer_rate * t
                step = min(max(asked_angle[m, a] - angles[a], -step), step)
                angles[a] += step
                turning[a] = step / t
                us[a] = steer_law(angles[a] - said[4 + a], turning[a], us[a], b)
            bend = (math.tan(angles[0]) - math.tan(angles[1])) / b.base
            refs_of(slow_v, bend, turning, angles, b, refs)
            for i in range(4):
                wheel_law(w[i], refs[i], said[i], brake > 0.0 or slow_v == 0.0, t, b)
        for a in range(2):
            before[a] = x[a, ANGLE]
            want = hit(us[a], loss[m, 10 + a], sat[m, 10 + a], held, 10 + a)
            steer(x[a], want, v, load[2 * a] + load[2 * a + 1], s[VOLTS], b)
        fx = fy = moment = power = 0.0
        for i in range(4):
            want = hit(w[i, ASKED], loss[m, 6 + i], sat[m, 6 + i], held, 6 + i)
            torque = motor(w[i], parts[i], min(max(want, -1.1), 1.1), s[VOLTS], takes, b)
            power += (torque * w[i, TURN] / b.torque / (b.knee * b.full) + 0.08 * w[i, TORQUE] ** 2) / 4.0
            a, (lx, ly, off) = i // 2, at[i]
            angle, turn = angle_of(x[a, ANGLE], lx, ly, b), (x[a, ANGLE] - before[a]) / H
            cos, sin = math.cos(angle), math.sin(angle)
            vx, vy = v - r * ly, side + r * lx
            along, across = vx * cos + vy * sin - (r + turn) * off, vy * cos - vx * sin
            slick = ground(
                px + math.cos(th) * lx - math.sin(th) * ly, py + math.sin(th) * lx + math.cos(th) * ly, field, b
            )
            radius = rolls_at(parts[i], load[i], b)
            gx, gy = tyre(w[i], radius, along, across, load[i], b.grip * (1.0 - 0.7 * slick), b)
            turn_wheel(w[i], parts[i], torque, gx, radius, load[i], brake, b)
            bx, by = gx * cos - gy * sin, gx * sin + gy * cos
            fx, fy, moment = fx + bx, fy + by, moment + lx * by - ly * bx - gx * off
        hx = b.hill * math.sin(px / b.hill_length + field[0])
        hy = 0.6 * b.hill * math.sin(py / (0.7 * b.hill_length) + field[1])
        rise = hx * math.cos(th) + hy * math.sin(th)
        pull = tow(s, v, load_towed[m], rise, b)
        takes = source(s, power, b)
        v += H * ((fx + pull) / b.mass - 9.81 * rise + side * r)
        side += H * (fy / b.mass - 9.81 * (hy * math.cos(th) - hx * math.sin(th)) - v * r)
        r += H * moment / (b.mass * (b.base**2 + b.track**2) / 9)
        th += H * r
        px, py = px + H * (v * math.cos(th) - side * math.sin(th)), py + H * (v * math.sin(th) + side * math.cos(th))
        ax, ay = ax + H / 0.2 * (fx / b.mass - ax), ay + H / 0.2 * (fy / b.mass - ay)
        front = 0.5 + b.cg - b.height / b.base * ax / 9.81
        left = 0.5 - b.height / b.track * ay / 9.81
        for i in range(4):
            share = (front if i < 2 else 1.0 - front) * (left if i % 2 else 1.0 - left)
            load[i] = b.mass * 9.81 * min(max(share, 0.03), 0.6)
        if k % 2 == 0:
            ref[m, :4], ref[m, 4:], given[m, :4], given[m, 4:] = refs, angles, w[:, ASKED], us
            true[m, :4], true[m, 4:], read[m] = w[:, TURN] * b.radius, x[:, ANGLE], said
            done[m, :4], done[m, 4:] = w[:, SET], x[:, A_MOTOR]
            body[m] = v, side, r, slow_v, bend
            supply[m] = s[VOLTS], np.abs(w[:, TORQUE]).max(), s[CHARGE], w[:, HEAT].max(), w[:, LIMITED].sum()
    return ref, true, read, given, done, body, supply
