"""What `hydrostatic.py` moves: pressures, spools, axles, wheels and body, step by step."""

from __future__ import annotations

import math
from typing import NamedTuple

import numba as nb
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Build(NamedTuple):
    """What a seed draws: speeds [m/s], gains, lags [s], frequencies [rad/s], noise [m/s]."""

    top: float
    rate: float
    mass: float
    stiffness: float
    leak: float
    friction: float
    pump: float
    spool: float
    damping: float
    dead_time: int
    dead_band: float
    curve: float
    forward: float
    proportional: float
    integral: float
    noise: float
    quantum: float
    grip: float
    slope: float
    steer_rate: float
    steer_gain: float


@nb.njit(cache=True)
def slow(white: Array, a: float) -> Array:
    out, x = np.empty_like(white), 0.0
    for i in range(white.size):
        x = a * x + math.sqrt(1.0 - a * a) * white[i]
        out[i] = x
    return out


@nb.njit(cache=True)
def asked_of(v: float, w: float, speeds: Array, angles: Array, xs: Array, ys: Array, lateral: Array) -> None:
    """Speed of every wheel and angle of both axles for a motion of the body (L20 (1) with an offset of the wheel)."""
    s = 1.0 if v >= 0 else -1.0
    total = np.zeros(2)
    for i in range(4):
        vx, vy = v - w * ys[i], w * xs[i]
        a = math.atan2(s * vy, s * vx) if abs(v) > 1e-3 or abs(w) > 1e-3 else 0.0
        a = min(max(a, -0.7), 0.7)
        speeds[i] = vx * math.cos(a) + vy * math.sin(a) - w * lateral[i]
        total[i // 2] += a / 2
    angles[0], angles[1] = total[0], total[1]


@nb.njit(cache=True)
def drive(
    v_c: Array,
    w_c: Array,
    loss: Array,
    sat: Array,
    noise: Array,
    slip: Array,
    b: Build,
    xs: Array,
    ys: Array,
    lateral: Array,
) -> tuple[Array, Array, Array, Array, Array]:
    """Speeds, measured speeds and angles, commands of all valves, their openings, and the body's motion, step by step."""
    n, h = v_c.size, 0.001
    true, read, asked, opened, body = (
        np.zeros((n, 6)),
        np.zeros((n, 6)),
        np.zeros((n, 6)),
        np.zeros((n, 6)),
        np.zeros((n, 4)),
    )
    x, p, opening, moving, total, angle, steer = (
        np.zeros(4), np.zeros(4), np.zeros(4), np.zeros(4), np.zeros(4), np.zeros(2), np.zeros(2),
    )  # fmt: skip
    speeds, angles = np.zeros(4), np.zeros(2)
    v = side = r = th = px = py = 0.0
    for k in range(n):
        asked_of(v_c[k], w_c[k], speeds, angles, xs, ys, lateral)
        for a in range(2):
            e = loss[k, 4 + a]
            read[k, 4 + a] = (1 - e) * (angle[a] + noise[k, 4 + a]) + e * sat[k, 4 + a]
            u = min(max(b.steer_gain * (angles[a] - read[k, 4 + a]), -1.0), 1.0)
            asked[k, 4 + a] = u
            e = loss[k, 10 + a]
            want = (1 - e) * u + e * sat[k, 10 + a]
            steer[a] += h * 25.0 * (want - steer[a])
            opened[k, 4 + a] = steer[a]
            angle[a] = min(max(angle[a] + h * b.steer_rate * steer[a], -0.75), 0.75)
            true[k, 4 + a] = angle[a]
        need = 0.0
        for i in range(4):
            need += abs(opening[i]) * b.top
        share = min(1.0, 4.0 * 0.62 * b.pump * b.top / max(need, 1e-6))
        force = across = moment = 0.0
        for i in range(4):
            e = loss[k, i]
            y = (1 - e) * (x[i] + noise[k, i]) + e * sat[k, i]
            if b.quantum > 0:
                y = math.floor(y / b.quantum + 0.5) * b.quantum
            read[k, i] = y
            wrong = (speeds[i] - y) / b.top
            if abs(speeds[i]) > 0.01 * b.top:
                total[i] = min(max(total[i] + h * b.integral * wrong, -0.4), 0.4)
            else:
                total[i] *= 1 - 5 * h
            u = b.forward * speeds[i] / (1.25 * b.top) + b.proportional * wrong + total[i]
            if abs(speeds[i]) < 0.005 * b.top and abs(y) < 0.03 * b.top:
                u = 0.0
            asked[k, i] = min(max(u, -1.0), 1.0)
            late = asked[max(k - b.dead_time, 0), i]
            e = loss[k, 6 + i]
            want = (1 - e) * late + e * sat[k, 6 + i]
            moving[i] += h * (b.spool**2 * (want - opening[i]) - 2 * b.damping * b.spool * moving[i])
            opening[i] = min(max(opening[i] + h * moving[i], -1.0), 1.0)
            opened[k, i] = opening[i]
            size = max(abs(opening[i]) - b.dead_band, 0.0)
            flow = math.copysign(size * (1 - b.curve + b.curve * size), opening[i]) * 1.25 * b.top * share
            # Pressure by what flows in and is not taken; what is left of the pump's lets less in.
            head = math.sqrt(max(1.0 - math.copysign(p[i], p[i] * opening[i]), 0.02)) if abs(opening[i]) > 1e-4 else 1.0
            p[i] += h * (b.stiffness * (flow * head - x[i]) - b.leak * b.stiffness * 0.1 * p[i])
            p[i] = min(max(p[i], -1.3), 1.3)
            a = angle[i // 2]
            vx, vy = v - r * ys[i], side + r * xs[i]
            ground = vx * math.cos(a) + vy * math.sin(a) - r * lateral[i]
            push = b.grip * slip[k, i] * 2.2 * math.tanh((x[i] - ground) / 0.05)
            rub = b.friction * math.tanh(x[i] / 0.01) + 0.1 * x[i]
            x[i] += h * (6.0 * p[i] - push - rub) / 0.35
            true[k, i] = x[i]
            hold = -b.grip * slip[k, i] * 2.2 * math.tanh((vy * math.cos(a) - vx * math.sin(a)) / 0.05)
            fx, fy = push * math.cos(a) - hold * math.sin(a), push * math.sin(a) + hold * math.cos(a)
            force += fx
            across += fy
            moment += xs[i] * fy - ys[i] * fx - push * lateral[i]
        hill = b.slope * math.sin(2 * math.pi * k * h / 53.0) * 9.81
        v += h * (force / b.mass / 4 - 0.15 * v - hill + side * r)
        side += h * (across / b.mass / 4 - v * r)
        r += h * (moment / b.mass / 4 - 2.0 * r)
        th += h * r
        px += h * v * math.cos(th)
        py += h * v * math.sin(th)
        body[k, 0], body[k, 1], body[k, 2], body[k, 3] = v, r, px, py
    return true, read, asked, opened, body
