"""What `transporter.py` moves: valves told flows, motors that grow with their pressure, a pump with accumulators, brakes, in SI units.

Written from first principles: an amplifier ramps the flow that it is told and its spool follows late, a compensator keeps that flow as long
as the supply has its margin left; a motor's displacement goes by its own pressure, so that the same flow turns a wheel at half the speed
uphill; a pump hears the highest load late, gives what its engine turns it, and an accumulator holds its pressure when nothing is taken; each
wheel has a brake that springs close, and a coil that tells nothing of slow teeth.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numba as nb
import numpy as np
from electric_physics import dry
from numpy.typing import NDArray
from tug_physics import ROLLED, TURN

Array = NDArray[np.float64]
H = 0.0005
#: State of a wheel: pressure across its motor [Pa], displacement (share), pressure behind its damper [Pa], flow that its amplifier ramps to and
#: that its spool gives (−1 … 1), brake (1: shut); speed [rad/s], way [rad] and deflections of the tyre [m] at the places of `tug_physics`
#: (5 … 8); teeth counted since the last reading, times of the last tooth and of that before the gate [s], reading [m/s], integral of its
#: law, command.
DP, SIZE, CALM, RAMP, SPOOL = range(5)
BRAKE, TOOTH, COUNTED, LAST, FORE, READ, TOTAL, ASKED = range(9, 17)
#: What differs between wheels: radius without load [m], flow ahead and back, leakage, friction, time that its motor takes to change its
#: displacement [s], time that its brake takes to open [s], scale of the reading, speed below which its coil tells nothing [m/s].
RADIUS, PLUS, MINUS, LEAK, RUB, SHIFT, OPENS, SCALE, DEAF = range(9)
#: State of an axle: valve, rod [rad], angle [rad].
A_VALVE, ROD, ANGLE = range(3)
#: State of the supply: pressure [Pa], highest load as the pump hears it [Pa], speed of the engine [of rated], share that its limit leaves.
P, HEARD, ENGINE, CUT = range(4)


class Build(NamedTuple):
    """What a seed draws; `full` [m/s]: of a wheel at a command of 1 and the least displacement; `begins`, `span` [Pa]: where a motor grows."""

    top: float
    cycle: int
    mass: float
    most_load: float
    height: float
    cg: float
    zone: int
    radius: float
    sink: float
    lateral: float
    base: float
    track: float
    inertia: float
    motor: float
    small: float
    begins: float
    span: float
    flow: float
    full: float
    slope: float
    dead: float
    amplifier: float
    lag: float
    margin: float
    most: float
    damper: float
    leakage: float
    friction: float
    stiction: float
    pump: float
    store: float
    heard_up: float
    heard_down: float
    power: float
    droop: float
    governor: float
    idle: float
    reserve: float
    pitch: float
    gate: int
    forward: float
    proportional: float
    integral: float
    slew: float
    lever: float
    ramp: float
    coasts: bool
    coast_ramp: float
    grip: float
    stiffness: float
    relaxation: float
    roll: float
    slick: float
    hill: float
    hill_length: float
    ackermann: float
    steer_rate: float
    steer_gain: float
    steer_lag: float
    scrub: float
    asymmetry: float
    play: float
    stop: float
    tolerance: float
    quantum: float
    speed_quantum: float
    angle_quantum: float


@nb.njit(cache=True)
def valve(w: Array, want: float, b: Build) -> float:
    """Move an amplifier's ramp and its spool by the flow that it is told (−1 … 1); return the flow that the spool lets through [of full]."""
    w[RAMP] += min(max(want - w[RAMP], -b.amplifier * H), b.amplifier * H)
    w[SPOOL] += H / b.lag * (min(max(w[RAMP], -1.0), 1.0) - w[SPOOL])
    size = max(abs(w[SPOOL]) - b.dead, 0.0) / (1.0 - b.dead)
    return math.copysign(size, w[SPOOL])


@nb.njit(cache=True)
def motor(w: Array, part: Array, edge: float, s: Array, floats: bool, b: Build) -> tuple[float, float, float]:
    """Move a motor's pressure by the flow of its valve; return its torque [N·m], the flow taken [m³/s], the load that it reports [Pa].

    `floats`: both its sides are joined, so that it turns freely.
    """
    grown = min(max((abs(w[DP]) - b.begins) / b.span, 0.0), 1.0)
    w[SIZE] += H / part[SHIFT] * (b.small + (1.0 - b.small) * grown - w[SIZE])
    d, sign = b.motor * w[SIZE], 1.0 if edge > 0.0 else -1.0
    load = max(sign * w[DP], 0.0)
    spare = max((s[P] - load) / b.margin, 0.0)
    drop = min(spare, 1.0 + b.slope * (spare - 1.0))
    full = (part[PLUS] if edge > 0.0 else part[MINUS]) * b.flow * abs(edge)
    q = full * math.sqrt(drop)
    g = full / (2.0 * math.sqrt(max(drop, 0.02)) * b.margin) if spare < 1.0 else 0.0
    leak = b.leakage * part[LEAK] + (b.flow / (0.03 * b.most) if floats else 0.0)
    over, relief = max(abs(w[DP]) - b.most, 0.0), b.flow / (0.04 * b.most)
    w[CALM] += H / 0.1 * (w[DP] - w[CALM])
    damps, stiff = b.damper * b.flow / b.most, 1.0e9 / (1.5 * b.motor)
    net = sign * q - d * w[TURN] - leak * w[DP] - damps * (w[DP] - w[CALM]) - math.copysign(relief * over, w[DP])
    w[DP] += H * stiff * net / (1.0 + H * stiff * (g + leak + damps + (relief if over > 0.0 else 0.0)))
    return d * w[DP], q, load if edge != 0.0 else 0.0


