"""What drives the machine of `flow_sharing.py`: pole wheels timed by their period, the controller's cycle, and a mission step by step."""

from __future__ import annotations

import math

import numba as nb
import numpy as np
from electric_control import refs_of
from electric_physics import angle_of
from electrohydraulic_physics import hit, places
from flow_sharing_physics import (
    A_SPOOL,
    ANGLE,
    ASKED,
    COIL,
    ENGINE,
    OIL,
    PRESSURE,
    RANGE,
    ROD,
    ROLLED,
    SEAT,
    SHARE,
    SPOOL,
    TOTAL,
    TURN,
    ZERO,
    Array,
    Build,
    H,
    edge_of,
    ground_of,
    loads_of,
    motor,
    rise_of,
    spool_of,
    steer,
    supply_of,
    turn,
    tyre,
)  # fmt: skip

#: State of a pole wheel: edges passed, time of the last, time between the last two, way of the last, how many went that way,
#: direction shown, lag-filtered speed, speed that is on the bus.
COUNT, AT, PERIOD, WAY, RUN, SIGN, SMOOTH, SENT = range(8)
_REST_S, _RELEASE_S = 1.0, 0.25


@nb.njit(cache=True)
def pole(e: Array, turned: float, speed: float, now: float, b: Build) -> None:
    """Note the edge that passed in a step, in ticks of the timer; the direction is known after three edges of one way."""
    place = b.teeth * turned / (2 * math.pi) + b.eccentric * math.sin(turned)
    k = math.floor(place)
    if k == e[COUNT]:
        return
    way, rate = (1.0 if k > e[COUNT] else -1.0), abs(b.teeth * speed / (2 * math.pi))
    beyond = place - k if way > 0 else k + 1 - place
    at = math.floor((now - min(beyond / max(rate, 1e-6), H)) / b.tick) * b.tick
    e[RUN] = e[RUN] + 1 if way == e[WAY] else 0
    e[PERIOD] = max(at - e[AT], b.tick) if e[RUN] >= 1 else 1e3
    if e[RUN] >= 2:
        e[SIGN] = way
    e[WAY], e[AT], e[COUNT] = way, at, k


@nb.njit(cache=True)
def shown(e: Array, now: float, b: Build) -> float:
    """Speed [m/s] by the last period, or by the silence since where that is longer; 0 after the timeout."""
    silent = now - e[AT]
    if silent > b.timeout:
        return 0.0
    return float(e[SIGN] * 2 * math.pi * b.radius / b.teeth / max(e[PERIOD], silent))


@nb.njit(cache=True)
def wheel_law(w: Array, ref: float, y: float, ratio: float, held: bool, b: Build) -> None:
    """Command of a valve: the flow that the reference takes, PI on the speed, the valve's curve the other way round.

    The integral stands still where the command is at a limit that it pushes against.
    """
    t, wrong = b.cycle * H, (ref - y) / b.top
    line = b.forward * ref / b.radius * b.small * ratio / b.flow + b.proportional * wrong + w[TOTAL]
    still = abs(ref) < 0.004 * b.top and abs(y) < 0.03 * b.top
    if still:
        line = 0.0
    jump, size = b.known * b.overlap, min(abs(line), 1.0)
    u = math.copysign(jump * min(size / 0.01, 1.0) + (1.0 - jump) * size ** (1.0 / b.known_progress), line)
    given = min(max(u, w[ASKED] - b.slew * t, -1.0), w[ASKED] + b.slew * t, 1.0)
    if still:
        w[TOTAL] *= 1.0 - 2.0 * t
    elif (abs(given) < 1.0 and abs(u - given) < 1e-9) or wrong * (u - 0.999 * given) < 0.0:
        w[TOTAL] = min(max(w[TOTAL] + t * b.integral * wrong, -b.authority), b.authority)
    if held:
        w[TOTAL] = given = 0.0
    w[ASKED] = math.floor(given * 1000 + 0.5) / 1000


