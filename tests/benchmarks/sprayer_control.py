"""What drives the machine of `sprayer.py`: pole wheels timed by nodes on a bus, linkages, the controller of 50 Hz, and a mission."""

from __future__ import annotations

import math

import numba as nb
import numpy as np
from electric_control import refs_of
from electric_physics import angle_of
from electrohydraulic_physics import hit, places
from sprayer_physics import (
    A_SPOOL,
    ANGLE,
    ASKED,
    BACKLASH,
    CHARGES,
    COUNT,
    EDGE,
    ENGINE,
    LAST,
    OIL,
    READ,
    ROLLED,
    SCALE,
    SINCE,
    SPOOL,
    TOTAL,
    TURN,
    WAVE,
    Array,
    Build,
    H,
    P,
    charge,
    motor,
    rolls_at,
    spool_of,
    steer,
    turn_wheel,
    tyre,
)  # fmt: skip

_CYCLE = 40  # steps of the controller's cycle, 20 ms
_T = _CYCLE * H
_BRAKES_S, _RELEASE_S = 2.5, 0.3


@nb.njit(cache=True)
def edges(w: Array, part: Array, now: float, b: Build) -> None:
    """Count a pole wheel's edges, and time the last one by the node's clock."""
    teeth = (w[ROLLED] + part[WAVE] * math.sin(w[ROLLED])) * b.teeth / (2.0 * math.pi)
    moved = math.floor(teeth) - w[EDGE]
    if moved != 0.0:
        beyond = teeth - math.floor(teeth) if moved > 0.0 else math.floor(teeth) + 1.0 - teeth
        passed = min(beyond / max(abs(w[TURN]) * b.teeth / (2.0 * math.pi), 1e-3), H)
        w[LAST] = math.floor((now - passed) / b.tick) * b.tick
        w[COUNT] += moved
        w[EDGE] = math.floor(teeth)


@nb.njit(cache=True)
def node(w: Array, part: Array, now: float, b: Build) -> float:
    """A node's reading [m/s]: edges since the last reading by their time; held where none came, nothing after a time or below a least speed."""
    pitch = 2.0 * math.pi / b.teeth * b.radius * part[SCALE]
    if w[COUNT] != 0.0 and w[SINCE] >= 0.0:
        w[READ] = w[COUNT] * pitch / max(w[LAST] - w[SINCE], b.tick)
    if w[COUNT] != 0.0:
        w[SINCE], w[COUNT] = w[LAST], 0.0
    if now - w[LAST] > min(pitch / b.least, b.wait):
        w[READ], w[SINCE] = 0.0, -1.0
    if abs(w[READ]) < b.least:
        w[READ] = 0.0
    return math.floor(w[READ] * 1000.0 / 3.6 + 0.5) * 3.6 / 1000.0


@nb.njit(cache=True)
def seen(angle: float, x: float, b: Build) -> float:
    """Angle of an axle as its two sensors have it, left and right, behind linkages that are not quite straight; the mean of both."""
    total = 0.0
    for side in (-1.0, 1.0):
        one = angle_of(angle, x, side * b.track / 2.0, b)
        total += 0.5 * one * (1.0 + b.gain + b.bow * (side * one / b.stop))
    return math.floor(total / 0.0015 + 0.5) * 0.0015


@nb.njit(cache=True)
def wheel_law(w: Array, ref: float, y: float, held: bool, b: Build) -> None:
    """Command of a wheel's valve: feed-forward, PI whose integral runs back by what the limits took, a jump over the overlap."""
    wrong = (ref - y) / b.top
    if held or abs(ref) < 0.004 * b.top:  # shuts, which blocks the wheel
        w[TOTAL] *= 0.9
        w[ASKED] = 0.0 if held else w[ASKED] - min(max(w[ASKED], -b.slew * _T), b.slew * _T)
        return
    line = b.forward * ref / b.radius * b.motor / (0.88 * b.flow) + b.proportional * wrong + w[TOTAL]
    line = math.copysign(max(math.copysign(line, line * ref), 0.0), ref)  # never against what is asked
    jump = b.known * b.dead
    u = math.copysign(jump * min(abs(line) / 0.012, 1.0) + (1.0 - jump) * abs(line), line)
    given = min(max(u, w[ASKED] - b.slew * _T, -1.0), w[ASKED] + b.slew * _T, 1.0)
    w[TOTAL] = min(max(w[TOTAL] + _T * (b.integral * wrong + (given - u) / b.unwind), -0.5), 0.5)
    w[ASKED] = math.floor(given * 400 + 0.5) / 400


