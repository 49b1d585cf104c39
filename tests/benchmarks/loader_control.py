"""What drives the machine of `loader.py`: signs for teeth that have none, laws of wheels and frames, and a mission step by step."""

from __future__ import annotations

import math

import numba as nb
import numpy as np
from electrohydraulic_physics import hit
from loader_physics import (
    ANGLE,
    ASKED,
    DP,
    ENGINE,
    OIL,
    OPEN,
    RATE,
    SEEN,
    SIGN,
    SIZE,
    STEPS,
    TOTAL,
    TURN,
    Array,
    Build,
    H,
    P,
    bank,
    fold,
    motor,
    pile_force,
    rolls_at,
    supply_of,
    toothed,
    turn_wheel,
    tyre,
)  # fmt: skip

_BRAKES_S, _RELEASE_S = 1.2, 0.25
_TELLS = 0.15  # m/s: below, the second sensor of a pair tells no direction


@nb.njit(cache=True)
def signed(w: Array, given: float) -> float:
    """What a controller reads [m/s]: the teeth's speed, its direction measured where it is fast enough, and else as commanded."""
    if w[RATE] >= _TELLS:
        w[SIGN] = 1.0 if w[TURN] >= 0.0 else -1.0
    elif given != 0.0:
        w[SIGN] = math.copysign(1.0, given)
    return math.floor(w[SIGN] * w[RATE] * 1000.0 + 0.5) / 1000.0


@nb.njit(cache=True)
def wheel_law(w: Array, ref: float, y: float, size: float, held: bool, t: float, b: Build) -> None:
    """Opening that a bank is told: feed-forward by the motor's size and, where nothing compensates, by the measured drop; a capped integral."""
    wrong = (ref - y) / b.top
    if held or abs(ref) < 0.004 * b.top:
        w[TOTAL], w[ASKED] = 0.9 * w[TOTAL], 0.0
        return
    line = b.forward * ref / b.radius * b.motor * size / b.flow + (b.proportional * wrong + w[TOTAL]) * size
    if not b.compensated:
        line /= math.sqrt(min(max(w[SEEN], 0.5), 8.0))
    line = math.copysign(max(math.copysign(line, line * ref), 0.0), ref)  # never against what is asked
    u = min(max(line, -1.0), 1.0)
    if u == line or wrong * line < 0.0:
        w[TOTAL] = min(max(w[TOTAL] + t * b.integral * wrong, -0.25), 0.25)
    w[ASKED] = math.floor(u * 1000 + 0.5) / 1000


@nb.njit(cache=True)
def steer_law(wrong: float, turning: float, last: float, b: Build) -> float:
    """Opening of a frame's bank: by the angle that lacks, once that is more than a tolerance, until it is a third of it; at least half a step."""
    if abs(wrong) < (b.tolerance if last == 0.0 else b.tolerance / 3) and turning == 0.0:
        return 0.0
    line = b.steer_gain * wrong + 0.9 * turning / b.steer_rate
    if abs(line) < 0.5 / STEPS:
        line = math.copysign(0.5 / STEPS, line) if abs(wrong) > b.tolerance / 3 else 0.0
    return min(max(math.floor(line * 1000 + 0.5) / 1000, -1.0), 1.0)


