"""What drives the machine of `paver.py`: speeds in tenths of m/min, a law without feedback or with little of it, and a mission."""

from __future__ import annotations

import math

import numba as nb
import numpy as np
from electric_control import refs_of
from electric_physics import angle_of
from electrohydraulic_physics import hit, places
from paver_physics import (
    A_SPOOL,
    ANGLE,
    ASKED,
    FILTERED,
    OIL,
    PORT_A,
    PORT_B,
    SENT,
    SHUT,
    SPOOL,
    TRIM,
    TURN,
    Array,
    Build,
    H,
    P,
    motor,
    sense,
    steer,
    supply_of,
    turn_wheel,
    tyre,
    valve,
)  # fmt: skip

_CYCLE = 40  # steps of the controller's cycle, 20 ms
_T = _CYCLE * H
_TENTH = 0.1 / 60.0  # of m/min [m/s]


@nb.njit(cache=True)
def wheel_law(w: Array, part: Array, ref: float, y: float, oil: float, b: Build) -> None:
    """Command of a wheel's valve: a table that its trim and some of what the oil does correct, a proportional part, a slew over all of it."""
    u = 0.0
    if abs(ref) >= 0.012 * b.top:
        line = b.forward * part[TRIM] * ref / b.radius * b.motor / b.flow
        line /= 1.0 + b.knows * b.drift * (oil - 45.0) / 50.0
        line += b.closed * (ref - y) / b.top
        line = math.copysign(max(math.copysign(line, line * ref), 0.0), ref)  # never against what is asked
        jump = b.known * b.dead * min(abs(line) / 0.004, 1.0)
        u = math.copysign(jump + (1.0 - jump) * abs(line), line)
    jump = b.known * b.dead
    step = b.slew * _T * (6.0 if abs(w[ASKED]) < jump else 1.0)
    w[ASKED] = min(max(u, w[ASKED] - step, -1.0), w[ASKED] + step, 1.0)


@nb.njit(cache=True)
def steer_law(wrong: float, turning: float, last: float, b: Build) -> float:
    """Command of a steering valve: on or off with a hysteresis, or in proportion beyond its overlap."""
    if b.bang:
        band = b.tolerance + 0.04 * b.steer_rate  # what it runs on by
        if abs(wrong) < (1.5 * band if last == 0.0 else 0.5 * band):
            return 0.0
        return math.copysign(1.0, wrong)
    if abs(wrong) < (b.tolerance if last == 0.0 else b.tolerance / 3) and turning == 0.0:
        return 0.0
    line = b.steer_gain * wrong + 0.9 * turning / b.steer_rate
    jump = max(b.known, 0.93) * b.steer_dead * min(abs(line) / 0.008, 1.0)
    return min(max(math.floor((line + math.copysign(jump, line)) * 250 + 0.5) / 250, -1.0), 1.0)


