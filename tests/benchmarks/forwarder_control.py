"""What drives the machine of `forwarder.py`: tachos and potentiometers on converters of 12 bits, the controller's cycle, and a mission."""

from __future__ import annotations

import math

import numba as nb
import numpy as np
from electric_control import refs_of
from electric_physics import angle_of
from electrohydraulic_physics import hit, places
from forwarder_physics import (
    A_SPOOL,
    ANGLE,
    ASKED,
    COIL,
    PA,
    PB,
    POT,
    ROD,
    ROLLED,
    SCALE,
    SHIFT,
    SPOOL,
    TACHO,
    TANK,
    TOTAL,
    TURN,
    VENT,
    WAVE,
    ZERO,
    Array,
    Build,
    H,
    P,
    engine_of,
    ground,
    loads_of,
    motor,
    pump,
    roll,
    spool_of,
    steer,
    thickness,
    tyre,
)  # fmt: skip

_REST_S, _RELEASE_S, _IDLE_S = 1.5, 0.3, 3.0


@nb.njit(cache=True)
def converted(x: float, most: float) -> float:
    """A reading of a converter of 12 bits from -`most` to `most`."""
    step = most / 2048.0
    return min(max(math.floor(x / step + 0.5), -2048.0), 2047.0) * step


@nb.njit(cache=True)
def wheel_law(w: Array, ref: float, y: float, room: float, held: bool, b: Build) -> None:
    """Command of a valve: the opening that a reference takes at the margin, PI with a leak, most of the overlap jumped, anti-stall."""
    t, wrong = b.cycle * H, (ref - y) / b.top
    still = abs(ref) < 0.003 * b.top
    line = b.forward * ref / b.radius * b.motor / b.flow + b.proportional * wrong + w[TOTAL]
    if still and abs(y) < 0.03 * b.top:
        line = 0.0
        w[TOTAL] *= 1.0 - 2.0 * t
    line = min(max(line, -1.0), 1.0)
    jump, size = b.known * b.dead, abs(line) ** (1.0 / b.curve)
    u = math.copysign(jump * min(size / 0.01, 1.0) + (1.0 - jump) * size, line) * room
    given = min(max(u, w[ASKED] - b.slew * t, -1.0), w[ASKED] + b.slew * t, 1.0)
    if not still and (abs(u - given) < 1e-9 or wrong * (u - given) < 0.0):
        w[TOTAL] = min(max(w[TOTAL] + t * (b.integral * wrong - w[TOTAL] / b.leak), -b.authority), b.authority)
    if held:
        w[TOTAL] = given = 0.0
    w[ASKED] = math.floor(given * 250 + 0.5) / 250


@nb.njit(cache=True)
def steer_law(wrong: float, turning: float, busy: float, b: Build) -> float:
    """Command of a steering valve: what is missing, how fast the wanted angle turns, most of the overlap; none where it is near."""
    if busy == 0.0:
        return 0.0
    line = b.steer_gain * wrong + 0.85 * turning / b.steer_rate
    line += 0.85 * b.steer_dead * min(max(line / 0.02, -1.0), 1.0)
    return min(max(math.floor(line * 250 + 0.5) / 250, -1.0), 1.0)


