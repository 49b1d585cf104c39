"""What drives the machine of `telehandler.py`: poles counted by Hall sensors, the controller of 100 Hz, and a mission."""

from __future__ import annotations

import math

import numba as nb
import numpy as np
from electric_control import refs_of
from electric_physics import angle_of
from electrohydraulic_physics import hit, places
from telehandler_physics import (
    A_SPOOL,
    AGAINST,
    ANGLE,
    ASKED,
    BEFORE,
    EDGE,
    ENGINE,
    OIL,
    READ,
    ROLLED,
    SCALE,
    SENSE,
    SINCE,
    SIZE,
    SPOOL,
    TOTAL,
    TURN,
    UNEVEN,
    WAVE,
    Array,
    Build,
    H,
    P,
    motor,
    rolls_at,
    spool_of,
    steer,
    supply_of,
    turn_wheel,
    tyre,
)  # fmt: skip

_CYCLE = 20  # steps of the controller's cycle, 10 ms
_T = _CYCLE * H
_BRAKES_S, _RELEASE_S = 2.0, 0.25


@nb.njit(cache=True)
def hall(w: Array, part: Array, now: float, b: Build) -> None:
    """Time poles that pass; which way is told by a second sensor, whose logic needs some edges to believe that the wheel has turned round."""
    uneven = part[WAVE] * math.sin(w[ROLLED]) + part[UNEVEN] * math.sin(7.0 * w[ROLLED] + 1.0)
    teeth = (w[ROLLED] + uneven) * b.teeth / (2.0 * math.pi)
    pitch = 2.0 * math.pi / b.teeth * b.radius * part[SCALE]
    moved = math.floor(teeth) - w[EDGE]
    if moved != 0.0:
        beyond = teeth - math.floor(teeth) if moved > 0.0 else math.floor(teeth) + 1.0 - teeth
        when = now - min(beyond / max(abs(w[TURN]) * b.teeth / (2.0 * math.pi), 1e-3), H)
        way = math.copysign(1.0, moved)
        w[AGAINST] = w[AGAINST] + 1.0 if way != w[SENSE] else 0.0
        if w[AGAINST] > b.flips or w[SENSE] == 0.0:
            w[SENSE], w[AGAINST] = way, 0.0
        size = 2.0 * abs(moved) * pitch / max(when - w[BEFORE], H)
        size = size if w[AGAINST] != 1.0 else min(size, abs(w[READ]))  # the same edge, passed back
        w[READ] = w[SENSE] * size
        w[EDGE], w[BEFORE], w[SINCE] = math.floor(teeth), w[SINCE], when
    most = 1.5 * pitch / max(now - w[SINCE], H)
    if abs(w[READ]) > most:
        w[READ] = math.copysign(most, w[READ])
    if now - w[SINCE] > b.wait:
        w[READ] = 0.0


@nb.njit(cache=True)
def wheel_law(w: Array, ref: float, y: float, size: float, held: bool, b: Build) -> None:
    """Command of a wheel's valve: feed-forward for the motor's size, PI whose integral runs back by what limits took, a jump over the overlap."""
    wrong = (ref - y) / b.top
    if held or abs(ref) < 0.004 * b.top:
        w[TOTAL] *= 0.95
        w[ASKED] = 0.0 if held or abs(w[ASKED]) < 0.5 * b.dead else w[ASKED] - math.copysign(b.slew * _T, w[ASKED])
        return
    line = b.forward * ref / b.radius * b.motor * size / b.flow
    line = math.copysign(abs(line) ** (1.0 / b.curve), line) + (b.proportional * wrong + w[TOTAL]) * size
    line = math.copysign(max(math.copysign(line, line * ref), 0.0), ref)  # never against what is asked
    jump = b.known * b.dead
    u = math.copysign(jump + (1.0 - jump) * abs(line), line) if line != 0.0 else 0.0
    start = w[ASKED] if abs(w[ASKED]) >= jump and w[ASKED] * u > 0.0 else math.copysign(jump, u)  # a jump across
    given = min(max(u, start - b.slew * _T, -1.0), start + b.slew * _T, 1.0)
    w[TOTAL] = min(max(w[TOTAL] + _T * (b.integral * wrong + (given - u) / b.unwind), -0.35), 0.35)
    w[ASKED] = math.floor(given * 1000 + 0.5) / 1000


