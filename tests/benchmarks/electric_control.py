"""What drives the machine of `electric.py`: encoders that time their edges, the controller's cycle, and a mission step by step."""

from __future__ import annotations

import math

import numba as nb
import numpy as np
from electric_physics import (
    ASKED,
    HEAT,
    HUB,
    IQ,
    ROLLED,
    ROOM,
    ROTOR,
    TOTAL,
    WHEEL,
    Array,
    Build,
    H,
    angle_of,
    drive_line,
    loads_of,
    motor,
    rise_of,
    steer,
    turn,
    tyre,
)  # fmt: skip
from electrohydraulic_physics import hit, places

#: State of an encoder: edges passed, time of the last one, edges and time at the last reading, speed shown, lag-filtered speed.
COUNT, EDGE_T, SEEN, SEEN_T, SHOWN, SMOOTH = range(6)
#: State of the controller: speed and acceleration asked of the body, time at rest, brake, time since its release, shared integral,
#: slope that the inclinometer shows.
SPEED, ACCEL, REST, BRAKE, RELEASED, SHARED, TILT = range(7)
_RELEASE_S, _REST_S, _SILENT_S = 0.2, 0.7, 0.4


@nb.njit(cache=True)
def edge_at(k: int, teeth: Array, b: Build) -> float:
    """Where an edge stands, in pitches: a little beside its place."""
    return k + b.uneven * teeth[k % teeth.size]


@nb.njit(cache=True)
def edges(e: Array, way: float, speed: float, now: float, pitch: float, teeth: Array, b: Build) -> None:
    """Count edges that passed in a step and note when the last did, in ticks of the timer."""
    at = way / pitch
    k = math.floor(at)
    if at < edge_at(k, teeth, b):
        k -= 1
    elif at >= edge_at(k + 1, teeth, b):
        k += 1
    if k != e[COUNT]:
        behind = at - edge_at(k if k > e[COUNT] else k + 1, teeth, b)
        late = min(abs(behind * pitch / speed), H) if abs(speed) > 1e-4 else 0.0
        e[EDGE_T] = math.floor((now - late) / b.tick) * b.tick
        e[COUNT] = k


@nb.njit(cache=True)
def timed(e: Array, now: float, pitch: float) -> float:
    """Speed [m/s] by edges over the time between the last ones; without an edge the most that the silence allows, then none."""
    if e[COUNT] != e[SEEN] and e[EDGE_T] > e[SEEN_T]:
        e[SHOWN] = (e[COUNT] - e[SEEN]) * pitch / (e[EDGE_T] - e[SEEN_T])
        e[SEEN], e[SEEN_T] = e[COUNT], e[EDGE_T]
    else:
        silent = now - e[EDGE_T]
        if silent > _SILENT_S:
            e[SHOWN], e[SEEN_T] = 0.0, now - _SILENT_S
        elif silent > 0.0:
            e[SHOWN] = math.copysign(min(abs(e[SHOWN]), pitch / silent), e[SHOWN])
    return float(e[SHOWN])


@nb.njit(cache=True)
def quantised(x: float, quantum: float) -> float:
    """As a bus carries it."""
    return math.floor(x / quantum + 0.5) * quantum


@nb.njit(cache=True)
def ramp(c: Array, demand: float, hurry: bool, t: float, b: Build) -> None:
    """Follow a demand of speed by limits of acceleration, braking and jerk; not before the brakes are off."""
    if c[BRAKE] > 0.0 or c[RELEASED] < _RELEASE_S:
        demand = 0.0
    limit = b.ramp if abs(demand) > abs(c[SPEED]) and demand * c[SPEED] >= 0 else b.brake_ramp
    jerk = b.jerk
    if hurry:
        limit, jerk = 2.0 * b.brake_ramp, 3.0 * b.jerk
    wanted = min(max((demand - c[SPEED]) / 0.25, -limit), limit)
    c[ACCEL] += min(max(wanted - c[ACCEL], -jerk * t), jerk * t)
    c[SPEED] += c[ACCEL] * t
    if demand == 0.0 and abs(c[SPEED]) < 0.004 * b.top and abs(c[ACCEL]) < 0.2 * b.ramp:
        c[SPEED] = c[ACCEL] = 0.0


