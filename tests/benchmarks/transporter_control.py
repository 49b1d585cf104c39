"""What drives the machine of `transporter.py`: its laws, its brakes and its engine's limit, and a mission step by step."""

from __future__ import annotations

import math

import numba as nb
import numpy as np
from electric_control import refs_of
from electric_physics import angle_of
from electrohydraulic_physics import hit, places
from transporter_physics import (
    A_VALVE,
    ANGLE,
    ASKED,
    BRAKE,
    CUT,
    DEAF,
    ENGINE,
    FORE,
    READ,
    SIZE,
    SPOOL,
    TOTAL,
    Array,
    Build,
    H,
    P,
    coil,
    gated,
    loads_of,
    motor,
    steer,
    supply_of,
    turn_wheel,
    valve,
)  # fmt: skip
from tug_control import ground, rounded
from tug_physics import TURN, rolls_at, tyre

_BRAKES_S, _RELEASE_S, _COASTS_S = 0.8, 0.35, 2.0


@nb.njit(cache=True)
def wheel_law(w: Array, part: Array, ref: float, y: float, cut: float, rests: bool, t: float, b: Build) -> None:
    """Flow that a valve is told (−1 … 1): feed-forward for the least displacement, proportional and a capped integral, the jump over its
    dead band, what the engine's limit leaves, in ramps. A wheel of which nothing is read yet is not corrected."""
    goal = 0.0
    if rests or abs(ref) < b.lever * b.top:
        w[TOTAL] *= 1.0 - t / 0.4
    else:
        wrong = (ref - y) / b.top
        if y == 0.0 and abs(ref) < 2.0 * part[DEAF]:
            wrong = 0.0
        line = b.forward * ref / b.full + b.proportional * wrong + w[TOTAL]
        line = math.copysign(max(math.copysign(line, line * ref), 0.0), ref)  # never against what is asked
        goal = min(max(line * cut, -1.0), 1.0)
        if goal == line or wrong * line < 0.0:
            w[TOTAL] = min(max(w[TOTAL] + t * b.integral * wrong, -0.35), 0.35)
        goal = math.copysign(b.dead * 0.8 + (1.0 - b.dead * 0.8) * abs(goal), goal) if goal != 0.0 else 0.0
    w[ASKED] = rounded(min(max(goal, w[ASKED] - b.slew * t), w[ASKED] + b.slew * t), b.quantum)


@nb.njit(cache=True)
def steer_law(wrong: float, turning: float, last: float, b: Build) -> float:
    """Flow of an axle's valve: by the angle that lacks, once that is more than a tolerance, until it is a third of it."""
    if abs(wrong) < (b.tolerance if last == 0.0 else b.tolerance / 3) and turning == 0.0:
        return 0.0
    return min(max(rounded(b.steer_gain * wrong + 0.9 * turning / b.steer_rate, 0.004), -1.0), 1.0)


@nb.njit(cache=True)
def limit(s: Array, throttle: float, t: float, b: Build) -> None:
    """Take flow from all wheels by how far the engine is below what its limit allows."""
    lacks = max(throttle * (1.0 - b.reserve) - s[ENGINE], 0.0)
    s[CUT] += t / 0.5 * (max(1.0 - 6.0 * lacks, 0.2) - s[CUT])


