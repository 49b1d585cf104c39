"""What `dumper.py` moves: one pump, valves with a compensator before them, coils that warm, motors, tyres and steering cylinders, in SI units.

Written from first principles: valves that let in a flow by their opening whatever their wheel's load, while the one pump holds
its pressure a margin above the most loaded wheel; where the flow does not suffice the most loaded wheel starves first. Coils
are driven by voltage, so that a warm one gives less current and its spool opens later and less.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numba as nb
import numpy as np
from electric_control import refs_of
from electric_physics import angle_of, dry
from electrohydraulic_physics import hit, places
from numpy.typing import NDArray

Array = NDArray[np.float64]
H = 0.0005
#: State of a wheel: spool, its rate, temperature of its coil [K above cold], pressure across its motor [Pa], speed [rad/s], way [rad],
#: deflections of the tyre [m], integral of its law, command, command that has arrived, way of the last edge [teeth], its time [s], reading [m/s], sense of turn.
SPOOL, RATE, HEAT, DP, TURN, ROLLED, ZX, ZY, TOTAL, ASKED, GIVEN, EDGE, SINCE, READ, SENSE = range(15)
#: What differs between wheels: radius [m], overlap ahead and back, gain, zero of the spool, leakage, friction, teeth, scale of the reading.
RADIUS, AHEAD, BACK, GAIN, ZERO, LEAK, RUB, TEETH, SCALE = range(9)
#: State of an axle's steering: spool, coil's temperature, speed of the rods [rad/s], rods [rad], wheels [rad], command that has arrived.
A_SPOOL, A_HEAT, ROD_V, ROD, ANGLE, A_GIVEN = range(6)


class Build(NamedTuple):
    """What a seed draws; `flow`: of a wheel's valve, fully open; `pump`: of the pump at rated speed."""

    top: float
    mass: float
    height: float
    cg: float
    radius: float
    lateral: float
    base: float
    track: float
    inertia: float
    motor: float
    flow: float
    curve: float
    pump: float
    margin: float
    most: float
    leakage: float
    friction: float
    power: float
    droop: float
    governor: float
    work: float
    fade: float
    warming: float
    spool: float
    stick: float
    know_ahead: float
    know_back: float
    forward: float
    proportional: float
    integral: float
    slew: float
    ramp: float
    grip: float
    stiffness: float
    relaxation: float
    roll: float
    hill: float
    ackermann: float
    steer_rate: float
    steer_gain: float
    steer_ahead: float
    steer_back: float
    steer_flow: float
    tolerance: float
    play: float
    stop: float
    least: float
    span: float


@nb.njit(cache=True)
def coil(heat: float, u: float, b: Build) -> tuple[float, float]:
    """Share of a cold coil's force that a warm one gives (1 … 1 − fade), and its temperature (0 … 1) a step later."""
    heat += H / b.warming * (0.35 + 0.65 * min(abs(u) * 1.6, 1.0) - heat)
    return 1.0 - b.fade * heat, heat


@nb.njit(cache=True)
def valve(w: Array, part: Array, want: float, b: Build) -> None:
    """Move a wheel's spool: second order behind the coil, held by friction."""
    force, w[HEAT] = coil(w[HEAT], want, b)
    wrong = force * want + part[ZERO] - w[SPOOL]
    push = 0.0 if abs(wrong) < b.stick and abs(w[RATE]) < 0.02 else b.spool**2 * wrong
    w[RATE] = (w[RATE] + H * push) / (1.0 + H * 1.5 * b.spool)
    w[SPOOL] = min(max(w[SPOOL] + H * w[RATE], -1.0), 1.0)


@nb.njit(cache=True)
def opening(spool: float, ahead: float, back: float) -> float:
    """Share of its edge that a spool uncovers beyond an overlap that differs by direction."""
    lap = ahead if spool > 0.0 else back
    return math.copysign(max(abs(spool) - lap, 0.0) / (1.0 - lap), spool)