@nb.njit(cache=True)
def drive(
    asked_v: Array, asked_angle: Array, work: Array, loss: Array, sat: Array, noise: Array, field: Array, parts: Array, b: Build,
) -> tuple[Array, ...]:  # fmt: skip
    """References, true values, what the controller reads, commands, spools, body (speed, sideways, yaw rate, speed and curvature
    asked), source (pressure, oil, ports of a motor, how far its counterbalance valve is shut), speed of the ground under the
    wheels [m/s], per millisecond. `work`: drag of the screed [of the weight], where it pulls [m to the left], hopper [of the mass].
    """
    n = asked_v.size
    six = np.zeros((5, n, 6))
    ref, true, read, given, done = six[0], six[1], six[2], six[3], six[4]
    body, source, under = np.zeros((n, 5)), np.zeros((n, 5)), np.zeros((n, 4))
    w, x, at, passes = np.zeros((4, 12)), np.zeros((2, 4)), places(b), np.zeros(4)
    said, refs, held, us, angles, turning, before = (
        np.zeros(6), np.zeros(4), np.zeros(12), np.zeros(2), np.zeros(2), np.zeros(2), np.zeros(2),
    )  # fmt: skip
    w[:, SHUT] = 1.0
    load, s = np.full(4, b.mass * 9.81 / 4), np.zeros(2)
    s[P], s[OIL] = b.pressure, b.cold
    v = side = r = th = px = py = ax = ay = bend = slow_v = 0.0
    for k in range(2 * n):
        m = k // 2
        for i in range(4):
            sense(w[i], parts[i], b)
            if (k + 11 * i) % b.renewed == 0:
                w[i, SENT] = math.floor((w[i, FILTERED] + noise[m, i]) / _TENTH + 0.5) * _TENTH
        if k % 10 == 0:
            for i in range(4):
                said[i] = hit(w[i, SENT], loss[m, i], sat[m, i], held, i)
            for a in range(2):
                good = math.floor((x[a, ANGLE] + noise[m, 4 + a]) / 0.001 + 0.5) * 0.001
                said[4 + a] = hit(good, loss[m, 4 + a], sat[m, 4 + a], held, 4 + a)
        if k % _CYCLE == 0:
            step = b.ramp * _T * (1.0 if abs(asked_v[m]) > abs(slow_v) else 2.0)
            slow_v += min(max(asked_v[m] - slow_v, -step), step)
            for a in range(2):
                step = 0.6 * b.steer_rate * _T
                step = min(max(asked_angle[m, a] - angles[a], -step), step)
                angles[a] += step
                turning[a] = step / _T
                us[a] = steer_law(angles[a] - said[4 + a], turning[a], us[a], b)
            bend = (math.tan(angles[0]) - math.tan(angles[1])) / b.base
            refs_of(slow_v, bend, turning, angles, b, refs)
            for i in range(4):
                wheel_law(w[i], parts[i], refs[i], said[i], s[OIL], b)
        taken = fx = fy = moment = 0.0
        for a in range(2):
            before[a] = x[a, ANGLE]
            want = hit(us[a], loss[m, 10 + a], sat[m, 10 + a], held, 10 + a)
            steer(x[a], want, 1.0 - 2.0 * a, v, s[OIL], load[2 * a] + load[2 * a + 1], b)
        for i in range(4):
            valve(w[i], hit(w[i, ASKED], loss[m, 6 + i], sat[m, 6 + i], held, 6 + i), b)
            torque, locked, q = motor(w[i], parts[i], s, b)
            taken += q
            a, (lx, ly, off) = i // 2, at[i]
            angle, turn = angle_of(x[a, ANGLE], lx, ly, b), (x[a, ANGLE] - before[a]) / H
            cos, sin = math.cos(angle), math.sin(angle)
            vx, vy = v - r * ly, side + r * lx
            along, across = vx * cos + vy * sin - (r + turn) * off, vy * cos - vx * sin
            wx, wy = px + math.cos(th) * lx - math.sin(th) * ly, py + math.sin(th) * lx + math.cos(th) * ly
            soft = b.soft * min(max(math.sin(wx / 1.9 + field[0]) * math.sin(wy / 1.1 + field[1]) - 0.3, 0.0), 1.0)
            gx, gy = tyre(w[i], parts[i], along, across, load[i], b.grip * (1.0 - 0.5 * soft), b)
            turn_wheel(w[i], parts[i], torque, locked, gx, load[i], b)
            passes[i] = along
            bx = gx * cos - gy * sin - 0.06 * soft * load[i] * math.tanh(v / 0.02)
            by = gx * sin + gy * cos
            fx, fy, moment = fx + bx, fy + by, moment + lx * by - ly * bx - gx * off
        supply_of(s, taken, b)
        total = b.mass * (1.0 + work[m, 2])
        drag = work[m, 0] * b.mass * 9.81 * math.tanh(v / 0.01)
        fx, moment = fx - drag, moment + drag * work[m, 1]
        hx = b.grade + 0.01 * math.sin(px / 3.0 + field[2])
        hy = b.camber + 0.008 * math.sin(px / 4.0 + field[3])
        v += H * (fx / total - 9.81 * (hx * math.cos(th) + hy * math.sin(th)) + side * r)
        side += H * (fy / total - 9.81 * (hy * math.cos(th) - hx * math.sin(th)) - v * r)
        r += H * moment / (total * (b.base**2 + b.track**2) / 8)
        th += H * r
        px, py = px + H * (v * math.cos(th) - side * math.sin(th)), py + H * (v * math.sin(th) + side * math.cos(th))
        ax, ay = ax + H / 0.3 * (fx / total - ax), ay + H / 0.3 * (fy / total - ay)
        front = 0.5 + b.cg + 0.3 * work[m, 2] / (1.0 + work[m, 2]) - 0.3 * work[m, 0] - b.height / b.base * ax / 9.81
        left = 0.5 - b.height / b.track * ay / 9.81
        for i in range(4):
            share = (front if i < 2 else 1.0 - front) * (left if i % 2 else 1.0 - left)
            load[i] = total * 9.81 * min(max(share, 0.05), 0.6)
        if k % 2 == 0:
            ref[m, :4], ref[m, 4:], given[m, :4], given[m, 4:] = refs, angles, w[:, ASKED], us
            true[m, :4], true[m, 4:], read[m] = w[:, TURN] * b.radius, x[:, ANGLE], said
            done[m, :4], done[m, 4:] = w[:, SPOOL], x[:, A_SPOOL]
            body[m], under[m] = (v, side, r, slow_v, bend), passes
            source[m] = s[P], s[OIL], w[0, PORT_A], w[0, PORT_B], w[0, SHUT]
    return ref, true, read, given, done, body, source, under
