"""What `closed_circuit.py` moves: a pump per wheel in a closed circuit on one engine, motors of two displacements, tyres, steering, body.

Flow is set by the pumps' swash plates, not by valves: a pump at rest blocks its wheel hydraulically, until a relief opens.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numba as nb
import numpy as np
from electric_physics import dry
from electrohydraulic_physics import hit, places, refs_of
from numpy.typing import NDArray

Array = NDArray[np.float64]
H = 0.0005
#: State of a wheel: control spool, swash, pressures of both lines [Pa], speed [rad/s], way [rad], tyre's deflections [m],
#: integral of its law, command, pulses at the last count, filtered speed.
SPOOL, SWASH, PA, PB, TURN, ROLLED, ZX, ZY, TOTAL, ASKED, COUNT, SMOOTH = range(12)
#: What differs between wheels: radius [m], dead band, gain forward, gain backward, leakage, friction, zero of the spool.
RADIUS, DEAD, PLUS, MINUS, LEAK, RUB, ZERO = range(7)


class Build(NamedTuple):
    """What a seed draws, in SI units; `flow`: of one pump at full swash."""

    top: float
    mass: float
    load: float
    height: float
    cg: float
    radius: float
    lateral: float
    base: float
    track: float
    middle: float
    inertia: float
    motor: float
    ratio: float
    flow: float
    volume: float
    most: float
    charge: float
    leakage: float
    heat: float
    friction: float
    lag: float
    swing: float
    rate: float
    dead: float
    hysteresis: float
    known: float
    power: float
    droop: float
    forward: float
    proportional: float
    integral: float
    slew: float
    ramp: float
    teeth: float
    cycle: int
    grip: float
    stiffness: float
    relaxation: float
    roll: float
    hill: float
    waves: float
    steer_rate: float
    steer_gain: float
    steer_dead: float
    asymmetry: float


@nb.njit(cache=True)
def pump(w: Array, part: Array, want: float, engine: float, oil: float, ratio: float, b: Build) -> tuple[float, float]:
    """Move control spool, swash plate and both lines; return the motor's torque [N·m] and the power taken [W]."""
    w[SPOOL] += H / b.lag * (min(max(want + part[ZERO] - w[SPOOL], -1.0), 1.0))
    size = max(abs(w[SPOOL]) - part[DEAD], 0.0) / (1.0 - part[DEAD])
    goal = math.copysign(size * (part[PLUS] if w[SPOOL] > 0 else part[MINUS]), w[SPOOL])
    across = w[PA] - w[PB]
    over = max(across * math.copysign(1.0, goal) - 0.9 * b.most, 0.0) / (0.1 * b.most)  # pressure override
    goal *= 1.0 - min(over, 1.0)
    if abs(goal - w[SWASH]) > b.hysteresis:
        move = goal - math.copysign(b.hysteresis, goal - w[SWASH]) - w[SWASH]
        w[SWASH] += min(max(H / b.swing * move, -b.rate * H), b.rate * H)
    disp, q = b.motor * ratio, b.flow * w[SWASH] * engine
    leak = b.leakage * part[LEAK] * math.exp(b.heat * (oil - 45.0))
    stiff = 0.9e9 / b.volume
    net = q - disp * w[TURN] - leak * across
    case = 0.3 * leak
    relief = b.flow / (0.03 * b.most)
    over_a, over_b = max(w[PA] - b.most, 0.0), max(w[PB] - b.most, 0.0)
    w[PA] = max(w[PA] + H * stiff * (net - case * w[PA] - relief * (over_a - over_b)), b.charge)
    w[PB] = max(w[PB] + H * stiff * (-net - case * w[PB] + relief * (over_a - over_b)), b.charge)
    return disp * (w[PA] - w[PB]), q * across


@nb.njit(cache=True)
def tyre(w: Array, part: Array, along: float, across: float, load: float, grip: float, b: Build) -> tuple[float, float]:
    """Forces of a tyre [N], forward and left, brush model with relaxation; its contact moves by `along`, `across` [m/s]."""
    rim = w[TURN] * part[RADIUS]
    slip, roll, end = rim - along, abs(rim) / b.relaxation, 1.5 * b.relaxation
    w[ZX] = min(max(w[ZX] + H * (slip - roll * w[ZX]), -end), end)
    w[ZY] = min(max(w[ZY] + H * (-across - roll * w[ZY]), -end), end)
    kx, ky = w[ZX] / b.relaxation + 0.03 * slip, w[ZY] / b.relaxation - 0.03 * across
    size = math.hypot(kx, ky)
    if size < 1e-9:
        return 0.0, 0.0
    force = load * grip * math.tanh(b.stiffness * size / grip) / size
    return force * kx, 0.8 * force * ky