@nb.njit(cache=True)
def drive(
    asked_v: Array, asked_angle: Array, mass: Array, ahead: Array, aside: Array, crane: Array, loss: Array, sat: Array,
    noise: Array, field: Array, parts: Array, b: Build,
) -> tuple[Array, ...]:  # fmt: skip
    """References, true values, what the controller has of them, commands, spools, the body and its drive, per millisecond.

    Each but the last two has a column per wheel (FR, FL, RR, RL) and axle: m/s and rad, commands and spools −1 … 1. The body's
    columns: speed, sideways speed, yaw rate, speed and curvature asked after the ramps, brake. The drive's: engine [of rated], oil
    [°C], pressure of either pump [Pa], whether either is vented. `crane`: power that it takes [of the engine's].
    """
    n, t = asked_v.size, b.cycle * H
    ref, true, read, given, done, body, source = (
        np.zeros((n, 6)), np.zeros((n, 6)), np.zeros((n, 6)), np.zeros((n, 6)), np.zeros((n, 6)), np.zeros((n, 6)),
        np.zeros((n, 6)),
    )  # fmt: skip
    w, x, c, s, at = np.zeros((4, 11)), np.zeros((2, 6)), np.zeros((2, 3)), np.zeros(2), places(b)
    w[:, PA] = w[:, PB] = c[:, P] = TANK
    said, us, refs, angles, turning, busy, held = (
        np.zeros(6), np.zeros(2), np.zeros(4), np.zeros(2), np.zeros(2), np.zeros(2), np.zeros(12),
    )  # fmt: skip
    load, soft, rise, cross, before = np.full(4, mass[0] * 9.81 / 4), np.zeros(4), np.zeros(4), np.zeros(4), np.zeros(2)
    v = side = r = th = px = py = ax = ay = bend = slow_v = resting = 0.0
    brake, released = 1.0, 0.0
    s[:] = b.idle, b.cold
    for k in range(2 * n):
        m = k // 2
        warm = 1.0 + b.tacho_drift * (s[1] - b.cold) / 20.0
        for i in range(4):  # tachos whose poles are unequal, behind filters
            turned = w[i, TURN] * b.radius * (1.0 + parts[i, WAVE] * math.sin(8.0 * w[i, ROLLED]))
            w[i, TACHO] += H / b.filter * (parts[i, SCALE] * warm * turned + parts[i, SHIFT] * b.top - w[i, TACHO])
        for a in range(2):
            x[a, POT] += H / b.pot * (x[a, ROD] - x[a, POT])
        if k % b.cycle == 0:
            for i in range(4):
                raw = converted(w[i, TACHO] + noise[m, i], b.step)
                said[i] = hit(raw if abs(raw) > 0.004 * b.top else 0.0, loss[m, i], sat[m, i], held, i)
            resting = resting + t if asked_v[m] == 0.0 and slow_v == 0.0 else 0.0
            if resting > _REST_S:
                brake, released = 1.0, 0.0
            elif asked_v[m] != 0.0:
                brake, released = 0.0, released + t
            demand = asked_v[m] if brake == 0.0 and released > _RELEASE_S else 0.0
            limit = b.ramp if abs(demand) > abs(slow_v) and demand * slow_v >= 0.0 else b.brake_ramp
            slow_v += min(max(demand - slow_v, -limit * t), limit * t)
            for a in range(2):
                said[4 + a] = hit(
                    converted(x[a, POT] + noise[m, 4 + a], 0.8), loss[m, 4 + a], sat[m, 4 + a], held, 4 + a
                )
                step = min(max(asked_angle[m, a] - angles[a], -0.6 * b.steer_rate * t), 0.6 * b.steer_rate * t)
                angles[a] += step
                turning[a] = step / t
                wrong = angles[a] - said[4 + a]
                if abs(wrong) > b.tolerance or step != 0.0:
                    busy[a] = 1.0
                elif abs(wrong) < 0.5 * b.tolerance:
                    busy[a] = 0.0
                us[a] = steer_law(wrong, turning[a], busy[a], b)
            bend = (math.tan(angles[0]) - math.tan(angles[1])) / b.base
            refs_of(slow_v, bend, turning, angles, b, refs)
            room = min(max((s[0] - 0.6) / 0.15, 0.4), 1.0)
            for i in range(4):
                wheel_law(w[i], refs[i], said[i], room, brake > 0.0, b)
                wx = px + math.cos(th) * at[i, 0] - math.sin(th) * at[i, 1]
                wy = py + math.sin(th) * at[i, 0] + math.cos(th) * at[i, 1]
                rise[i], cross[i], soft[i] = ground(wx, wy, field, b)
        steering = fx = fy = moment = power = 0.0
        for a in range(2):
            before[a] = x[a, ANGLE]
            want = hit(us[a], loss[m, 10 + a], sat[m, 10 + a], held, 10 + a)
            steering += steer(x[a], a, want, v, s[0], load[2 * a] + load[2 * a + 1], b)
        thick = thickness(s[1], b)
        for a in range(2):
            taken = growth = 0.0
            most = TANK
            for i in (2 * a, 2 * a + 1):
                want = hit(w[i, ASKED], loss[m, 6 + i], sat[m, 6 + i], held, 6 + i)
                w[i, COIL], w[i, SPOOL] = spool_of(w[i, COIL], w[i, SPOOL], want, parts[i, ZERO], b)
                torque, q, g, asks = motor(w[i], parts[i], c[a, P], thick, b)
                taken, growth, most = taken + q, growth + g, max(most, asks)
                lx, ly, off = at[i]
                angle = angle_of(x[a, ANGLE], lx, ly, b)
                rate = (x[a, ANGLE] - before[a]) / H
                cos, sin = math.cos(angle), math.sin(angle)
                vx, vy = v - r * ly, side + r * lx
                along, across = vx * cos + vy * sin - (r + rate) * off, vy * cos - vx * sin
                gx, gy = tyre(w[i], parts[i], along, across, load[i], soft[i], b)
                roll(w[i], parts[i], torque, gx, load[i] * (1.0 + 1.5 * soft[i]), brake, b)
                hx, hy = rise[i] * load[i], cross[i] * load[i]  # the ground's normal leans
                bx = gx * cos - gy * sin - hx * math.cos(th) - hy * math.sin(th)
                by = gx * sin + gy * cos + hx * math.sin(th) - hy * math.cos(th)
                fx, fy, moment = fx + bx, fy + by, moment + lx * by - ly * bx - gx * off
            made = max(b.pump * s[0] - (steering if a == 0 else 0.0), 0.0)  # steering is served first
            power += pump(c[a], most, made, taken, growth, thick, b)
        engine_of(s, b.idle if resting > _IDLE_S and crane[m] == 0.0 else 1.0, power + crane[m] * b.power, b)
        now = mass[m]
        v += H * (fx / now + side * r)
        side += H * (fy / now - v * r)
        r += H * moment / (now * (b.base**2 + b.track**2) / 10)
        th += H * r
        px, py = px + H * (v * math.cos(th) - side * math.sin(th)), py + H * (v * math.sin(th) + side * math.cos(th))
        ax, ay = ax + H / 0.25 * (fx / now - ax), ay + H / 0.25 * (fy / now - ay)
        up, over = 9.81 * rise.mean(), 9.81 * cross.mean()
        along, across = ax + up * math.cos(th) + over * math.sin(th), ay - up * math.sin(th) + over * math.cos(th)
        loads_of(now, along, across, ahead[m], aside[m], b, load)
        if k % 2 == 0:
            ref[m, :4], ref[m, 4:], given[m, :4], given[m, 4:] = refs, angles, w[:, ASKED], us
            true[m, :4], true[m, 4:], read[m] = w[:, TURN] * b.radius, x[:, ANGLE], said
            done[m, :4], done[m, 4:] = w[:, SPOOL], x[:, A_SPOOL]
            body[m] = v, side, r, slow_v, bend, brake
            source[m] = s[0], s[1], c[0, P], c[1, P], c[0, VENT], c[1, VENT]
    return ref, true, read, given, done, body, source
