"""What drives the machine of `harvester.py`: its laws, its lock and brakes, and a mission step by step."""

from __future__ import annotations

import math

import numba as nb
import numpy as np
from electric_control import refs_of
from electric_physics import angle_of
from electrohydraulic_physics import hit, places
from harvester_physics import (
    A_VALVE,
    ANGLE,
    ASKED,
    BIT,
    BRAKE,
    COUNTS,
    ENGINE,
    P_R,
    READ,
    SPILL_R,
    SPOOL,
    TOTAL,
    WARM,
    Array,
    Build,
    H,
    bump,
    count,
    loads_of,
    motor,
    opening_for,
    steer,
    supply_of,
    turn_wheel,
    valve,
)
from tug_control import ground, rounded
from tug_physics import TURN, rolls_at, tyre

_BRAKES_S, _RELEASE_S = 1.0, 0.25


@nb.njit(cache=True)
def wheel_law(w: Array, ref: float, y: float, size: float, engine: float, rests: bool, t: float, b: Build) -> None:
    """Current of a valve (−1 … 1): the opening that a map gives for the engine's speed, proportional and a capped integral, in ramps."""
    goal = 0.0
    if rests or abs(ref) < b.lever * b.top:
        w[TOTAL] *= 1.0 - t / 0.5
    else:
        wrong = (ref - y) / b.top
        share = min(abs(ref) * size / b.full, 0.97 * engine)
        known = opening_for(share, b.known_overlap, engine, b.known_load, b)
        line = math.copysign(known, ref) + b.proportional * wrong + w[TOTAL]
        line = math.copysign(max(math.copysign(line, line * ref), 0.0), ref)  # never against what is asked
        goal = min(max(line, -1.0), 1.0)
        if goal == line or wrong * line < 0.0:
            w[TOTAL] = min(max(w[TOTAL] + t * b.integral * min(max(wrong, -0.15), 0.15), -0.3), 0.3)
    w[ASKED] = rounded(min(max(goal, w[ASKED] - b.slew * t), w[ASKED] + b.slew * t), b.quantum)


@nb.njit(cache=True)
def steer_law(wrong: float, turning: float, last: float, b: Build) -> float:
    """Current of an axle's valve: by the angle that lacks over its overlap, once that is more than a tolerance, until it is a third of it."""
    if abs(wrong) < (b.tolerance if last == 0.0 else b.tolerance / 3) and turning == 0.0:
        return 0.0
    goal = min(max(b.steer_gain * wrong + 0.8 * turning / b.steer_rate, -1.0), 1.0)
    return rounded(math.copysign(0.85 * b.steer_dead + (1.0 - 0.85 * b.steer_dead) * abs(goal), goal), 0.004)