@nb.njit(cache=True)
def law(w: Array, ref: float, y: float, ratio: float, room: float, rest: bool, b: Build) -> None:
    """Command of a pump: feed-forward by displacement, PI, dead band made up for, slew limit, anti-stall `room`."""
    t, wrong = b.cycle * H, (ref - y) / b.top
    line = b.forward * ref / b.radius * b.motor * ratio / b.flow + b.proportional * wrong + w[TOTAL]
    u = (line + b.known * b.dead * min(max(line / 0.02, -1.0), 1.0)) * room
    given = min(max(u, w[ASKED] - b.slew * t, -1.0), w[ASKED] + b.slew * t, 1.0)
    if abs(u - given) < 1e-9:
        w[TOTAL] = min(max(w[TOTAL] + t * b.integral * wrong, -0.3), 0.3)
    if rest:
        w[TOTAL] = given = 0.0
    w[ASKED] = math.floor(given * 500 + 0.5) / 500


@nb.njit(cache=True)
def drive(
    asked_v: Array, asked_angle: Array, loss: Array, sat: Array, noise: Array, loaded: Array, field: Array, parts: Array,
    oil: float, b: Build,
) -> tuple[Array, Array, Array, Array, Array, Array]:  # fmt: skip
    """References, true values, measured values, commands, openings (n, 6) and body (v, side, r, asked v, curvature, engine, max p, oil, ratio)."""
    n = asked_v.size
    ref, true, read, given, done = (
        np.zeros((n, 6)),
        np.zeros((n, 6)),
        np.zeros((n, 6)),
        np.zeros((n, 6)),
        np.zeros((n, 6)),
    )
    body, w, held, at = np.zeros((n, 9)), np.zeros((4, 12)), np.zeros(12), places(b)
    w[:, PA] = w[:, PB] = b.charge
    angles, turning, rod, rod_v, spool, us, rates = (
        np.zeros(2),
        np.zeros(2),
        np.zeros(2),
        np.zeros(2),
        np.zeros(2),
        np.zeros(2),
        np.zeros(2),
    )
    refs, said, load = np.zeros(4), np.zeros(6), np.full(4, b.mass * 9.81 / 4)
    v = side = r = th = px = py = slow_v = ax = ay = quiet = bend = 0.0
    engine, ratio, low = 1.0, 1.0, True
    for k in range(2 * n):
        m = k // 2
        mass = b.mass + b.load * loaded[m]
        if k % b.cycle == 0:
            t = b.cycle * H
            slow_v += min(max(asked_v[m] - slow_v, -b.ramp * t), b.ramp * t)
            low = abs(slow_v) < (0.6 if low else 0.5) * b.top
            for a in range(2):
                step = min(max(asked_angle[m, a] - angles[a], -0.8 * b.steer_rate * t), 0.8 * b.steer_rate * t)
                angles[a] += step
                turning[a] = step / t
                good = math.floor((rod[a] + noise[m, a]) / 1e-3 + 0.5) * 1e-3
                said[4 + a] = hit(good, loss[m, 4 + a], sat[m, 4 + a], held, 4 + a)
                wrong = angles[a] - said[4 + a]
                line = b.steer_gain * wrong + 0.9 * turning[a] / b.steer_rate
                us[a] = (
                    line + 0.9 * b.steer_dead * min(max(line / 0.02, -1.0), 1.0)
                    if abs(wrong) > 0.006 or step != 0.0
                    else 0.0
                )
                us[a] = min(max(us[a], -1.0), 1.0)
            bend = (math.tan(angles[0]) - math.tan(angles[1])) / b.base
            refs_of(slow_v, bend, turning, angles, b, refs)
            quiet = quiet + t if slow_v == 0.0 and asked_v[m] == 0.0 else 0.0
            room = min(max((engine - 0.75) / 0.1, 0.3), 1.0)
            for i in range(4):
                pulses = math.floor(w[i, ROLLED] * b.teeth / (2 * math.pi))
                raw = (pulses - w[i, COUNT]) * 2 * math.pi * b.radius / b.teeth / t
                w[i, COUNT] = pulses
                w[i, SMOOTH] += min(t / 0.05, 1.0) * (raw - w[i, SMOOTH])
                said[i] = hit(w[i, SMOOTH], loss[m, i], sat[m, i], held, i)
                law(w[i], refs[i], said[i], 1.0 if low else b.ratio, room, quiet > 1.2, b)
        ratio += min(max((1.0 if low else b.ratio) - ratio, -H / 0.3), H / 0.3)
        for a in range(2):
            want = hit(us[a], loss[m, 10 + a], sat[m, 10 + a], held, 10 + a)
            spool[a] += H / 0.04 * (want - spool[a])
            size = max(abs(spool[a]) - b.steer_dead, 0.0) / (1.0 - b.steer_dead)
            hand = math.copysign(1.0, spool[a])
            rates[a] = hand * b.steer_rate * (1.0 + hand * b.asymmetry) * size * (1.0 - 0.15 * math.exp(-abs(v) / 0.2))
        share = min(
            1.0, 1.5 * b.steer_rate * engine / max(abs(rates[0]) + abs(rates[1]), 1e-6)
        )  # priority valve's flow
        taken = fx = fy = moment = 0.0
        for a in range(2):
            rod_v[a] += H / 0.05 * (rates[a] * share - rod_v[a])
            before = rod[a]
            rod[a] = min(max(rod[a] + H * rod_v[a], -0.6), 0.6)
            taken += 0.04 * b.power * abs(rod_v[a]) / b.steer_rate
            rates[a] = (rod[a] - before) / H
        for i in range(4):
            want = hit(w[i, ASKED], loss[m, 6 + i], sat[m, 6 + i], held, 6 + i)
            torque, power = pump(w[i], parts[i], want, engine, oil, ratio, b)
            taken += power
            (lx, ly, off), angle = at[i], rod[i // 2]
            c, s = math.cos(angle), math.sin(angle)
            vx, vy = v - r * ly, side + r * lx
            along, across = vx * c + vy * s - (r + rates[i // 2]) * off, vy * c - vx * s
            wx = px + math.cos(th) * lx - math.sin(th) * ly
            wy = py + math.sin(th) * lx + math.cos(th) * ly
            wet = min(max(1.4 * (math.sin(wx / 4.1 + field[0]) * math.sin(wy / 3.3 + field[1]) - 0.6), 0.0), 0.6)
            gx, gy = tyre(w[i], parts[i], along, across, load[i], b.grip * (1.0 - wet), b)
            rub = part_rub(parts[i], w[i, TURN], load[i], wet, b) + 0.04 * abs(torque)
            rub += 1.5 * b.motor * b.most if quiet > 1.2 else 0.0
            w[i, TURN] = dry(w[i, TURN], H / b.inertia * (torque - gx * parts[i, RADIUS]), H / b.inertia * rub)
            w[i, ROLLED] += H * w[i, TURN]
            bx, by = gx * c - gy * s, gx * s + gy * c
            fx, fy, moment = fx + bx, fy + by, moment + lx * by - ly * bx - gx * off
        hx, hy = (
            b.hill * math.tanh(2 * math.sin(px / b.waves + field[2])),
            0.6 * b.hill * math.sin(py / b.waves + field[3]),
        )
        v += H * (fx / mass - 9.81 * (hx * math.cos(th) + hy * math.sin(th)) + side * r)
        side += H * (fy / mass - 9.81 * (hy * math.cos(th) - hx * math.sin(th)) - v * r)
        r += H * moment / (mass * (b.base**2 + b.track**2) / 10)
        th += H * r
        px, py = px + H * (v * math.cos(th) - side * math.sin(th)), py + H * (v * math.sin(th) + side * math.cos(th))
        ax, ay = ax + H / 0.2 * (fx / mass - ax), ay + H / 0.2 * (fy / mass - ay)
        front = 0.5 + b.cg - 0.12 * loaded[m] - b.height / b.base * ax / 9.81
        left = 0.5 - b.height / b.track * ay / 9.81
        for i in range(4):
            share_y = left if i % 2 else 1.0 - left
            load[i] = mass * 9.81 * min(max((front if i < 2 else 1.0 - front) * share_y, 0.03), 0.6)
        engine += H / 0.5 * (1.0 + b.droop * (0.5 - max(taken, 0.0) / b.power) - engine)
        oil += H * (0.35 * min(max(taken, 0.0) / b.power, 1.0) - 0.001 * (oil - 20.0))
        if k % 2 == 0:
            ref[m, :4], ref[m, 4:], given[m, :4], given[m, 4:] = refs, angles, w[:, ASKED], us
            true[m, :4], true[m, 4:], read[m] = w[:, TURN] * b.radius, rod, said
            done[m, :4], done[m, 4:] = w[:, SPOOL], spool
            body[m] = v, side, r, slow_v, bend, engine, max(w[:, PA].max(), w[:, PB].max()), oil, ratio
    return ref, true, read, given, done, body


@nb.njit(cache=True)
def part_rub(part: Array, turn: float, load: float, wet: float, b: Build) -> float:
    """Friction of motor, bearings and ground [N·m], more at rest than turning."""
    slow = math.exp(-((turn / 0.1) ** 2))
    return part[RUB] * b.friction * (1.0 + 0.6 * slow) + b.roll * (1.0 + 2.0 * wet) * load * part[RADIUS]
