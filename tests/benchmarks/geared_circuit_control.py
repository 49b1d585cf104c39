"""What drives the machine of `geared_circuit.py`: encoders counted in windows, frames on a bus, the controller's cycle, and a mission."""

from __future__ import annotations

import math

import numba as nb
import numpy as np
from electric_control import refs_of
from electric_physics import angle_of
from electrohydraulic_physics import hit, places
from flow_sharing_physics import tyre
from geared_circuit_physics import (
    A_SPOOL,
    ANGLE,
    ASKED,
    ENGINE,
    OIL,
    PILOT,
    RANGE,
    ROD,
    ROLLED,
    SPOOL,
    TOTAL,
    TURN,
    ZERO,
    Array,
    Build,
    H,
    circuit,
    ground_of,
    loads_of,
    machine,
    rise_of,
    roll,
    spool_of,
    steer,
)  # fmt: skip

_REST_S, _RELEASE_S = 1.5, 0.3


@nb.njit(cache=True)
def counted(counts: Array, rolled: float, b: Build) -> float:
    """Speed [m/s] by the edges of the last windows; moves the windows by one frame. `counts`: edges at the ends of the windows."""
    now = math.floor(rolled * b.radius / b.pitch)
    speed = (now - counts[b.windows - 1]) * b.pitch / (b.windows * b.frame * H)
    for j in range(b.windows - 1, 0, -1):
        counts[j] = counts[j - 1]
    counts[0] = now
    return float(speed)


@nb.njit(cache=True)
def wheel_law(w: Array, ref: float, y: float, disp: float, engine: float, held: bool, b: Build) -> None:
    """Command of a pump: the displacement that the reference takes at this engine speed and gear, PI, most of the dead band jumped."""
    t, wrong = b.cycle * H, (ref - y) / b.top
    still = abs(ref) < 0.003 * b.top
    line = b.forward * ref / b.radius * b.small * disp / b.pump / engine + b.proportional * wrong + w[TOTAL]
    if still and abs(y) < 0.04 * b.top:
        line = 0.0
        w[TOTAL] *= 1.0 - 1.5 * t
    jump, size = b.known * b.dead, min(abs(line), 1.0)
    u = math.copysign(jump * min(size / 0.008, 1.0) + (1.0 - jump) * size, line)
    given = min(max(u, w[ASKED] - b.slew * t, -1.0), w[ASKED] + b.slew * t, 1.0)
    if not still and (abs(u - given) < 1e-9 or wrong * (u - given) < 0.0):
        w[TOTAL] = min(max(w[TOTAL] + t * b.integral * wrong, -b.authority), b.authority)
    if held:
        w[TOTAL] = given = 0.0
    w[ASKED] = math.floor(given * 500 + 0.5) / 500


@nb.njit(cache=True)
def steer_law(wrong: float, turning: float, busy: float, b: Build) -> float:
    """Command of a steering valve: what is missing, how fast the wanted angle turns, some of the dead band; none where it is near."""
    if busy == 0.0:
        return 0.0
    line = b.steer_gain * wrong + 0.85 * turning / b.steer_rate
    line += 0.85 * b.steer_dead * min(max(line / 0.03, -1.0), 1.0)
    return min(max(math.floor(line * 500 + 0.5) / 500, -1.0), 1.0)