@nb.njit(cache=True)
def refs_of(v: float, bend: float, turning: Array, angle: Array, b: Build, out: Array) -> None:
    """Speed of every wheel [m/s] for a speed and curvature of the body's middle, angles of the axles and their rates.

    The machine turns about a point beside the place where both axles' normals meet, which `rear` moves from the middle.
    """
    w, at = v * bend, places(b)
    aside = v * math.tan(angle[0]) - w * b.base / 2
    for i in range(4):
        a, (x, y, off) = angle[i // 2], at[i]
        vx, vy = v - w * y, aside + w * x
        out[i] = vx * math.cos(a) + vy * math.sin(a) - (w + turning[i // 2]) * off


@nb.njit(cache=True)
def wheel_law(w: Array, c: Array, ref: float, y: float, mean: float, t: float, b: Build) -> float:
    """Torque asked of a motor: feed-forward, PI on all wheels or on its own with a leak, limits as the inverter reports them."""
    wrong = ref - y
    push = b.known_mass * (c[ACCEL] + b.tilt * 9.81 * c[TILT]) / 4 * b.radius / b.torque
    line = push + b.known_roll * min(max(ref / (0.03 * b.top), -1.0), 1.0)
    if b.shared:
        line += b.proportional * mean + c[SHARED] + 0.5 * b.proportional * (wrong - mean)
    else:
        line += b.proportional * wrong + w[TOTAL]
    given = min(max(line, -w[ROOM]), w[ROOM])
    given = min(max(given, w[ASKED] - b.slew * t), w[ASKED] + b.slew * t)
    w[TOTAL] += t * (b.integral * wrong + 4.0 * (given - line) - w[TOTAL] / b.leak)
    if c[BRAKE] > 0.0:
        w[TOTAL] = given = 0.0
    w[ASKED] = quantised(given, b.quantum_u)
    return float(w[ASKED])


@nb.njit(cache=True)
def steer_law(wrong: float, turning: float, on: Array, a: int, b: Build) -> float:
    """Speed asked of a steering motor: proportional to the angle that is missing, with a dead band that has a hysteresis."""
    if abs(wrong) > b.tolerance or turning != 0.0:
        on[a] = 1.0
    elif abs(wrong) < 0.4 * b.tolerance:
        on[a] = 0.0
    return on[a] * min(max(b.steer_gain * wrong + turning / b.steer_rate, -1.0), 1.0)


@nb.njit(cache=True)
def drive(
    asked_v: Array, asked_angle: Array, hurry: Array, loss: Array, sat: Array, noise: Array, teeth: Array, patches: Array,
    warps: Array, parts: Array, heat: Array, b: Build,
) -> tuple[Array, ...]:  # fmt: skip
    """References, true values, measured ones, second measurements, commands, what motors do, and the body, per millisecond.

    Each but the body has a column per wheel (FR, FL, RR, RL) and axle: m/s and rad, commands −1 … 1. The body's columns: speed,
    sideways speed, yaw rate, speed and curvature asked after the ramps, brake, least room for torque, hottest motor.
    """
    n, t = asked_v.size, b.cycle * H
    ref, true, read, second, given, done, body = (
        np.zeros((n, 6)), np.zeros((n, 6)), np.zeros((n, 6)), np.zeros((n, 6)), np.zeros((n, 6)), np.zeros((n, 6)),
        np.zeros((n, 8)),
    )  # fmt: skip
    w, own, hub, c, axles, at = (
        np.zeros((4, 12)), np.zeros((4, 6)), np.zeros((4, 6)), np.zeros(7), np.zeros((2, 3)), places(b),
    )  # fmt: skip
    held, said, us, refs, angles, turning, on = (
        np.zeros(12), np.zeros(6), np.zeros(2), np.zeros(4), np.zeros(2), np.zeros(2), np.zeros(2),
    )  # fmt: skip
    load, soft, slick, seconds, steered = (
        np.full(4, b.mass * 9.81 / 4),
        np.zeros(4),
        np.zeros(4),
        np.zeros(4),
        np.zeros(2),
    )
    v = side = r = th = px = py = ax = ay = bend = 0.0
    volts = 1.0
    w[:, HEAT], w[:, ROOM] = heat, 1.0
    c[BRAKE], c[REST] = 1.0, 1.0
    for k in range(2 * n):
        m, now = k // 2, k * H
        if k % b.cycle == 0:
            mean, most = 0.0, 0.0
            for i in range(4):
                raw = timed(own[i], now, b.pitch)
                own[i, SMOOTH] += (raw - own[i, SMOOTH]) * min(1.0, t / b.reading_lag)
                y = hit(quantised(own[i, SMOOTH], b.quantum_v), loss[m, i], sat[m, i], held, i)
                said[i] = y
                most = max(most, abs(y))
            ramp(c, asked_v[m], hurry[m] > 0.0, t, b)
            for a in range(2):
                step = min(max(asked_angle[m, a] - angles[a], -0.75 * b.steer_rate * t), 0.75 * b.steer_rate * t)
                angles[a] += step
                turning[a] = step / t
                place = (axles[a, 1] if b.inside else axles[a, 2]) + noise[m, 4 + a]
                said[4 + a] = hit(quantised(place, 5e-4), loss[m, 4 + a], sat[m, 4 + a], held, 4 + a)
                us[a] = steer_law(angles[a] - said[4 + a], turning[a], on, a, b)
            bend = (math.tan(angles[0]) - math.tan(angles[1])) / b.base
            refs_of(c[SPEED], bend, turning, angles, b, refs)
            idle = asked_v[m] == 0.0 and c[SPEED] == 0.0 and most < 0.03 * b.top
            c[REST] = c[REST] + t if idle else 0.0
            if c[REST] > _REST_S and c[BRAKE] == 0.0:
                c[BRAKE], c[SHARED] = 1.0, 0.0
            elif asked_v[m] != 0.0 and c[BRAKE] > 0.0:
                c[BRAKE], c[RELEASED] = 0.0, 0.0
            c[RELEASED] += t
            for i in range(4):
                mean += (refs[i] - said[i]) / 4
            full = 0.0
            for i in range(4):
                full += abs(wheel_law(w[i], c, refs[i], said[i], mean, t, b)) >= w[i, ROOM] - b.quantum_u
                seconds[i] = timed(hub[i], now, b.hub_pitch)
                wx = px + math.cos(th) * at[i, 0] - math.sin(th) * at[i, 1]
                wy = py + math.sin(th) * at[i, 0] + math.cos(th) * at[i, 1]
                soft[i] = slick[i] = 0.0
                for q in range(patches.shape[0]):
                    if (wx - patches[q, 0]) ** 2 + (wy - patches[q, 1]) ** 2 < patches[q, 2] ** 2:
                        soft[i], slick[i] = patches[q, 3], patches[q, 4]
            if c[BRAKE] == 0.0 and full < 3.0:
                c[SHARED] = min(max(c[SHARED] + t * b.integral * mean, -0.9), 0.9)
        power = 0.0
        for a in range(2):
            steer(axles[a], hit(us[a], loss[m, 10 + a], sat[m, 10 + a], held, 10 + a), v, volts, b)
            steered[a] = axles[a, 2]
        fx = fy = moment = 0.0
        locked = 1.0 if c[BRAKE] > 0.0 else 0.0
        for i in range(4):
            x, y, off = at[i]
            a = angle_of(axles[i // 2, 2], x, y, b)
            rate = (axles[i // 2, 2] - true[m - 1, 4 + i // 2]) * 1000.0 if m > 0 and k % 2 == 0 else 0.0
            rate = min(max(rate, -1.0), 1.0)
            cos, sin = math.cos(a), math.sin(a)
            vx, vy = v - r * y, side + r * x
            along, across = vx * cos + vy * sin - (r + rate) * off, vy * cos - vx * sin
            torque = motor(w[i], parts[i], hit(w[i, ASKED], loss[m, 6 + i], sat[m, 6 + i], held, 6 + i), volts, b)
            shaft = drive_line(w[i], parts[i], torque, locked, b)
            gx, gy = tyre(w[i], parts[i], along, across, load[i], soft[i], slick[i], b)
            turn(w[i], parts[i], shaft, gx, load[i], soft[i], b)
            edges(own[i], w[i, ROLLED], w[i, ROTOR] * b.radius, now, b.pitch, teeth[i], b)
            edges(hub[i], w[i, HUB], w[i, WHEEL] * b.radius, now, b.hub_pitch, teeth[i], b)
            power += abs(torque * w[i, ROTOR]) + 0.08 * b.torque * b.knee * w[i, IQ] ** 2
            bx, by = gx * cos - gy * sin, gx * sin + gy * cos
            fx, fy, moment = fx + bx, fy + by, moment + x * by - y * bx - gx * off
        hx, hy = rise_of(px, py, b)
        along, across = hx * math.cos(th) + hy * math.sin(th), hy * math.cos(th) - hx * math.sin(th)
        c[TILT] += H / 0.3 * (along - c[TILT])
        v += H * (fx / b.mass - 9.81 * along + side * r)
        side += H * (fy / b.mass - 9.81 * across - v * r)
        r += H * moment / (b.mass * (b.base**2 + b.track**2) / 10)
        th += H * r
        px, py = px + H * (v * math.cos(th) - side * math.sin(th)), py + H * (v * math.sin(th) + side * math.cos(th))
        ax, ay = ax + H / 0.15 * (fx / b.mass - ax), ay + H / 0.15 * (fy / b.mass - ay)
        loads_of(ax, ay, warps[int(abs(px + 2 * py) * 20) % warps.size], b, load)
        volts += H / 0.05 * (1.0 - b.sag * power / (4 * b.torque * b.knee) - volts)
        if k % 2 == 0:
            ref[m, :4], ref[m, 4:], given[m, :4], given[m, 4:] = refs, angles, w[:, ASKED], us
            true[m, :4], true[m, 4:], read[m] = w[:, WHEEL] * b.radius, steered, said
            second[m, :4], second[m, 4:] = seconds, steered
            done[m, :4], done[m, 4:] = w[:, IQ], axles[:, 0]
            body[m] = v, side, r, c[SPEED], bend, c[BRAKE], w[:, ROOM].min(), w[:, HEAT].max()
    return ref, true, read, second, given, done, body
