"""What `electrohydraulic.py` moves: pump, valves, motors, tyres, steering, body and the controller's cycle, in SI units, step by step."""

from __future__ import annotations

import math
from typing import NamedTuple

import numba as nb
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
H = 0.0005
SPOOL, SPEED, PA, PB, TURN, ROLLED, ZX, ZY, TOTAL, ASKED, WANTED = range(11)
COUNT, EDGE, EDGE_T, SEEN, SEEN_T, SHOWN = range(6)
LEAK, RADIUS, FLOW, OVERLAP, RUB, QUICK, ZERO = range(7)


class Build(NamedTuple):
    """What a seed draws; `parts` has a row per wheel (leak, radius, flow gain, overlap, friction, spool's frequency, zero)."""

    top: float
    full: float
    cycle: int
    mass: float
    height: float
    cg: float
    radius: float
    lateral: float
    motor: float
    inertia: float
    volume: float
    relief: float
    supply: float
    pump: float
    band: float
    pump_lag: float
    store: float
    droop: float
    force: float
    rate: float
    overlap: float
    known: float
    ramp: float
    slew: float
    forward: float
    proportional: float
    integral: float
    authority: float
    pitch: float
    edges: int
    uneven: float
    stiffness: float
    grip: float
    roll: float
    hills: float
    waves: float
    ackermann: float
    steer_rate: float
    steer_gain: float
    steer_lag: float
    steer_overlap: float
    steer_known: float
    tolerance: float
    play: float
    inside: bool
    middle: float
    base: float
    track: float


@nb.njit(cache=True)
def orifice(gain: float, drop: float) -> float:
    """Flow of an orifice [m³/s], linear below a bar."""
    size = abs(drop)
    return gain * drop / math.sqrt(size) if size > 1e5 else gain * drop / 316.2


@nb.njit(cache=True)
def opening_of(x: float, overlap: float) -> float:
    """Metering edge over spool position: overlap, then a progressive notch."""
    size = max(abs(x) - overlap, 0.0) / (1.0 - overlap)
    return math.copysign(size * (0.85 + 0.15 * size), x)


@nb.njit(cache=True)
def motor(w: Array, part: Array, want: float, supply: float, b: Build) -> float:
    """Move a wheel's spool and its motor's two pressures; return the flow that it takes from the pump."""
    drop = (supply - (w[PA] if w[SPOOL] > 0 else w[PB])) / b.supply
    goal = want + part[ZERO] - b.force * opening_of(w[SPOOL], part[OVERLAP]) * drop
    f = part[QUICK]
    w[SPEED] += H * (f * f * (goal - w[SPOOL]) - 1.5 * f * w[SPEED])
    w[SPEED] = min(max(w[SPEED], -b.rate), b.rate)
    w[SPOOL] = min(max(w[SPOOL] + H * w[SPEED], -1.0), 1.0)
    g = opening_of(w[SPOOL], part[OVERLAP])
    k = part[FLOW] * abs(g)
    if g > 0:
        qa, qb, taken = orifice(k, supply - w[PA]), -orifice(k, w[PB]), orifice(k, supply - w[PA])
    else:
        qa, qb, taken = -orifice(k, w[PA]), orifice(k, supply - w[PB]), orifice(k, supply - w[PB])
    across = w[PA] - w[PB]
    leak = part[LEAK] * across
    if abs(across) > b.relief:
        leak += (across - math.copysign(b.relief, across)) * part[FLOW] * 1.5e-3
    swept, soft = b.motor * w[TURN], 0.8e9 / b.volume
    w[PA] = max(w[PA] + H * soft * (qa - swept - leak - 0.2 * part[LEAK] * w[PA]), 0.0)
    w[PB] = max(w[PB] + H * soft * (qb + swept + leak - 0.2 * part[LEAK] * w[PB]), 0.0)
    return taken