@nb.njit(cache=True)
def motor(w: Array, part: Array, supply: float, b: Build) -> tuple[float, float, float]:
    """Move the pressure across a motor; return its torque [N·m], the flow taken [m³/s], the pressure that it asks for [Pa]."""
    size = opening(w[SPOOL], part[AHEAD], part[BACK])
    sign = 1.0 if size > 0.0 else -1.0
    load = sign * w[DP]
    x = max(supply - load, 0.0) / b.margin
    full = part[GAIN] * b.flow * abs(size) ** b.curve
    q, g = full * min(math.sqrt(x), 1.0), 0.0
    if x < 1.0:
        g = full / (2.0 * math.sqrt(max(x, 0.02)) * b.margin)
    leak, over, relief = b.leakage * part[LEAK], max(abs(w[DP]) - b.most, 0.0), b.flow / (0.04 * b.most)
    stiff = 1.2e9 / (1.2 * b.motor)
    net = sign * q - b.motor * w[TURN] - leak * w[DP] - math.copysign(relief * over, w[DP])
    w[DP] += H * stiff * net / (1.0 + H * stiff * (g + leak + (relief if over > 0.0 else 0.0)))
    return b.motor * w[DP], q, load if size != 0.0 else 0.0


@nb.njit(cache=True)
def tyre(w: Array, part: Array, along: float, across: float, load: float, soft: float, b: Build) -> tuple[float, float]:
    """Forces of a tyre [N], forward and left, by deflections that relax with the way rolled and what grip holds."""
    rim = w[TURN] * part[RADIUS]
    slip, rolled = rim - along, abs(rim) / b.relaxation
    most = b.grip * load * (1.0 - 0.35 * soft)
    k = b.stiffness * load / b.relaxation
    far = 3.0 * most / k
    w[ZX] = min(max(w[ZX] + H * (slip - rolled * w[ZX]), -far), far)
    w[ZY] = min(max(w[ZY] + H * (-across - rolled * w[ZY]), -far), far)
    fx, fy = k * (w[ZX] + 0.02 * slip), 0.7 * k * (w[ZY] - 0.02 * across)
    size = math.hypot(fx, fy) / most
    scale = (1.0 - math.exp(-size)) / size if size > 1e-6 else 1.0
    return fx * scale, fy * scale


@nb.njit(cache=True)
def encode(w: Array, part: Array, now: float, b: Build) -> None:
    """A pole wheel timed from edge to edge: late where it turns slowly, nothing below a least speed."""
    teeth = w[ROLLED] * part[TEETH] / (2.0 * math.pi)
    pitch = 2.0 * math.pi / part[TEETH] * b.radius * part[SCALE]
    moved = math.floor(teeth) - w[EDGE]
    if moved != 0.0:
        sense, beyond = math.copysign(1.0, moved), teeth - math.floor(teeth)
        passed = (beyond if moved > 0.0 else 1.0 - beyond) / max(abs(w[TURN]) * part[TEETH] / (2.0 * math.pi), 1e-3)
        when = now - min(passed, H)
        w[READ] = moved * pitch / max(when - w[SINCE], H) if sense == w[SENSE] else 0.0  # the same edge, passed back
        w[EDGE], w[SINCE], w[SENSE] = math.floor(teeth), when, sense
    most = pitch / max(now - w[SINCE], H)
    if abs(w[READ]) > most:
        w[READ] = math.copysign(most, w[READ])
    if abs(w[READ]) < b.least:
        w[READ] = 0.0


@nb.njit(cache=True)
def wheel_law(w: Array, ref: float, y: float, held: bool, b: Build) -> None:
    """Command of a wheel's valve, every 20 ms: a table of its curve, a proportional and an integral part, a slew."""
    t, wrong = 0.02, (ref - y) / b.top
    if held or (abs(ref) < 0.004 * b.top and abs(y) < 0.02 * b.top):
        w[TOTAL] *= 0.97
        w[ASKED] = 0.0 if held else w[ASKED] - min(max(w[ASKED], -b.slew * t), b.slew * t)
        return
    line = min(max(b.forward * ref / b.radius * b.motor / b.flow + b.proportional * wrong + w[TOTAL], -1.0), 1.0)
    jump = (b.know_ahead if line > 0.0 else b.know_back) * min(abs(line) / 0.008, 1.0)
    u = math.copysign(jump + (1.0 - jump) * abs(line) ** (1.0 / b.curve), line)
    given = min(max(u, w[ASKED] - b.slew * t, -1.0), w[ASKED] + b.slew * t, 1.0)
    if abs(u - given) < 0.01 or wrong * (u - given) < 0.0:
        w[TOTAL] = min(max(w[TOTAL] + t * b.integral * wrong, -0.35), 0.35)
    w[ASKED] = math.floor(given * 500 + 0.5) / 500