@nb.njit(cache=True)
def supply_of(s: Array, taken: float, asks: float, throttle: float, b: Build) -> None:
    """Move the pump, its accumulator and the engine by what is taken [m³/s] and the highest load [Pa].

    The pump gives what it takes to hold the margin above the load that it hears, up to its flow and its cut-off; the accumulator fills by
    what is left over and is emptied by what is taken alone.
    """
    s[HEARD] += H / (b.heard_up if asks > s[HEARD] else b.heard_down) * (asks - s[HEARD])
    goal = min(s[HEARD] + b.margin * 1.3, b.most + b.margin)
    room = b.pump * b.store / 1.0e7  # m³ per Pa
    given = min(max(taken + room * (goal - s[P]) / 0.06, 0.0), b.pump * s[ENGINE])
    s[P] = min(max(s[P] + H / room * (given - taken - 0.004 * b.pump), 1e5), b.most + 2.0 * b.margin)
    work = given * s[P] / b.power / max(s[ENGINE], 0.3)
    fuel = min(max((throttle * (1.0 + b.droop) - s[ENGINE]) / b.droop, 0.0), 1.15)
    s[ENGINE] = min(max(s[ENGINE] + H / b.governor * (fuel - work - 0.08), 0.35), 1.1)


@nb.njit(cache=True)
def turn_wheel(
    w: Array, part: Array, torque: float, pull: float, radius: float, load: float, shuts: float, b: Build
) -> None:
    """Move a wheel by its motor, what the ground pulls [N], dry friction with more at rest, rolling resistance and its brake.

    `shuts`: 1 where the brake's valve lets its spring close, 0 where pressure opens it.
    """
    w[BRAKE] = min(max(w[BRAKE] + (H / 0.15 if shuts > 0.0 else -H / part[OPENS]), 0.0), 1.0)
    rub = part[RUB] * b.friction * (1.0 + b.stiction * math.exp(-((w[TURN] / 0.1) ** 2))) + 0.03 * abs(torque)
    rub += b.roll * load * radius + w[BRAKE] * 1.6 * b.motor * b.most
    push = torque - pull * radius - 0.2 * b.friction * w[TURN] * b.radius / b.top
    w[TURN] = dry(w[TURN], H / b.inertia * push, H / b.inertia * rub)
    w[ROLLED] += H * w[TURN]


@nb.njit(cache=True)
def coil(w: Array, part: Array, now: float, b: Build) -> None:
    """Count teeth that pass a coil fast enough, with their times; below its least speed a coil gives too little for an edge."""
    teeth = w[ROLLED] * b.radius / b.pitch
    moved = math.floor(teeth) - w[TOOTH]
    if moved != 0.0:
        w[TOOTH] = math.floor(teeth)
        if abs(w[TURN]) * b.radius >= part[DEAF]:
            beyond = teeth - w[TOOTH] if moved > 0.0 else w[TOOTH] + 1.0 - teeth
            w[COUNTED] += moved
            w[LAST] = now - min(beyond * b.pitch / max(abs(w[TURN]) * b.radius, 1e-3), H)


@nb.njit(cache=True)
def gated(w: Array, part: Array, now: float, b: Build) -> None:
    """Renew a reading at the end of a gate: teeth since the last one by the time that they took, and nothing where none came for a while."""
    if w[COUNTED] != 0.0:
        took = w[LAST] - w[FORE]
        if 0.0 < took < 0.3:  # else they are the first teeth after a rest, which have no time before them
            w[READ] = w[COUNTED] * b.pitch / took * part[SCALE]
        w[FORE], w[COUNTED] = w[LAST], 0.0
    elif now - w[FORE] > 0.25:
        w[READ] = 0.0


@nb.njit(cache=True)
def steer(x: Array, want: float, hand: float, speed: float, load: float, s: Array, b: Build) -> float:
    """Move an axle's valve, its cylinder, which is slower to one side and where a heavy axle stands, and the wheels behind play; return the flow [m³/s]."""
    x[A_VALVE] += H / b.steer_lag * (min(max(want, -1.0), 1.0) - x[A_VALVE])
    drag = min(b.scrub * load / (b.mass * (1.0 + b.most_load) * 4.9), 0.7) / (1.0 + (speed / 0.15) ** 2)
    slower = 1.0 - math.copysign(b.asymmetry, hand * x[A_VALVE])
    rate = b.steer_rate * x[A_VALVE] * slower * (1.0 - drag) * min(s[ENGINE] / 0.45, 1.0)
    x[ROD] = min(max(x[ROD] + H * rate, -b.stop), b.stop)
    x[ANGLE] = min(max(x[ANGLE], x[ROD] - b.play), x[ROD] + b.play)
    return 0.08 * b.pump * abs(rate) / b.steer_rate


@nb.njit(cache=True)
def loads_of(total: float, front: float, left: float, zone: int, out: Array) -> None:
    """Loads of the wheels [N] on three hydraulic zones: the wheels of the joined end (`zone` 0: front, 1: rear) carry the same."""
    for i in range(4):
        share = front if i < 2 else 1.0 - front
        if i // 2 == zone:
            side = 0.5
        else:  # the other end holds all that leans
            lean = (left - 0.5) / max(share, 0.2)
            side = 0.5 + (lean if i % 2 else -lean)
        out[i] = total * 9.81 * min(max(share * side, 0.03), 0.6)