@nb.njit(cache=True)
def steer_law(wrong: float, turning: float, busy: float, b: Build) -> float:
    """Command of a steering valve: what is missing and how fast the wanted angle turns, made larger by the overlap; none at rest."""
    if busy == 0.0:
        return 0.0
    line = b.steer_gain * wrong + 0.9 * turning / b.steer_rate
    lift = 0.9 * b.steer_overlap * min(max(line / 0.02, -1.0), 1.0)
    return min(max(math.floor((line + lift) * 1000 + 0.5) / 1000, -1.0), 1.0)


@nb.njit(cache=True)
def drive(
    asked_v: Array, asked_angle: Array, loss: Array, sat: Array, noise: Array, shift: Array, field: Array, parts: Array,
    oil: float, b: Build,
) -> tuple[Array, ...]:  # fmt: skip
    """References, true values, measured ones, commands, spools, the body and its supply, per millisecond.

    Each but the last two has a column per wheel (FR, FL, RR, RL) and axle: m/s and rad, commands and spools −1 … 1. The body's
    columns: speed, sideways speed, yaw rate, speed and curvature asked after the ramps, brake, softest, slickest ground. The supply's:
    share of the flow, engine [of rated], pressure [Pa], oil [°C], displacement [of the small one].
    """
    n, t = asked_v.size, b.cycle * H
    ref, true, read, given, done, body, source = (
        np.zeros((n, 6)), np.zeros((n, 6)), np.zeros((n, 6)), np.zeros((n, 6)), np.zeros((n, 6)), np.zeros((n, 8)),
        np.zeros((n, 5)),
    )  # fmt: skip
    w, e, x, s, at = np.zeros((4, 12)), np.zeros((4, 8)), np.zeros((2, 6)), np.zeros(6), places(b)
    held, said, us, refs, angles, turning, busy = (
        np.zeros(12), np.zeros(6), np.zeros(2), np.zeros(4), np.zeros(2), np.zeros(2), np.zeros(2),
    )  # fmt: skip
    load, soft, slick, area, before = np.full(4, b.mass * 9.81 / 4), np.zeros(4), np.zeros(4), np.zeros(4), np.zeros(2)
    v = side = r = th = px = py = ax = ay = bend = slow_v = resting = steering = 0.0
    taken, head, brake, released, small = 0.0, 0.0, 1.0, 0.0, False
    s[:] = 0.01 * b.pump, b.margin, 1.0, b.engine, oil, b.ratio
    e[:, PERIOD], e[:, AT], e[:, SIGN] = 1e3, -10.0, 1.0
    for k in range(2 * n):
        m, now = k // 2, k * H
        if k % b.cycle == 0:
            for i in range(4):
                said[i] = hit(e[i, SENT], loss[m, i], sat[m, i], held, i)  # a cycle old
                e[i, SMOOTH] += (shown(e[i], now, b) - e[i, SMOOTH]) * min(1.0, t / b.reading_lag)
                e[i, SENT] = math.floor(e[i, SMOOTH] / b.quantum + 0.5) * b.quantum
            resting = resting + t if asked_v[m] == 0.0 and slow_v == 0.0 else 0.0
            if resting > _REST_S:
                brake, released = 1.0, 0.0
            elif asked_v[m] != 0.0:
                brake, released = 0.0, released + t
            demand = asked_v[m] if brake == 0.0 and released > _RELEASE_S else 0.0
            limit = b.ramp if abs(demand) > abs(slow_v) and demand * slow_v >= 0.0 else b.brake_ramp
            slow_v += min(max(demand - slow_v, -limit * t), limit * t)
            for a in range(2):
                step = min(max(asked_angle[m, a] - angles[a], -0.7 * b.steer_rate * t), 0.7 * b.steer_rate * t)
                angles[a] += step
                turning[a] = step / t
                place = (x[a, ROD] if b.inside else x[a, ANGLE]) + noise[m, a]
                said[4 + a] = hit(math.floor(place * 1000 + 0.5) / 1000, loss[m, 4 + a], sat[m, 4 + a], held, 4 + a)
                wrong = angles[a] - said[4 + a]
                if abs(wrong) > b.tolerance or step != 0.0:
                    busy[a] = 1.0
                elif abs(wrong) < 0.3 * b.tolerance:
                    busy[a] = 0.0
                us[a] = steer_law(wrong, turning[a], busy[a], b)
            bend = (math.tan(angles[0]) - math.tan(angles[1])) / b.base
            refs_of(slow_v, bend, turning, angles, b, refs)
            limit = 0.85 * b.top / b.ratio
            small = b.ratio > 1.0 and abs(slow_v) > (0.8 if small else 1.0) * limit
            for i in range(4):
                wheel_law(w[i], refs[i], said[i], 1.0 if small else b.ratio, brake > 0.0, b)
                wx = px + math.cos(th) * at[i, 0] - math.sin(th) * at[i, 1]
                wy = py + math.sin(th) * at[i, 0] + math.cos(th) * at[i, 1]
                soft[i], slick[i] = ground_of(wx, wy, field, b)
        wanted = 0.0
        for i in range(4):
            want = hit(w[i, ASKED], loss[m, 6 + i], sat[m, 6 + i], held, 6 + i)
            w[i, COIL], w[i, SEAT], w[i, SPOOL] = spool_of(w[i, COIL], w[i, SEAT], w[i, SPOOL], want, parts[i, ZERO], b)
            area[i] = edge_of(w[i, SPOOL], parts[i], b)
            wanted += abs(area[i]) * b.flow
        first = min(1.0, s[ENGINE] / b.engine)
        steering = 0.0
        for a in range(2):
            before[a] = x[a, ANGLE]
            want = hit(us[a], loss[m, 10 + a], sat[m, 10 + a], held, 10 + a)
            steering += 0.12 * b.pump * steer(x[a], a, want, v, first, b)
        supply_of(s, wanted, steering, taken, max(head, 6e6 if steering > 0.0 else 0.0), small, b)
        fx = fy = moment = taken = head = 0.0
        for i in range(4):
            lx, ly, off = at[i]
            angle = angle_of(x[i // 2, ANGLE], lx, ly, b)
            rate = (x[i // 2, ANGLE] - before[i // 2]) / H
            cos, sin = math.cos(angle), math.sin(angle)
            vx, vy = v - r * ly, side + r * lx
            along, across = vx * cos + vy * sin - (r + rate) * off, vy * cos - vx * sin
            torque, fed, own = motor(w[i], parts[i], area[i], s, b)
            taken, head = taken + fed, max(head, own)
            gx, gy = tyre(w[i], parts[i], along, across, load[i], soft[i], slick[i], b)
            turn(w[i], parts[i], torque, gx, load[i], soft[i], brake, b)
            pole(e[i], w[i, ROLLED], w[i, TURN], now, b)
            bx, by = gx * cos - gy * sin, gx * sin + gy * cos
            fx, fy, moment = fx + bx, fy + by, moment + lx * by - ly * bx - gx * off
        hx, hy = rise_of(px, py, field, b)
        v += H * (fx / b.mass - 9.81 * (hx * math.cos(th) + hy * math.sin(th)) + side * r)
        side += H * (fy / b.mass - 9.81 * (hy * math.cos(th) - hx * math.sin(th)) - v * r)
        r += H * moment / (b.mass * (b.base**2 + b.track**2) / 10)
        th += H * r
        px, py = px + H * (v * math.cos(th) - side * math.sin(th)), py + H * (v * math.sin(th) + side * math.cos(th))
        ax, ay = ax + H / 0.2 * (fx / b.mass - ax), ay + H / 0.2 * (fy / b.mass - ay)
        loads_of(ax, ay, shift[m, 0], shift[m, 1], b, load)
        if k % 2 == 0:
            ref[m, :4], ref[m, 4:], given[m, :4], given[m, 4:] = refs, angles, w[:, ASKED], us
            true[m, :4], true[m, 4:], read[m] = w[:, TURN] * b.radius, x[:, ANGLE], said
            done[m, :4], done[m, 4:] = w[:, SPOOL], x[:, A_SPOOL]
            body[m] = v, side, r, slow_v, bend, brake, soft.max(), slick.max()
            source[m] = s[SHARE], s[ENGINE], s[PRESSURE], s[OIL], s[RANGE]
    return ref, true, read, given, done, body, source