@nb.njit(cache=True)
def steer(x: Array, want: float, speed: float, share: float, load: float, b: Build) -> float:
    """Move an axle's valve, its two cylinders in parallel, and its wheels behind their play; return the flow taken."""
    force, x[A_HEAT] = coil(x[A_HEAT], want, b)
    x[A_SPOOL] += H * 0.6 * b.spool * (force * want - x[A_SPOOL])
    size = opening(x[A_SPOOL], b.steer_ahead, b.steer_back)
    scrub = 1.0 - min(0.25 * load / (b.mass * 4.9), 0.5) / (1.0 + (speed / 0.2) ** 2)
    x[ROD_V] += H / 0.05 * (b.steer_rate * size * scrub * share - x[ROD_V])
    x[ROD] = min(max(x[ROD] + H * x[ROD_V], -b.stop), b.stop)
    x[ANGLE] = min(max(x[ANGLE], x[ROD] - b.play), x[ROD] + b.play)
    return b.steer_flow * abs(x[ROD_V]) / b.steer_rate


@nb.njit(cache=True)
def steer_law(wrong: float, turning: float, b: Build) -> float:
    """Command of a steering valve: more than its overlap where the angle is off by more than a tolerance, or is to turn."""
    if abs(wrong) < b.tolerance and turning == 0.0:
        return 0.0
    line = b.steer_gain * wrong + 0.9 * turning / b.steer_rate
    jump = 0.9 * (b.steer_ahead if line > 0.0 else b.steer_back) * min(abs(line) / 0.03, 1.0)
    return min(max(math.floor((line + math.copysign(jump, line)) * 500 + 0.5) / 500, -1.0), 1.0)