@nb.njit(cache=True)
def drive(
    asked_v: Array, asked_angle: Array, low: Array, throttle: Array, mass: Array, ahead: Array, frames: Array, loss: Array,
    sat: Array, noise: Array, field: Array, parts: Array, b: Build,
) -> tuple[Array, ...]:  # fmt: skip
    """References, true values, what the controller has of them, commands, spools, the body and its drive, per millisecond.

    Each but the last two has a column per wheel (FR, FL, RR, RL) and axle: m/s and rad, commands and spools −1 … 1. The body's
    columns: speed, sideways speed, yaw rate, speed and curvature asked after the ramps, brake. The drive's: engine [of rated], oil
    [°C], displacement [of the small one]. `frames`: whether an axle's frame arrives in a millisecond, shape (n, 2).
    """
    n, t = asked_v.size, b.cycle * H
    ref, true, read, given, done, body, source = (
        np.zeros((n, 6)), np.zeros((n, 6)), np.zeros((n, 6)), np.zeros((n, 6)), np.zeros((n, 6)), np.zeros((n, 6)),
        np.zeros((n, 3)),
    )  # fmt: skip
    w, x, s, at, counts = np.zeros((4, 12)), np.zeros((2, 5)), np.zeros(3), places(b), np.zeros((4, b.windows))
    sent, said, us, refs, angles, turning, busy, held = (
        np.zeros(6), np.zeros(6), np.zeros(2), np.zeros(4), np.zeros(2), np.zeros(2), np.zeros(2), np.zeros(12),
    )  # fmt: skip
    load, soft, slick, before = np.full(4, mass[0] * 9.81 / 4), np.zeros(4), np.zeros(4), np.zeros(2)
    v = side = r = th = px = py = ax = ay = bend = slow_v = resting = seen = 0.0
    brake, released, gear = 1.0, 0.0, True
    s[:] = throttle[0], b.cold, b.ratio
    seen = s[ENGINE]
    for k in range(2 * n):
        m = k // 2
        if k % b.frame == 0:  # sensors make their frames
            for i in range(4):
                sent[i] = counted(counts[i], w[i, ROLLED], b)
            for a in range(2):
                sent[4 + a] = math.floor((x[a, ROD] + noise[m, a]) * 800 + 0.5) / 800
        if k % 2 == 0:
            for a in range(2):
                if frames[m, a]:
                    for i in (2 * a, 2 * a + 1, 4 + a):
                        said[i] = hit(sent[i], loss[m, i], sat[m, i], held, i)
        if k % b.cycle == 0:
            seen += 0.2 * (s[ENGINE] - seen)
            resting = resting + t if asked_v[m] == 0.0 and slow_v == 0.0 else 0.0
            if resting > _REST_S:
                brake, released = 1.0, 0.0
            elif asked_v[m] != 0.0:
                brake, released = 0.0, released + t
            demand = asked_v[m] if brake == 0.0 and released > _RELEASE_S else 0.0
            limit = b.ramp if abs(demand) > abs(slow_v) and demand * slow_v >= 0.0 else b.brake_ramp
            slow_v += min(max(demand - slow_v, -limit * t), limit * t)
            gear = low[m] > 0.0 and (gear or abs(slow_v) < 0.8 * b.top / b.ratio)
            for a in range(2):
                step = min(max(asked_angle[m, a] - angles[a], -0.6 * b.steer_rate * t), 0.6 * b.steer_rate * t)
                angles[a] += step
                turning[a] = step / t
                wrong = angles[a] - said[4 + a]
                if abs(wrong) > b.tolerance or step != 0.0:
                    busy[a] = 1.0
                elif abs(wrong) < 0.4 * b.tolerance:
                    busy[a] = 0.0
                us[a] = steer_law(wrong, turning[a], busy[a], b)
            bend = (math.tan(angles[0]) - math.tan(angles[1])) / b.base
            refs_of(slow_v, bend, turning, angles, b, refs)
            for i in range(4):
                wheel_law(w[i], refs[i], said[i], b.ratio if gear else 1.0, seen, brake > 0.0, b)
                wx = px + math.cos(th) * at[i, 0] - math.sin(th) * at[i, 1]
                wy = py + math.sin(th) * at[i, 0] + math.cos(th) * at[i, 1]
                soft[i], slick[i] = ground_of(wx, wy, field)
        steering = power = fx = fy = moment = 0.0
        for a in range(2):
            before[a] = x[a, ANGLE]
            want = hit(us[a], loss[m, 10 + a], sat[m, 10 + a], held, 10 + a)
            steering += steer(x[a], a, want, v, s[ENGINE], b)
        for i in range(4):
            want = hit(w[i, ASKED], loss[m, 6 + i], sat[m, 6 + i], held, 6 + i)
            w[i, PILOT], w[i, SPOOL] = spool_of(w[i, PILOT], w[i, SPOOL], want, parts[i, ZERO], b)
            torque, taken = circuit(w[i], parts[i], s, b)
            power += taken
            lx, ly, off = at[i]
            angle = angle_of(x[i // 2, ANGLE], lx, ly, b)
            rate = (x[i // 2, ANGLE] - before[i // 2]) / H
            cos, sin = math.cos(angle), math.sin(angle)
            vx, vy = v - r * ly, side + r * lx
            along, across = vx * cos + vy * sin - (r + rate) * off, vy * cos - vx * sin
            gx, gy = tyre(w[i], parts[i], along, across, load[i], soft[i], slick[i], b)
            roll(w[i], parts[i], torque, gx, load[i] * (1.0 + soft[i]), brake, b)
            bx, by = gx * cos - gy * sin, gx * sin + gy * cos
            fx, fy, moment = fx + bx, fy + by, moment + lx * by - ly * bx - gx * off
        machine(s, throttle[m], power, steering, gear, b)
        hx, hy = rise_of(px, py, field, b)
        now = mass[m]
        v += H * (fx / now - 9.81 * (hx * math.cos(th) + hy * math.sin(th)) + side * r)
        side += H * (fy / now - 9.81 * (hy * math.cos(th) - hx * math.sin(th)) - v * r)
        r += H * moment / (now * (b.base**2 + b.track**2) / 10)
        th += H * r
        px, py = px + H * (v * math.cos(th) - side * math.sin(th)), py + H * (v * math.sin(th) + side * math.cos(th))
        ax, ay = ax + H / 0.2 * (fx / now - ax), ay + H / 0.2 * (fy / now - ay)
        loads_of(now, ax, ay, ahead[m], b, load)
        if k % 2 == 0:
            ref[m, :4], ref[m, 4:], given[m, :4], given[m, 4:] = refs, angles, w[:, ASKED], us
            true[m, :4], true[m, 4:], read[m] = w[:, TURN] * b.radius, x[:, ANGLE], said
            done[m, :4], done[m, 4:] = w[:, SPOOL], x[:, A_SPOOL]
            body[m] = v, side, r, slow_v, bend, brake
            source[m] = s[ENGINE], s[OIL], s[RANGE]
    return ref, true, read, given, done, body, source