@nb.njit(cache=True)
def drive(
    asked_v: Array, asked_angle: Array, carried: Array, throttle: Array, loss: Array, sat: Array, noise: Array, field: Array, parts: Array,
    b: Build,
) -> tuple[Array, ...]:  # fmt: skip
    """References, true values, what the controller reads, commands, what valves give, body (speed, sideways, yaw rate, speed and curvature
    asked), source (pressure, engine, share of the limit, largest displacement, floats, largest brake), per millisecond.

    `carried`: mass on the deck [of the machine].
    """
    n, t = asked_v.size, b.cycle * H
    six = np.zeros((5, n, 6))
    ref, true, read, given, done = six[0], six[1], six[2], six[3], six[4]
    body, source = np.zeros((n, 5)), np.zeros((n, 6))
    w, x, s, at = np.zeros((4, 17)), np.zeros((2, 3)), np.zeros(4), places(b)
    said, refs, held, us, angles, turning, before = (
        np.zeros(6), np.zeros(4), np.zeros(12), np.zeros(2), np.zeros(2), np.zeros(2), np.zeros(2),
    )  # fmt: skip
    load = np.full(4, (1.0 + carried[0]) * b.mass * 9.81 / 4)
    w[:, SIZE], w[:, BRAKE], w[:, FORE], s[P], s[ENGINE], s[CUT] = b.small, 1.0, -1.0, 3e6, throttle[0], 1.0
    v = side = r = th = px = py = ax = ay = bend = slow_v = resting = waiting = coasting = 0.0
    brake, floats = 1.0, False
    for k in range(2 * n):
        m, now = k // 2, k * H
        for i in range(4):
            coil(w[i], parts[i], now, b)
            if (k + 7 * i) % b.gate == 0:
                gated(w[i], parts[i], now, b)
        if k % b.cycle == 0:
            for i in range(4):
                said[i] = hit(rounded(w[i, READ] + noise[m, i], b.speed_quantum), loss[m, i], sat[m, i], held, i)
            resting = resting + t if asked_v[m] == 0.0 and slow_v == 0.0 else 0.0
            waiting = waiting + t if asked_v[m] != 0.0 and brake > 0.0 else 0.0
            brake = 1.0 if resting > _BRAKES_S or (brake > 0.0 and waiting < _RELEASE_S) else 0.0
            goal = asked_v[m] if brake == 0.0 else 0.0
            off = b.coasts and goal == 0.0 and abs(slow_v) > 0.15 * b.top
            coasting = coasting + t if off else 0.0
            floats = off and coasting < _COASTS_S
            step = (b.coast_ramp if floats else b.ramp) * t
            slow_v += min(max(goal - slow_v, -step), step)
            limit(s, throttle[m], t, b)
            for a in range(2):
                good = rounded(x[a, ANGLE] + noise[m, 4 + a], b.angle_quantum)
                said[4 + a] = hit(good, loss[m, 4 + a], sat[m, 4 + a], held, 4 + a)
                step = 0.6 * b.steer_rate * t
                step = min(max(asked_angle[m, a] - angles[a], -step), step)
                angles[a] += step
                turning[a] = step / t
                us[a] = steer_law(angles[a] - said[4 + a], turning[a], us[a], b)
            bend = (math.tan(angles[0]) - math.tan(angles[1])) / b.base
            refs_of(slow_v, bend, turning, angles, b, refs)
            rests = brake > 0.0 or slow_v == 0.0 or floats
            for i in range(4):
                wheel_law(w[i], parts[i], refs[i], said[i], s[CUT], rests, t, b)
        total, taken, asks = b.mass * (1.0 + carried[m]), 0.0, 0.0
        for a in range(2):
            before[a] = x[a, ANGLE]
            want = hit(us[a], loss[m, 10 + a], sat[m, 10 + a], held, 10 + a)
            taken += steer(x[a], want, 1.0 - 2.0 * a, v, load[2 * a] + load[2 * a + 1], s, b)
            asks = max(asks, 0.3 * b.most if abs(want) > 0.02 else 0.0)
        fx = fy = moment = 0.0
        for i in range(4):
            edge = valve(w[i], hit(w[i, ASKED], loss[m, 6 + i], sat[m, 6 + i], held, 6 + i), b)
            torque, q, want = motor(w[i], parts[i], edge, s, floats, b)
            taken, asks = taken + q, max(asks, want)
            a, (lx, ly, off_y) = i // 2, at[i]
            angle, turn = angle_of(x[a, ANGLE], lx, ly, b), (x[a, ANGLE] - before[a]) / H
            cos, sin = math.cos(angle), math.sin(angle)
            vx, vy = v - r * ly, side + r * lx
            along, across = vx * cos + vy * sin - (r + turn) * off_y, vy * cos - vx * sin
            slick = ground(
                px + math.cos(th) * lx - math.sin(th) * ly, py + math.sin(th) * lx + math.cos(th) * ly, field, b
            )
            radius = rolls_at(parts[i], load[i], b)
            gx, gy = tyre(w[i], radius, along, across, load[i], b.grip * (1.0 - 0.6 * slick), b)
            turn_wheel(w[i], parts[i], torque, gx, radius, load[i], brake, b)
            bx, by = gx * cos - gy * sin, gx * sin + gy * cos
            fx, fy, moment = fx + bx, fy + by, moment + lx * by - ly * bx - gx * off_y
        supply_of(s, taken, asks, throttle[m], b)
        hx = b.hill * math.sin(px / b.hill_length + field[0])
        hy = 0.5 * b.hill * math.sin(py / (0.7 * b.hill_length) + field[1])
        v += H * (fx / total - 9.81 * (hx * math.cos(th) + hy * math.sin(th)) + side * r)
        side += H * (fy / total - 9.81 * (hy * math.cos(th) - hx * math.sin(th)) - v * r)
        r += H * moment / (total * (b.base**2 + b.track**2) / 10)
        th += H * r
        px, py = px + H * (v * math.cos(th) - side * math.sin(th)), py + H * (v * math.sin(th) + side * math.cos(th))
        ax, ay = ax + H / 0.2 * (fx / total - ax), ay + H / 0.2 * (fy / total - ay)
        front = 0.5 + b.cg * carried[m] / (1.0 + carried[m]) - b.height / b.base * ax / 9.81
        loads_of(total, front, 0.5 - b.height / b.track * ay / 9.81, b.zone, load)
        if k % 2 == 0:
            ref[m, :4], ref[m, 4:], given[m, :4], given[m, 4:] = refs, angles, w[:, ASKED], us
            true[m, :4], true[m, 4:], read[m] = w[:, TURN] * b.radius, x[:, ANGLE], said
            done[m, :4], done[m, 4:] = w[:, SPOOL], x[:, A_VALVE]
            body[m] = v, side, r, slow_v, bend
            source[m] = s[P], s[ENGINE], s[CUT], w[:, SIZE].max(), 1.0 if floats else 0.0, w[:, BRAKE].max()
    return ref, true, read, given, done, body, source