@nb.njit(cache=True)
def drive(
    asked_v: Array, asked_angle: Array, hopper: Array, throttle: Array, on_road: Array, locked: Array, loss: Array, sat: Array, noise: Array,
    field: Array, parts: Array, b: Build,
) -> tuple[Array, ...]:  # fmt: skip
    """References, true values, what the controller reads, commands, what valves give, body (speed, sideways, yaw rate, speed and curvature
    asked), source (pressures of right and left, engine, spill, largest brake, lock), per millisecond.

    `hopper`: mass of what is picked [of the machine]; `on_road`, `locked`: 1 in the range for roads and where an axle's wheels are locked.
    """
    n, t = asked_v.size, b.cycle * H
    six = np.zeros((5, n, 6))
    ref, true, read, given, done = six[0], six[1], six[2], six[3], six[4]
    body, source = np.zeros((n, 5)), np.zeros((n, 6))
    w, x, s, at, counts = np.zeros((4, 17)), np.zeros((2, 3)), np.zeros(6), places(b), np.zeros((4, COUNTS))
    said, refs, held, us, angles, turning, before, drops, pulls = (
        np.zeros(6), np.zeros(4), np.zeros(12), np.zeros(2), np.zeros(2), np.zeros(2), np.zeros(2), np.zeros(4), np.zeros(4),
    )  # fmt: skip
    load = np.full(4, (1.0 + hopper[0]) * b.mass * 9.81 / 4)
    w[:, BRAKE], w[:, BIT], s[ENGINE], s[WARM] = 1.0, 1.0, throttle[0], 0.5 + 0.5 * math.sin(field[2])
    v = side = r = th = px = py = ax = ay = bend = slow_v = resting = waiting = 0.0
    brake = 1.0
    for k in range(2 * n):
        m = k // 2
        if k % 20 == 0:
            for i in range(4):
                count(w[i], parts[i], counts[i], k // 20, b)
        size = b.road if on_road[m] > 0.5 else 1.0
        if k % b.cycle == 0:
            for i in range(4):
                said[i] = hit(rounded(w[i, READ] + noise[m, i], b.speed_quantum), loss[m, i], sat[m, i], held, i)
            resting = resting + t if asked_v[m] == 0.0 and slow_v == 0.0 else 0.0
            waiting = waiting + t if asked_v[m] != 0.0 and brake > 0.0 else 0.0
            brake = 1.0 if resting > _BRAKES_S or (brake > 0.0 and waiting < _RELEASE_S) else 0.0
            slow_v += min(max((asked_v[m] if brake == 0.0 else 0.0) - slow_v, -b.ramp * t), b.ramp * t)
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
            for i in range(4):
                wheel_law(w[i], refs[i], said[i], size, s[ENGINE], brake > 0.0 or slow_v == 0.0, t, b)
        total, aside = b.mass * (1.0 + hopper[m]), 0.0
        for a in range(2):
            before[a] = x[a, ANGLE]
            want = hit(us[a], loss[m, 10 + a], sat[m, 10 + a], held, 10 + a)
            aside += steer(x[a], want, 1.0 - 2.0 * a, v, load[2 * a] + load[2 * a + 1], s, b)
        for i in range(4):  # what the front section of a side is given its rear one gets too
            valve(w[i], parts[i], hit(w[i, ASKED], loss[m, 6 + i], sat[m, 6 + i], held, 6 + i), b)
            pulls[i], drops[i] = motor(w[i], parts[i], s[ENGINE] - s[SPILL_R + i % 2], size, s, b)
        for a in range(2):  # a lock holds the wheels of an axle together, up to what its plates hold
            if locked[m] > 0.5 and (a == 1 or not b.lock_rear):
                tie = b.lock * math.tanh((w[2 * a, TURN] - w[2 * a + 1, TURN]) / 0.1)
                pulls[2 * a] -= tie
                pulls[2 * a + 1] += tie
        fx = fy = moment = 0.0
        for i in range(4):
            a, (lx, ly, off_y) = i // 2, at[i]
            angle, turn = angle_of(x[a, ANGLE], lx, ly, b), (x[a, ANGLE] - before[a]) / H
            cos, sin = math.cos(angle), math.sin(angle)
            vx, vy = v - r * ly, side + r * lx
            along, across = vx * cos + vy * sin - (r + turn) * off_y, vy * cos - vx * sin
            wx, wy = px + math.cos(th) * lx - math.sin(th) * ly, py + math.sin(th) * lx + math.cos(th) * ly
            slick = ground(wx, wy, field, b)
            radius = rolls_at(parts[i], load[i], b)
            gx, gy = tyre(w[i], radius, along, across, load[i], b.grip * (1.0 - 0.6 * slick), b)
            turn_wheel(w[i], parts[i], pulls[i], gx, radius, load[i], brake, b)
            gx -= load[i] * bump(wx, wy, field, b) * math.tanh(along / 0.1)
            bx, by = gx * cos - gy * sin, gx * sin + gy * cos
            fx, fy, moment = fx + bx, fy + by, moment + lx * by - ly * bx - gx * off_y
        supply_of(s, drops, aside, throttle[m], b)
        s[WARM] = min(s[WARM] + H / 150.0, 1.0)
        hx = b.hill * math.sin(px / b.hill_length + field[0])
        hy = 0.7 * b.hill * math.sin(py / (0.7 * b.hill_length) + field[1])
        down, over = hx * math.cos(th) + hy * math.sin(th), hy * math.cos(th) - hx * math.sin(th)
        v += H * (fx / total - 9.81 * down + side * r)
        side += H * (fy / total - 9.81 * over - v * r)
        r += H * moment / (total * (b.base**2 + b.track**2) / 10)
        th += H * r
        px, py = px + H * (v * math.cos(th) - side * math.sin(th)), py + H * (v * math.sin(th) + side * math.cos(th))
        ax, ay = ax + H / 0.2 * (fx / total - ax), ay + H / 0.2 * (fy / total - ay)
        front = 0.5 + b.cg - b.height / b.base * ax / 9.81
        warp = 0.15 * math.sin(px / 1.9 + field[1]) * math.sin(py / 1.4 + field[0])
        loads_of(total, front, 0.5 - 0.4 * b.height / b.track * ay / 9.81, warp, load)  # it levels itself
        if k % 2 == 0:
            ref[m, :4], ref[m, 4:], given[m, :4], given[m, 4:] = refs, angles, w[:, ASKED], us
            true[m, :4], true[m, 4:], read[m] = w[:, TURN] * b.radius, x[:, ANGLE], said
            done[m, :4], done[m, 4:] = w[:, SPOOL], x[:, A_VALVE]
            body[m] = v, side, r, slow_v, bend
            source[m] = s[P_R], s[P_R + 1], s[ENGINE], s[SPILL_R] + s[SPILL_R + 1], w[:, BRAKE].max(), locked[m]
    return ref, true, read, given, done, body, source