@nb.njit(cache=True)
def tyre(w: Array, part: Array, along: float, across: float, load: float, soft: float, b: Build) -> tuple[float, float]:
    """Forces of an elastic tyre that relaxes as it rolls [N], forward and to the left of the wheel; `soft`: 0 firm, 1 soft ground."""
    slip, side = w[TURN] * part[RADIUS] - along, -across
    roll, length = abs(w[TURN] * part[RADIUS]), 0.35
    stiff = b.stiffness * load * (1 - 0.6 * soft) / length
    w[ZX] += H * (slip - roll / length * w[ZX])
    w[ZY] += H * (side - roll / length * w[ZY])
    fx, fy = stiff * (w[ZX] + 0.03 * slip), 0.8 * stiff * (w[ZY] + 0.03 * side)
    most = b.grip * load * (1 - 0.45 * soft)
    size = math.hypot(fx, fy) / most
    if size > 2.0:
        w[ZX], w[ZY] = w[ZX] * 2.0 / size, w[ZY] * 2.0 / size
    scale = math.tanh(size) / size if size > 1e-6 else 1.0
    return fx * scale, fy * scale


@nb.njit(cache=True)
def encoder(e: Array, rolled: float, speed: float, now: float, teeth: Array, b: Build) -> None:
    """Note the last edge that passed, at its time within the step; edges stand a little unevenly."""
    place = rolled / b.pitch
    k = math.floor(place)
    if k != e[COUNT]:
        e[EDGE] = k if k > e[COUNT] else k + 1
        late = (place - e[EDGE] - b.uneven * teeth[int(e[EDGE]) % teeth.size]) * b.pitch
        e[EDGE_T] = now - (late / speed if abs(speed) > 1e-3 else 0.0)
        e[COUNT] = k


@nb.njit(cache=True)
def shown(e: Array, now: float, b: Build) -> float:
    """Speed by the time between edges; where none came, no more than the waiting allows, and 0 after half a second."""
    if e[EDGE] != e[SEEN] and e[EDGE_T] > e[SEEN_T] + 1e-4:
        e[SHOWN] = (e[EDGE] - e[SEEN]) * b.pitch / (e[EDGE_T] - e[SEEN_T])
        e[SEEN], e[SEEN_T] = e[EDGE], e[EDGE_T]
    else:
        waited = now - e[SEEN_T]
        most = b.pitch / max(waited, 1e-3) if waited < 0.5 else 0.0
        e[SHOWN] = math.copysign(min(abs(e[SHOWN]), most), e[SHOWN])
        if waited >= 0.5:
            e[SEEN], e[SEEN_T] = e[EDGE], now - 0.5
    return float(e[SHOWN])


@nb.njit(cache=True)
def law(w: Array, ref: float, y: float, resting: bool, b: Build) -> float:
    """Command of a wheel's valve: feed-forward, PI with back-calculation, overlap made up for, slew limit."""
    t = b.cycle * H
    wrong = ref - y
    line = b.forward * ref / b.full + b.proportional * wrong + w[TOTAL]
    u = line + b.known * b.overlap * min(max(line / 0.015, -1.0), 1.0)
    given = min(max(u, w[ASKED] - b.slew * t, -1.0), w[ASKED] + b.slew * t, 1.0)
    if resting:
        w[TOTAL], given = 0.0, 0.0
    else:
        w[TOTAL] += t * (b.integral * wrong + 2.0 * (given - u))
        w[TOTAL] = min(max(w[TOTAL], -b.authority), b.authority)
    w[ASKED] = given
    return given


@nb.njit(cache=True)
def hit(good: float, e: float, sat: float, held: Array, i: int) -> float:
    """L16 (4) and (8): (1 − ε)·good + ε·sat; a sat of NaN is what was there at onset."""
    if e == 0.0:
        held[i] = good
        return good
    return (1 - e) * good + e * (held[i] if math.isnan(sat) else sat)


@nb.njit(cache=True)
def places(b: Build) -> Array:
    """Where the wheels' joints are, and their offsets [m], shape (4, 3); order FR, FL, RR, RL."""
    out = np.empty((4, 3))
    for i in range(4):
        side = -1.0 if i % 2 == 0 else 1.0
        out[i] = (b.base / 2 if i < 2 else -b.base / 2), side * b.track / 2, side * b.lateral
    return out