@nb.njit(cache=True)
def steer_law(wrong: float, turning: float, last: float, b: Build) -> float:
    """Command of a steering valve: more than its overlap where the angle is to turn, or off by a tolerance until it is a third of it."""
    if abs(wrong) < (b.tolerance if last == 0.0 else b.tolerance / 3) and turning == 0.0:
        return 0.0
    line = b.steer_gain * wrong + 0.9 * turning / b.steer_rate
    jump = b.known * b.steer_dead * min(abs(line) / 0.03, 1.0)
    return min(max(math.floor((line + math.copysign(jump, line)) * 400 + 0.5) / 400, -1.0), 1.0)


@nb.njit(cache=True)
def ground(wx: float, wy: float, field: Array, b: Build) -> tuple[float, float]:
    """How soft and wet it is under a wheel (0 … 1), and how steep a rut's edge is that it climbs."""
    soft = min(max(1.7 * math.sin(wx / 5.1 + field[2]) * math.sin(wy / 1.9 + field[3]) - 0.7, 0.0), 1.0)
    return b.wet * soft, 0.03 * b.wet * math.sin(wx / 0.9 + wy / 1.3 + field[4])


@nb.njit(cache=True)
def drive(
    asked_v: Array, asked_angle: Array, full: Array, loss: Array, sat: Array, noise: Array, field: Array, parts: Array, b: Build,
) -> tuple[Array, ...]:  # fmt: skip
    """References, true values, what the controller reads, commands, spools, body (speed, sideways, yaw rate, speed and curvature
    asked), supply (pressure, engine, oil), per millisecond.
    """
    n = asked_v.size
    six = np.zeros((5, n, 6))
    ref, true, read, given, done = six[0], six[1], six[2], six[3], six[4]
    body, source = np.zeros((n, 5)), np.zeros((n, 3))
    w, x, at, line = np.zeros((4, 15)), np.zeros((2, 6)), places(b), np.zeros((6, 64))
    said, refs, held, us, angles, turning, before = (
        np.zeros(6), np.zeros(4), np.zeros(12), np.zeros(2), np.zeros(2), np.zeros(2), np.zeros(2),
    )  # fmt: skip
    load, s = np.full(4, b.mass * 9.81 / 4), np.zeros(4)
    s[P], s[CHARGES], s[ENGINE], s[OIL] = 0.5 * (b.high + b.low), 1.0, 1.0, b.cold
    v = side = r = th = px = py = ax = ay = bend = slow_v = trim = resting = moved = wave = wave_v = 0.0
    waiting, brake = 0.0, 1.0
    for k in range(2 * n):
        m, now = k // 2, k * H
        for i in range(4):
            edges(w[i], parts[i], now, b)
            if (k + 13 * i) % b.node == 0:
                said[i] = hit(node(w[i], parts[i], now, b), loss[m, i], sat[m, i], held, i)
        if k % _CYCLE == 0:
            resting = resting + _T if asked_v[m] == 0.0 and slow_v == 0.0 else 0.0
            waiting = waiting + _T if asked_v[m] != 0.0 and brake > 0.0 else 0.0
            brake = 1.0 if resting > _BRAKES_S or (brake > 0.0 and waiting < _RELEASE_S) else 0.0
            step = b.ramp * _T * (1.0 if abs(asked_v[m]) > abs(slow_v) else 1.5)
            goal = asked_v[m] if brake == 0.0 else 0.0
            slow_v += min(max(goal - slow_v, -step), step)
            for a in range(2):
                good = seen(x[a, ANGLE], at[2 * a, 0], b) + noise[m, a]
                said[4 + a] = hit(good, loss[m, 4 + a], sat[m, 4 + a], held, 4 + a)
                step = 0.65 * b.steer_rate * _T
                step = min(max(asked_angle[m, a] - angles[a], -step), step)
                angles[a] += step
                turning[a] = step / _T
                us[a] = steer_law(angles[a] - said[4 + a], turning[a], us[a], b)
            bend = (math.tan(angles[0]) - math.tan(angles[1])) / b.base
            rolls = abs(slow_v) > 0.1 * b.top
            moved = 0.0
            for i in range(4):  # how far all wheels are off, which an outer loop takes out
                moved += 0.25 * (refs[i] - said[i]) if rolls else 0.0
            trim = min(max(trim + _T * b.cruise * moved, -0.04 * b.top), 0.04 * b.top) if rolls else 0.9 * trim
            refs_of(slow_v + trim if slow_v != 0.0 else 0.0, bend, turning, angles, b, refs)
            for i in range(4):
                wheel_law(w[i], refs[i], said[i], brake > 0.0, b)
        for i in range(4):
            line[i, k % 64] = w[i, ASKED]
        line[4, k % 64], line[5, k % 64] = us[0], us[1]
        late = (k - b.delay) % 64
        taken = fx = fy = moment = 0.0
        for a in range(2):
            before[a] = x[a, ANGLE]
            want = hit(line[4 + a, late], loss[m, 10 + a], sat[m, 10 + a], held, 10 + a)
            taken += steer(x[a], want, 1.0 - 2.0 * a, v, s[P], load[2 * a] + load[2 * a + 1], b)
        for i in range(4):
            want = hit(line[i, late], loss[m, 6 + i], sat[m, 6 + i], held, 6 + i)
            spool_of(w[i], BACKLASH, want, b)
            torque, q = motor(w[i], parts[i], s, b)
            taken += q
            a, (lx, ly, off) = i // 2, at[i]
            angle, turn = angle_of(x[a, ANGLE], lx, ly, b), (x[a, ANGLE] - before[a]) / H
            cos, sin = math.cos(angle), math.sin(angle)
            vx, vy = v - r * ly, side + r * lx
            along, across = vx * cos + vy * sin - (r + turn) * off, vy * cos - vx * sin
            soft, rise = ground(
                px + math.cos(th) * lx - math.sin(th) * ly, py + math.sin(th) * lx + math.cos(th) * ly, field, b
            )
            radius = rolls_at(parts[i], load[i], b)
            gx, gy = tyre(w[i], radius, along, across, load[i], b.grip * (1.0 - 0.5 * soft), b)
            turn_wheel(w[i], parts[i], torque, gx, radius, load[i], soft, brake, b)
            bx, by = gx * cos - gy * sin - rise * load[i], gx * sin + gy * cos
            fx, fy, moment = fx + bx, fy + by, moment + lx * by - ly * bx - gx * off
        charge(s, taken, b)
        total, wet = b.mass * (1.0 + b.tank * full[m]), b.slosh * b.mass * b.tank * full[m]
        pull = b.slosh_rate**2 * wave + 0.12 * b.slosh_rate * wave_v  # of the liquid's surface, ahead
        felt = (fx + wet * pull) / (total - wet)
        wave_v -= H * (felt + pull)
        wave += H * wave_v
        hx = b.hill * math.sin(px / b.hill_length + field[0])
        hy = 0.8 * b.hill * math.sin(py / (0.7 * b.hill_length) + field[1])
        v += H * (felt - 9.81 * (hx * math.cos(th) + hy * math.sin(th)) + side * r)
        side += H * (fy / total - 9.81 * (hy * math.cos(th) - hx * math.sin(th)) - v * r)
        r += H * moment / (total * (b.base**2 + b.track**2) / 9)
        th += H * r
        px, py = px + H * (v * math.cos(th) - side * math.sin(th)), py + H * (v * math.sin(th) + side * math.cos(th))
        ax, ay = ax + H / 0.2 * (fx / total - ax), ay + H / 0.2 * (fy / total - ay)
        front = 0.5 + b.cg + 0.3 * wet / total * wave - b.height / b.base * ax / 9.81
        left = 0.5 - b.height / b.track * ay / 9.81
        for i in range(4):
            share = (front if i < 2 else 1.0 - front) * (left if i % 2 else 1.0 - left)
            load[i] = total * 9.81 * min(max(share, 0.03), 0.6)
        if k % 2 == 0:
            ref[m, :4], ref[m, 4:], given[m, :4], given[m, 4:] = refs, angles, w[:, ASKED], us
            true[m, :4], true[m, 4:], read[m] = w[:, TURN] * b.radius, x[:, ANGLE], said
            done[m, :4], done[m, 4:] = w[:, SPOOL], x[:, A_SPOOL]
            body[m] = v, side, r, slow_v, bend
            source[m] = s[P], s[ENGINE], s[OIL]
    return ref, true, read, given, done, body, source