@nb.njit(cache=True)
def steer_law(wrong: float, turning: float, last: float, b: Build) -> float:
    """Command of a steering valve: more than its overlap where the angle is to turn, or off by a tolerance until it is a third of it."""
    if abs(wrong) < (b.tolerance if last == 0.0 else b.tolerance / 3) and turning == 0.0:
        return 0.0
    line = b.steer_gain * wrong + 0.9 * turning / b.steer_rate
    jump = max(b.known, 0.93) * b.steer_dead * min(abs(line) / 0.008, 1.0)
    return min(max(math.floor((line + math.copysign(jump, line)) * 1000 + 0.5) / 1000, -1.0), 1.0)


@nb.njit(cache=True)
def ground(wx: float, wy: float, field: Array, b: Build) -> tuple[float, float]:
    """How loose the gravel under a wheel is (0 … 1), and how steep its bumps are."""
    patch = math.sin(wx / 2.3 + field[2]) * math.sin(wy / 0.9 + field[3]) + 0.5 * math.sin(wx / 7.0 + field[4])
    loose = b.gravel * min(max(1.6 * patch - 0.6, 0.0), 1.0)
    return loose, 0.02 * math.sin(wx / 0.6 + wy / 0.9 + field[5]) * (1.0 + loose)


@nb.njit(cache=True)
def drive(
    asked_v: Array, asked_angle: Array, gear: Array, boom: Array, throttle: Array, loss: Array, sat: Array, noise: Array,
    field: Array, parts: Array, b: Build,
) -> tuple[Array, ...]:  # fmt: skip
    """References, true values, what the controller reads, commands, spools, body (speed, sideways, yaw rate, speed and curvature
    asked), source (pressure, engine, oil, size of a rear motor), per millisecond. `boom`: load [of the machine], its place ahead
    of the middle [of the wheelbase], flow [of its most].
    """
    n = asked_v.size
    six = np.zeros((5, n, 6))
    ref, true, read, given, done = six[0], six[1], six[2], six[3], six[4]
    body, source = np.zeros((n, 5)), np.zeros((n, 4))
    w, x, at = np.zeros((4, 19)), np.zeros((2, 7)), places(b)
    w[:, SIZE] = 1.0
    said, refs, held, us, angles, turning, before, sizes = (
        np.zeros(6), np.zeros(4), np.zeros(12), np.zeros(2), np.zeros(2), np.zeros(2), np.zeros(2), np.ones(4),
    )  # fmt: skip
    load, s = np.full(4, b.mass * 9.81 / 4), np.zeros(4)
    s[P], s[ENGINE], s[OIL] = b.margin, b.idle, b.cold
    v = side = r = th = px = py = ax = ay = bend = slow_v = resting = waiting = 0.0
    brake = 1.0
    for k in range(2 * n):
        m, now = k // 2, k * H
        for i in range(4):
            hall(w[i], parts[i], now, b)
            sizes[i] = b.small if gear[m] > 0.5 and (i > 1 or b.front_shifts) else 1.0
        if k % _CYCLE == 0:
            for i in range(4):
                said[i] = hit(w[i, READ], loss[m, i], sat[m, i], held, i)
            resting = resting + _T if asked_v[m] == 0.0 and slow_v == 0.0 else 0.0
            waiting = waiting + _T if asked_v[m] != 0.0 and brake > 0.0 else 0.0
            brake = 1.0 if resting > _BRAKES_S or (brake > 0.0 and waiting < _RELEASE_S) else 0.0
            room = min(
                max((s[ENGINE] / max(throttle[m], 0.1) - 0.55) / 0.25, b.spares), 1.0
            )  # where the engine labours
            goal = asked_v[m] * room if brake == 0.0 else 0.0
            step = b.ramp * _T * (1.0 if abs(goal) > abs(slow_v) else 1.6)
            slow_v += min(max(goal - slow_v, -step), step)
            for a in range(2):
                good = math.floor((x[a, ANGLE] + noise[m, a]) / 0.0017 + 0.5) * 0.0017
                said[4 + a] = hit(good, loss[m, 4 + a], sat[m, 4 + a], held, 4 + a)
                step = 0.65 * b.steer_rate * _T
                step = min(max(asked_angle[m, a] - angles[a], -step), step)
                angles[a] += step
                turning[a] = step / _T
                us[a] = steer_law(angles[a] - said[4 + a], turning[a], us[a], b)
            bend = (math.tan(angles[0]) - math.tan(angles[1])) / b.base
            refs_of(slow_v, bend, turning, angles, b, refs)
            for i in range(4):
                wheel_law(w[i], refs[i], said[i], sizes[i], brake > 0.0, b)
        taken = fx = fy = moment = 0.0
        first, asks = b.boom_flow * boom[m, 2], (0.35 + 0.4 * boom[m, 0]) * b.most if boom[m, 2] > 0.0 else 0.0
        for a in range(2):
            before[a] = x[a, ANGLE]
            want = hit(us[a], loss[m, 10 + a], sat[m, 10 + a], held, 10 + a)
            first += steer(x[a], want, now, 1.0 - 2.0 * a, v, ay / 9.81, s, load[2 * a] + load[2 * a + 1], b)
        for i in range(4):
            spool_of(w[i], hit(w[i, ASKED], loss[m, 6 + i], sat[m, 6 + i], held, 6 + i), now, s[OIL], b)
            torque, q, want = motor(w[i], parts[i], s, sizes[i], b)
            taken, asks = taken + q, max(asks, want)
            a, (lx, ly, off) = i // 2, at[i]
            angle, turn = angle_of(x[a, ANGLE], lx, ly, b), (x[a, ANGLE] - before[a]) / H
            cos, sin = math.cos(angle), math.sin(angle)
            vx, vy = v - r * ly, side + r * lx
            along, across = vx * cos + vy * sin - (r + turn) * off, vy * cos - vx * sin
            loose, rise = ground(
                px + math.cos(th) * lx - math.sin(th) * ly, py + math.sin(th) * lx + math.cos(th) * ly, field, b
            )
            radius = rolls_at(parts[i], load[i], b)
            gx, gy = tyre(w[i], radius, along, across, load[i], b.grip * (1.0 - 0.55 * loose), b)
            turn_wheel(w[i], parts[i], torque, gx, radius, load[i], loose, brake, b)
            bx, by = gx * cos - gy * sin - rise * load[i], gx * sin + gy * cos
            fx, fy, moment = fx + bx, fy + by, moment + lx * by - ly * bx - gx * off
        supply_of(s, first, taken, asks, throttle[m], b)
        total = b.mass * (1.0 + boom[m, 0])
        hx = b.hill * math.sin(px / b.hill_length + field[0])
        hy = 0.7 * b.hill * math.sin(py / (0.8 * b.hill_length) + field[1])
        v += H * (fx / total - 9.81 * (hx * math.cos(th) + hy * math.sin(th)) + side * r)
        side += H * (fy / total - 9.81 * (hy * math.cos(th) - hx * math.sin(th)) - v * r)
        r += H * moment / (total * (b.base**2 + b.track**2) / 8)
        th += H * r
        px, py = px + H * (v * math.cos(th) - side * math.sin(th)), py + H * (v * math.sin(th) + side * math.cos(th))
        ax, ay = ax + H / 0.2 * (fx / total - ax), ay + H / 0.2 * (fy / total - ay)
        ahead = boom[m, 0] * boom[m, 1] / (1.0 + boom[m, 0])
        front = 0.5 + b.cg / (1.0 + boom[m, 0]) + ahead - b.height / b.base * ax / 9.81
        left = 0.5 - b.height / b.track * ay / 9.81
        for i in range(4):
            share = (front if i < 2 else 1.0 - front) * (left if i % 2 else 1.0 - left)
            load[i] = total * 9.81 * min(max(share, 0.03), 0.6)
        if k % 2 == 0:
            ref[m, :4], ref[m, 4:], given[m, :4], given[m, 4:] = refs, angles, w[:, ASKED], us
            true[m, :4], true[m, 4:], read[m] = w[:, TURN] * b.radius, x[:, ANGLE], said
            done[m, :4], done[m, 4:] = w[:, SPOOL], x[:, A_SPOOL]
            body[m] = v, side, r, slow_v, bend
            source[m] = s[P], s[ENGINE], s[OIL], w[2, SIZE]
    return ref, true, read, given, done, body, source