@nb.njit(cache=True)
def drive(
    asked_v: Array, asked_angle: Array, mass: Array, ahead: Array, loss: Array, sat: Array, noise: Array,
    field: Array, parts: Array, b: Build,
) -> tuple[Array, ...]:  # fmt: skip
    """References, true values, what the controller reads, commands, spools, body (speed, sideways, yaw rate, speed and curvature
    asked), source (engine, pressure, a coil's temperature), per millisecond.
    """
    n = asked_v.size
    six = np.zeros((5, n, 6))
    ref, true, read, given, done = six[0], six[1], six[2], six[3], six[4]
    body, source = np.zeros((n, 5)), np.zeros((n, 3))
    w, x, at = np.zeros((4, 15)), np.zeros((2, 6)), places(b)
    said, refs, held = np.zeros(6), np.zeros(4), np.zeros(12)
    us, angles, turning = np.zeros(2), np.zeros(2), np.zeros(2)
    load, before = np.full(4, mass[0] * 9.81 / 4), np.zeros(2)
    v = side = r = th = px = py = ax = ay = bend = slow_v = resting = 0.0
    engine, supply, brake = b.work, b.margin, 1.0
    for k in range(2 * n):
        m, now = k // 2, k * H
        for i in range(4):
            encode(w[i], parts[i], now, b)
        if k % 40 == 0:
            for i in range(4):
                said[i] = hit(w[i, READ] * (1.0 + noise[m, i]), loss[m, i], sat[m, i], held, i)
            resting = resting + 0.02 if asked_v[m] == 0.0 and slow_v == 0.0 else 0.0
            brake = 1.0 if resting > 2.0 else 0.0
            step = b.ramp * 0.02 * (1.0 if asked_v[m] * slow_v >= 0.0 and abs(asked_v[m]) > abs(slow_v) else 1.6)
            slow_v += min(max(asked_v[m] - slow_v, -step), step)
            for a in range(2):
                said[4 + a] = hit(x[a, ANGLE] + noise[m, 4 + a], loss[m, 4 + a], sat[m, 4 + a], held, 4 + a)
                step = 0.7 * b.steer_rate * 0.02
                step = min(max(asked_angle[m, a] - angles[a], -step), step)
                angles[a] += step
                turning[a] = step / 0.02
                x[a, A_GIVEN] = us[a]
                us[a] = steer_law(angles[a] - said[4 + a], turning[a], b)
            bend = (math.tan(angles[0]) - math.tan(angles[1])) / b.base
            refs_of(slow_v, bend, turning, angles, b, refs)
            for i in range(4):
                w[i, GIVEN] = w[i, ASKED]
                wheel_law(w[i], refs[i], said[i], brake > 0.0, b)
        taken = fx = fy = moment = work = asks = 0.0
        for a in range(2):
            before[a] = x[a, ANGLE]
            want = hit(x[a, A_GIVEN], loss[m, 10 + a], sat[m, 10 + a], held, 10 + a)
            taken += steer(x[a], want, v, min(engine / 0.6, 1.0), load[2 * a] + load[2 * a + 1], b)
        for i in range(4):
            valve(w[i], parts[i], hit(w[i, GIVEN], loss[m, 6 + i], sat[m, 6 + i], held, 6 + i), b)
            torque, q, want = motor(w[i], parts[i], supply, b)
            taken, asks = taken + q, max(asks, want)
            a, (lx, ly, off) = i // 2, at[i]
            angle = angle_of(x[a, ANGLE], lx, ly, b)
            turn = (x[a, ANGLE] - before[a]) / H
            cos, sin = math.cos(angle), math.sin(angle)
            vx, vy = v - r * ly, side + r * lx
            along, across = vx * cos + vy * sin - (r + turn) * off, vy * cos - vx * sin
            wx, wy = px + math.cos(th) * lx - math.sin(th) * ly, py + math.sin(th) * lx + math.cos(th) * ly
            soft = min(max(math.sin(wx / 2.7 + field[2]) + math.sin(wy / 3.9 + field[3]) - 0.6, 0.0), 1.0)
            rise = b.hill * math.sin(wx / 6.0 + field[0]) + 0.3 * b.hill * math.sin(wx / 0.8 + wy / 1.1 + field[1])
            gx, gy = tyre(w[i], parts[i], along, across, load[i], soft, b)
            rub = parts[i, RUB] * b.friction * (1.0 + 0.5 * math.exp(-((w[i, TURN] / 0.15) ** 2))) + 0.04 * abs(torque)
            rub += b.roll * (1.0 + 2.0 * soft) * load[i] * b.radius + brake * 1.5 * b.motor * b.most
            w[i, TURN] = dry(w[i, TURN], H / b.inertia * (torque - gx * parts[i, RADIUS]), H / b.inertia * rub)
            w[i, ROLLED] += H * w[i, TURN]
            bx, by = (
                gx * cos - gy * sin - rise * load[i] * math.cos(th),
                gx * sin + gy * cos + rise * load[i] * math.sin(th),
            )
            fx, fy, moment = fx + bx, fy + by, moment + lx * by - ly * bx - gx * off
        set_to = min(asks, b.most) + b.margin
        supply = max(
            supply + H * min((set_to - supply) / 0.03, (b.pump * engine - taken) * 1.0e9 / (8.0 * b.motor)), 1e5
        )
        work = taken * supply / b.power / max(engine, 0.4)
        full = min(max((b.work * (1.0 + 0.3 * b.droop) - engine) / b.droop, 0.0), 1.0)
        engine = max(engine + H / b.governor * (full - work - 0.05), 0.4)
        now_m = mass[m]
        v += H * (fx / now_m + side * r)
        side += H * (fy / now_m - v * r)
        r += H * moment / (now_m * (b.base**2 + b.track**2) / 9)
        th += H * r
        px, py = px + H * (v * math.cos(th) - side * math.sin(th)), py + H * (v * math.sin(th) + side * math.cos(th))
        ax, ay = ax + H / 0.2 * (fx / now_m - ax), ay + H / 0.2 * (fy / now_m - ay)
        front, left = 0.5 + b.cg + ahead[m] - b.height / b.base * ax / 9.81, 0.5 - b.height / b.track * ay / 9.81
        for i in range(4):
            share = (front if i < 2 else 1.0 - front) * (left if i % 2 else 1.0 - left)
            load[i] = now_m * 9.81 * min(max(share, 0.03), 0.6)
        if k % 2 == 0:
            ref[m, :4], ref[m, 4:], given[m, :4], given[m, 4:] = refs, angles, w[:, ASKED], us
            true[m, :4], true[m, 4:], read[m] = w[:, TURN] * b.radius, x[:, ANGLE], said
            done[m, :4], done[m, 4:] = w[:, SPOOL], x[:, A_SPOOL]
            body[m] = v, side, r, slow_v, bend
            source[m] = engine, supply, w[0, HEAT]
    return ref, true, read, given, done, body, source