@nb.njit(cache=True)
def refs_of(v: float, bend: float, turning: Array, angle: Array, b: Build, out: Array) -> None:
    """Speed of every wheel [m/s] for a speed and curvature of the body, angles of the axles and their rates."""
    w, at = v * bend, places(b)
    for i in range(4):
        a, (x, y, off) = angle[i // 2], at[i]
        out[i] = (v - w * y) * math.cos(a) + w * (x - b.middle) * math.sin(a) - (w + turning[i // 2]) * off


@nb.njit(cache=True)
def drive(
    asked_v: Array, asked_bend: Array, asked_angle: Array, loss: Array, sat: Array, noise: Array, teeth: Array, soft_at: Array,
    parts: Array, b: Build,
) -> tuple[Array, Array, Array, Array, Array, Array]:  # fmt: skip
    """References, true values, measured values, commands and openings as the controller's cycle has them, and the body, per ms."""
    n = asked_v.size
    ref, true, read, given, opened, body = (
        np.zeros((n, 6)), np.zeros((n, 6)), np.zeros((n, 6)), np.zeros((n, 6)), np.zeros((n, 6)), np.zeros((n, 5)),
    )  # fmt: skip
    w, e, held, ground, stop = np.zeros((4, 11)), np.zeros((4, 6)), np.zeros(12), np.zeros(4), np.zeros(4)
    speeds, angles, turning, angle, rod, rod_v, spool, said, us = (
        np.zeros(4), np.zeros(2), np.zeros(2), np.zeros(2), np.zeros(2), np.zeros(2), np.zeros(2), np.zeros(6), np.zeros(2),
    )  # fmt: skip
    steering, rates, load, at = np.zeros(2), np.zeros(2), np.full(4, b.mass * 9.81 / 4), places(b)
    v = side = r = th = px = py = slow_v = fx_m = fy_m = 0.0
    seen, at_spool = np.zeros(6), np.zeros(6)
    supply, swash, engine, quiet = b.supply, 0.2, 1.0, 0.0
    for i in range(4):
        w[i, PA] = w[i, PB] = 0.3 * b.supply
    for k in range(2 * n):
        m, now = k // 2, k * H
        if k % b.cycle == 0:
            t = b.cycle * H
            slow_v += min(max(asked_v[m] - slow_v, -b.ramp * t), b.ramp * t)
            calm = True
            for a in range(2):
                step = min(max(asked_angle[m, a] - angles[a], -0.8 * b.steer_rate * t), 0.8 * b.steer_rate * t)
                angles[a] += step
                turning[a] = step / t
                good = (rod[a] if b.inside else angle[a]) + noise[m, 4 + a]
                said[4 + a] = hit(math.floor(good / 5e-4 + 0.5) * 5e-4, loss[m, 4 + a], sat[m, 4 + a], held, 4 + a)
                wrong = angles[a] - said[4 + a]
                if abs(wrong) > b.tolerance or step != 0.0:
                    steering[a] = 1.0
                elif abs(wrong) < 0.3 * b.tolerance:
                    steering[a] = 0.0
                line = b.steer_gain * wrong + turning[a] / b.steer_rate
                lift = b.steer_known * b.steer_overlap * min(max(line / 0.02, -1.0), 1.0)
                us[a] = steering[a] * min(max(line + lift, -1.0), 1.0)
                calm = calm and steering[a] == 0.0
            refs_of(slow_v, asked_bend[m], turning, angles, b, speeds)
            seen[:4], seen[4:], at_spool[:4], at_spool[4:] = w[:, TURN] * b.radius, angle, w[:, SPOOL], spool
            for i in range(4):
                calm = calm and abs(speeds[i]) < 0.005 * b.top
            quiet = quiet + t if calm else 0.0
            for i in range(4):
                y = hit(shown(e[i], now, b), loss[m, i], sat[m, i], held, i)
                said[i] = y
                law(w[i], speeds[i], y, quiet > 0.6, b)
                ground[i] = 0.0
                ux, uy = math.cos(th), math.sin(th)
                lx, ly = at[i, 0], at[i, 1]
                wx, wy = px + ux * lx - uy * ly, py + uy * lx + ux * ly
                for q in range(soft_at.shape[0]):
                    if (wx - soft_at[q, 0]) ** 2 + (wy - soft_at[q, 1]) ** 2 < soft_at[q, 2] ** 2:
                        ground[i] = soft_at[q, 3]
        used = 0.0
        for a in range(2):
            want = hit(us[a], loss[m, 10 + a], sat[m, 10 + a], held, 10 + a)
            spool[a] += min(max((want - spool[a]) * H / b.steer_lag, -b.rate * H), b.rate * H)
            scrub = 0.15 + 0.25 * math.exp(-abs(v) / 0.15)
            head = math.sqrt(max(supply / b.supply - scrub, 0.0) / 0.85)
            rates[a] = b.steer_rate * opening_of(spool[a], b.steer_overlap) * head
        share = min(1.0, 1.3 * b.steer_rate / max(abs(rates[0]) + abs(rates[1]), 1e-6))
        for a in range(2):
            rod_v[a] += H * (rates[a] * share - rod_v[a]) / 0.05
            rod[a] = min(max(rod[a] + H * rod_v[a], -0.6), 0.6)
            before = angle[a]
            angle[a] = min(max(angle[a], rod[a] - b.play), rod[a] + b.play)
            stop[a] = (angle[a] - before) / H
            used += abs(rod_v[a]) * 0.25 * b.pump
        fx = fy = moment = 0.0
        for i in range(4):
            want = hit(w[i, ASKED], loss[m, 6 + i], sat[m, 6 + i], held, 6 + i)
            used += motor(w[i], parts[i], want, supply, b)
            lx, ly, off, a = at[i, 0], at[i, 1], at[i, 2], angle[i // 2]
            own = math.atan(math.tan(a) / (1 - ly * math.tan(a) / lx))
            c, s = math.cos(a + b.ackermann * (own - a)), math.sin(a + b.ackermann * (own - a))
            vx, vy = v - r * ly, side + r * lx
            along, across = vx * c + vy * s - (r + stop[i // 2]) * off, vy * c - vx * s
            gx, gy = tyre(w[i], parts[i], along, across, load[i], ground[i], b)
            rub = parts[i, RUB] * (1 + 0.05 * abs(w[i, TURN])) + b.roll * (1 + 3 * ground[i]) * load[i] * b.radius
            rub *= math.tanh(w[i, TURN] / 0.05)
            w[i, TURN] += H / b.inertia * (b.motor * (w[i, PA] - w[i, PB]) - rub - gx * parts[i, RADIUS])
            if quiet > 0.6:
                w[i, TURN] /= 1 + 200 * H
            w[i, ROLLED] += H * w[i, TURN] * b.radius
            encoder(e[i], w[i, ROLLED], w[i, TURN] * b.radius, now, teeth[i], b)
            bx, by = gx * c - gy * s, gx * s + gy * c
            fx, fy, moment = fx + bx, fy + by, moment + lx * by - ly * bx - gx * off
        hx = b.hills * math.cos(px / b.waves + 1.0)
        hy = b.hills * math.cos(1.3 * py / b.waves + 2.0)
        v += H * (fx / b.mass - 9.81 * (hx * math.cos(th) + hy * math.sin(th)) + side * r)
        side += H * (fy / b.mass - 9.81 * (hy * math.cos(th) - hx * math.sin(th)) - v * r)
        r += H * moment / (b.mass * (b.base**2 + b.track**2) / 9)
        th += H * r
        px, py = px + H * (v * math.cos(th) - side * math.sin(th)), py + H * (v * math.sin(th) + side * math.cos(th))
        fx_m, fy_m = fx_m + H / 0.15 * (fx - fx_m), fy_m + H / 0.15 * (fy - fy_m)
        ahead = 0.5 + b.cg - b.height / b.base * fx_m / b.mass / 9.81
        left = 0.5 - b.height / b.track * fy_m / b.mass / 9.81
        for i in range(4):
            share_x, share_y = (ahead if i < 2 else 1 - ahead), (left if i % 2 else 1 - left)
            load[i] = b.mass * 9.81 * min(max(share_x * share_y, 0.03), 0.6)
        flow = b.pump * swash * engine
        supply = max(supply + H / b.store * (flow - used - 0.02 * b.pump * supply / b.supply), 1e5)
        swash += H / b.pump_lag * (min(max((b.supply + 0.5 * b.band - supply) / b.band, 0.02), 1.0) - swash)
        engine += H / 0.4 * (1 - b.droop * supply * flow / (b.supply * b.pump) - engine)
        if k % 2 == 0:
            ref[m, :4], ref[m, 4:], given[m, :4], given[m, 4:] = speeds, angles, w[:, ASKED], us
            true[m], read[m], opened[m] = seen, said, at_spool
            body[m] = v, side, r, supply, ground.max()
    return ref, true, read, given, opened, body