@nb.njit(cache=True)
def refs_of(v: float, bend: float, turning: Array, angle: Array, b: Build, out: Array) -> None:
    """Speed of every wheel [m/s], whose frames turn as a whole, for a speed and curvature of the body, angles of both frames and their rates."""
    w = v * bend
    aside = v * math.tan(angle[0]) - w * b.base / 2
    for i in range(4):
        a = angle[i // 2]
        x, off = (b.base / 2 if i < 2 else -b.base / 2), (-b.half if i % 2 == 0 else b.half)
        out[i] = v * math.cos(a) + (aside + w * x) * math.sin(a) - (w + turning[i // 2]) * off


@nb.njit(cache=True)
def ground(wx: float, wy: float, field: Array, b: Build) -> tuple[float, float]:
    """How soft the mud under a wheel is (0 … 1), and how steep its bumps are."""
    patch = math.sin(wx / 2.0 + field[2]) * math.sin(wy / 1.1 + field[3]) + 0.5 * math.sin(wx / 5.0 + field[4])
    loose = b.mud * min(max(1.6 * patch - 0.5, 0.0), 1.0)
    return loose, 0.015 * math.sin(wx / 0.7 + wy / 0.8 + field[5]) * (1.0 + loose)


@nb.njit(cache=True)
def drive(
    asked_v: Array, asked_angle: Array, gear: Array, work: Array, throttle: Array, loss: Array, sat: Array, noise: Array,
    field: Array, weights: Array, parts: Array, b: Build,
) -> tuple[Array, ...]:  # fmt: skip
    """References, true values, what the controller reads, commands, openings, body (speed, sideways, yaw rate, speed and curvature
    asked), source (pressure, engine, oil, size of a motor, pile's force [of the weight], brake, largest pressure across a motor), per
    millisecond. `work`, shape (n, 3): load in the bucket [of the machine], flow of the lift [of its most], way to a pile [m] where there is one, else 0.
    """
    n, t = asked_v.size, b.cycle * H
    six = np.zeros((5, n, 6))
    ref, true, read, given, done = six[0], six[1], six[2], six[3], six[4]
    body, source = np.zeros((n, 5)), np.zeros((n, 7))
    w, x, banks = np.zeros((4, 15)), np.zeros((2, 3)), np.zeros((6, 19))
    w[:, SIZE], w[:, SIGN], w[:, SEEN], banks[:, 0], banks[:, 1] = 1.0, 1.0, 1.0, 1.0, 1.0
    said, refs, held, us, angles, turning, before = (
        np.zeros(6), np.zeros(4), np.zeros(12), np.zeros(2), np.zeros(2), np.zeros(2), np.zeros(2),
    )  # fmt: skip
    load, s = np.full(4, b.mass * 9.81 / 4), np.zeros(4)
    s[P], s[ENGINE], s[OIL] = b.margin, b.idle, b.cold
    v = side = r = th = px = py = ax = ay = bend = slow_v = resting = waiting = depth = 0.0
    brake = 1.0
    for k in range(2 * n):
        m, now = k // 2, k * H
        size = b.small if gear[m] > 0.5 else 1.0
        for i in range(4):
            toothed(w[i], parts[i], now, b)
        if k % b.cycle == 0:
            for i in range(4):
                said[i] = hit(signed(w[i], w[i, ASKED]), loss[m, i], sat[m, i], held, i)
            resting = resting + t if asked_v[m] == 0.0 and slow_v == 0.0 else 0.0
            waiting = waiting + t if asked_v[m] != 0.0 and brake > 0.0 else 0.0
            brake = 1.0 if resting > _BRAKES_S or (brake > 0.0 and waiting < _RELEASE_S) else 0.0
            goal = asked_v[m] if brake == 0.0 else 0.0
            step = b.ramp * t * (1.0 if abs(goal) > abs(slow_v) else 1.8)
            slow_v += min(max(goal - slow_v, -step), step)
            for a in range(2):
                good = math.floor((x[a, ANGLE] + noise[m, a]) / 0.0017 + 0.5) * 0.0017
                said[4 + a] = hit(good, loss[m, 4 + a], sat[m, 4 + a], held, 4 + a)
                step = 0.6 * b.steer_rate * t
                step = min(max(asked_angle[m, a] - angles[a], -step), step)
                angles[a] += step
                turning[a] = step / t
                us[a] = steer_law(angles[a] - said[4 + a], turning[a], us[a], b)
            bend = (math.tan(angles[0]) - math.tan(angles[1])) / b.base
            refs_of(slow_v, bend, turning, angles, b, refs)
            for i in range(4):
                wheel_law(w[i], refs[i], said[i], size, brake > 0.0, t, b)
        total, lift = b.mass * (1.0 + work[m, 0]), work[m, 1]
        taken = fx = fy = moment = 0.0
        first, asks, left = b.lift_flow * lift, (0.45 + 0.8 * work[m, 0]) * b.most if lift > 0.0 else 0.0, 1.0
        for a in range(2):
            before[a] = x[a, ANGLE]
            edge = bank(
                banks[4 + a], hit(us[a], loss[m, 10 + a], sat[m, 10 + a], held, 10 + a), now, s[OIL], weights[4 + a], b
            )
            first += fold(x[a], edge, 1.0 - 2.0 * a, v, load[2 * a] + load[2 * a + 1], s, left, b)
            left = min(1.0, 1.6 - abs(edge))  # both share a priority valve
        for i in range(4):
            edge = bank(
                banks[i], hit(w[i, ASKED], loss[m, 6 + i], sat[m, 6 + i], held, 6 + i), now, s[OIL], weights[i], b
            )
            torque, q, want = motor(w[i], parts[i], edge, s, size, b)
            taken, asks, a = taken + q, max(asks, want), i // 2
            fore, off = 1.0 - 2.0 * a, (-b.half if i % 2 == 0 else b.half)
            turn = (x[a, ANGLE] - before[a]) / H
            cos, sin = math.cos(x[a, ANGLE]), math.sin(x[a, ANGLE])
            lx = fore * (b.base / 2 - b.inset + b.inset * cos) - off * sin
            ly = fore * b.inset * sin + off * cos
            vx, vy = v - r * ly, side + r * lx
            along = vx * cos + vy * sin - turn * off
            across = vy * cos - vx * sin + turn * fore * b.inset
            loose, rise = ground(
                px + math.cos(th) * lx - math.sin(th) * ly, py + math.sin(th) * lx + math.cos(th) * ly, field, b
            )
            radius = rolls_at(parts[i], load[i], b)
            gx, gy = tyre(w[i], radius, along, across, load[i], b.grip * (1.0 - 0.5 * loose), b)
            turn_wheel(w[i], parts[i], torque, gx, radius, load[i], loose, brake, b)
            bx, by = gx * cos - gy * sin - rise * load[i], gx * sin + gy * cos
            fx, fy, moment = fx + bx, fy + by, moment + lx * by - ly * bx
        supply_of(s, first, taken, asks, throttle[m], b)
        hx = b.hill * math.sin(px / b.hill_length + field[0])
        hy = 0.7 * b.hill * math.sin(py / (0.8 * b.hill_length) + field[1])
        v += H * (fx / total - 9.81 * (hx * math.cos(th) + hy * math.sin(th)) + side * r)
        depth = -work[m, 2] if work[m, 2] <= 0.0 or (m > 0 and work[m - 1, 2] <= 0.0) else depth + H * v
        pile = pile_force(depth, total, b) if work[m, 2] > 0.0 else 0.0
        pile = min(pile, max(v, 0.0) * total / H)  # a heap only holds against what comes
        v -= H * pile / total
        side += H * (fy / total - 9.81 * (hy * math.cos(th) - hx * math.sin(th)) - v * r)
        r += H * moment / (total * (b.base**2 + 4.0 * b.half**2) / 8)
        th += H * r
        px, py = px + H * (v * math.cos(th) - side * math.sin(th)), py + H * (v * math.sin(th) + side * math.cos(th))
        ax, ay = ax + H / 0.2 * ((fx - pile) / total - ax), ay + H / 0.2 * (fy / total - ay)
        ahead = 0.8 * work[m, 0] / (1.0 + work[m, 0]) + (0.25 * lift - 0.1) * pile / (total * 9.81)
        front = 0.5 + b.cg / (1.0 + work[m, 0]) + ahead - b.height / b.base * ax / 9.81
        lefts = 0.5 - b.height / (2.0 * b.half) * ay / 9.81
        for i in range(4):
            share = (front if i < 2 else 1.0 - front) * (lefts if i % 2 else 1.0 - lefts)
            load[i] = total * 9.81 * min(max(share, 0.03), 0.6)
        if k % 2 == 0:
            ref[m, :4], ref[m, 4:], given[m, :4], given[m, 4:] = refs, angles, w[:, ASKED], us
            true[m, :4], true[m, 4:], read[m] = w[:, TURN] * b.radius, x[:, ANGLE], said
            done[m] = banks[:, OPEN]
            body[m] = v, side, r, slow_v, bend
            source[m] = s[P], s[ENGINE], s[OIL], w[2, SIZE], pile / (total * 9.81), brake, np.abs(w[:, DP]).max()
    return ref, true, read, given, done, body, source
