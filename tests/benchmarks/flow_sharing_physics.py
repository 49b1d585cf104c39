"""What `flow_sharing.py` moves: engine, pump, flow-sharing valves, motors, tyres, ground, steering and body, in SI units, step by step.

Written from first principles: a load-sensing pump on a diesel with droop; valves whose compensators hold one pressure drop over
all edges, so that too little flow is shared in proportion; brake valves that hold a load which pulls; radial piston motors of
two displacements whose leakage grows with pressure and heat; Stribeck friction; tyres by a sine of an arctangent with relaxation.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numba as nb
import numpy as np
from electric_physics import dry
from numpy.typing import NDArray

Array = NDArray[np.float64]
H = 0.0005
#: State of a wheel: current of the coil, seat of the hysteresis, spool (−1 … 1), pressures of the motor's ports [Pa], speed
#: [rad/s], way [rad], deflections of the tyre [m], integral of its law, command, opening of the brake valve.
COIL, SEAT, SPOOL, PA, PB, TURN, ROLLED, ZX, ZY, TOTAL, ASKED, OPEN = range(12)
#: What differs between wheels: radius [m], overlap, gain of either edge, zero of the spool, leakage, friction, spool sensor's gain and zero.
RADIUS, OVERLAP, PLUS, MINUS, ZERO, LEAK, RUB, GAIN, OFFSET = range(9)
#: State of the supply: flow of the pump [m³/s], its pressure [Pa], share of the flow asked for, engine's speed [of rated],
#: oil [°C], displacement of the motors [of the small one].
FLOW, PRESSURE, SHARE, ENGINE, OIL, RANGE = range(6)
#: State of an axle's steering: coil, seat, spool, speed of the rod [rad/s], rod [rad], angle [rad].
A_COIL, A_SEAT, A_SPOOL, ROD_V, ROD, ANGLE = range(6)


class Build(NamedTuple):
    """What a seed draws."""

    top: float
    cycle: int
    mass: float
    height: float
    cg: float
    radius: float
    lateral: float
    base: float
    track: float
    inertia: float
    small: float
    ratio: float
    flow: float
    volume: float
    most: float
    margin: float
    back: float
    pilot: float
    brake_lag: float
    relief: float
    yields: float
    leakage: float
    friction: float
    stiction: float
    stribeck: float
    loss: float
    pump: float
    pump_lag: float
    engine: float
    droop: float
    governor: float
    power: float
    coil: float
    lag: float
    rate: float
    hysteresis: float
    overlap: float
    progress: float
    known: float
    known_progress: float
    forward: float
    proportional: float
    integral: float
    authority: float
    slew: float
    ramp: float
    brake_ramp: float
    teeth: float
    tick: float
    eccentric: float
    timeout: float
    reading_lag: float
    quantum: float
    stiffness: float
    shape: float
    relaxation: float
    grip: float
    roll: float
    soft: float
    slick: float
    hill: float
    hill_length: float
    ackermann: float
    steer_rate: float
    asymmetry: float
    mirrored: float
    steer_gain: float
    steer_overlap: float
    tolerance: float
    play: float
    inside: bool
    rear: float


@nb.njit(cache=True)
def spool_of(coil: float, seat: float, spool: float, want: float, zero: float, b: Build) -> tuple[float, float, float]:
    """Coil, seat and spool a step later: a coil's lag, dry friction that leaves a hysteresis, a pilot stage with a greatest speed."""
    coil += H / b.coil * (want - coil)
    seat = min(max(seat, coil - b.hysteresis), coil + b.hysteresis)
    spool += min(max(H / b.lag * (seat + zero - spool), -b.rate * H), b.rate * H)
    return coil, seat, min(max(spool, -1.0), 1.0)


@nb.njit(cache=True)
def edge_of(spool: float, part: Array, b: Build) -> float:
    """Area of the metering edge [of full], with its side's sign: overlap, a progressive notch, another gain on either side."""
    size = max(abs(spool) - part[OVERLAP], 0.0) / (1.0 - part[OVERLAP])
    return math.copysign((part[PLUS] if spool > 0 else part[MINUS]) * size**b.progress, spool)


@nb.njit(cache=True)
def bulk(p: float) -> float:
    """Stiffness of oil with some air in it [Pa]."""
    return 1.2e9 * (p + 2e5) / (p + 12e5)


@nb.njit(cache=True)
def motor(w: Array, part: Array, area: float, supply: Array, b: Build) -> tuple[float, float, float]:
    """Move the pressures of a motor; return its torque without friction [N·m], the flow it takes [m³/s] and its load pressure [Pa].

    What flows in opens the brake valve of what flows out: a load that pulls empties the inlet and closes it.
    """
    head = w[PA] if area > 0 else w[PB]
    out = w[PB] if area > 0 else w[PA]
    room = min(max((b.most - b.margin - head) / 2e6, 0.0), 1.0)
    fed = abs(area) * b.flow * supply[SHARE] * room * (1.0 - b.yields * head / b.most) if area != 0.0 else 0.0
    root = math.sqrt(out / b.back) if out > 1e5 else out / math.sqrt(1e5 * b.back)
    opens = min(max((head - 2e5) / b.pilot, 0.0), 1.0) if area != 0.0 else 0.0
    w[OPEN] += H / b.brake_lag * (opens - w[OPEN])
    left = abs(area) * b.flow * root * w[OPEN]
    qa, qb = (fed, -left) if area > 0 else (-left, fed)
    disp, across = b.small * supply[RANGE], w[PA] - w[PB]
    thin = b.leakage * part[LEAK] * math.exp(0.022 * (supply[OIL] - 45.0))
    slip = thin * across * (1.0 + abs(across) / b.most)
    if abs(across) > b.relief:
        slip += (across - math.copysign(b.relief, across)) * b.flow / (0.08 * b.most)
    swept = disp * w[TURN]
    w[PA] = max(w[PA] + H * bulk(w[PA]) / b.volume * (qa - swept - slip - 0.3 * thin * w[PA]), 0.0)
    w[PB] = max(w[PB] + H * bulk(w[PB]) / b.volume * (qb + swept + slip - 0.3 * thin * w[PB]), 0.0)
    return disp * (w[PA] - w[PB]), fed, head if area != 0.0 else 0.0


@nb.njit(cache=True)
def turn(w: Array, part: Array, torque: float, force: float, load: float, soft: float, brake: float, b: Build) -> None:
    """Move a wheel by its motor and its tyre against friction of motor and bearings, rolling resistance and the parking brake."""
    slow = math.exp(-((w[TURN] / b.stribeck) ** 2))
    rub = part[RUB] * b.friction * (1.0 + (b.stiction - 1.0) * slow) + b.loss * abs(torque)
    rub += (b.roll + 0.09 * soft * math.sqrt(4.0 * load / (9.81 * b.mass))) * load * part[RADIUS]
    rub += brake * 1.2 * b.small * b.ratio * b.most
    push = torque - force * part[RADIUS] - 0.08 * part[RUB] * b.friction * w[TURN]
    w[TURN] = dry(w[TURN], H / b.inertia * push, H / b.inertia * rub)
    w[ROLLED] += H * w[TURN]


@nb.njit(cache=True)
def grip_of(slip: float, load: float, soft: float, slick: float, b: Build) -> float:
    """Share of a wheel's load that its tyre bears along the ground, over slip; heavy wheels bear less of it."""
    most = b.grip * (1.0 - 0.4 * soft) * (1.0 - 0.55 * slick) * (1.05 - 0.05 * 4.0 * load / (9.81 * b.mass))
    steep = b.stiffness / (b.shape * b.grip) * (1.0 - 0.6 * soft)
    return most * math.sin(b.shape * math.atan(steep * slip))


@nb.njit(cache=True)
def tyre(
    w: Array, part: Array, along: float, across: float, load: float, soft: float, slick: float, b: Build
) -> tuple[float, float]:
    """Forces of a tyre [N], forward and to the left of its wheel, whose contact moves by `along` and `across` [m/s]."""
    rim = w[TURN] * part[RADIUS]
    slip, side, roll, end = rim - along, -across, abs(rim) / b.relaxation, 1.2 * b.relaxation
    w[ZX] = min(max(w[ZX] + H * (slip - roll * w[ZX]), -end), end)
    w[ZY] = min(max(w[ZY] + H * (side - roll * w[ZY]), -end), end)
    kx, ky = w[ZX] / b.relaxation + 0.03 * slip, w[ZY] / b.relaxation + 0.03 * side
    size = math.hypot(kx, ky)
    if size < 1e-9:
        return 0.0, 0.0
    force = load * grip_of(size, load, soft, slick, b) / size
    return force * kx, 0.8 * force * ky


@nb.njit(cache=True)
def supply_of(s: Array, wanted: float, steering: float, taken: float, head: float, small: bool, b: Build) -> None:
    """Move engine, pump, oil and the motors' displacement by the flow asked for at full margin and the one taken [m³/s]."""
    stall = min(max((s[ENGINE] - 0.72 * b.engine) / (0.12 * b.engine), 0.1), 1.0)
    most = b.pump * s[ENGINE] * stall
    goal = min(
        wanted + steering, most, 0.92 * b.power * s[ENGINE] / max(s[PRESSURE], 1e6)
    )  # no more than the diesel gives
    s[FLOW] += H / b.pump_lag * (goal + 0.005 * b.pump - s[FLOW])
    free = max(s[FLOW] - steering, 0.0)  # steering is served first
    s[SHARE] = min(max(free / max(wanted, 1e-3 * b.pump), 0.0), 1.05)
    s[PRESSURE] += H / 0.03 * (min(head + b.margin, b.most) - s[PRESSURE])
    load = s[PRESSURE] * (taken + steering) / b.power / max(s[ENGINE], 0.3)
    given = min(max((b.engine * (1.0 + b.droop) - s[ENGINE]) / (2.0 * b.droop), 0.0), 1.15)
    s[ENGINE] += H / b.governor * (given - load - 0.08)
    s[OIL] += H * (0.25 * min(load, 1.0) - 0.0012 * (s[OIL] - 20.0))
    step = H / 0.25 * (b.ratio - 1.0)
    s[RANGE] += min(max((1.0 if small else b.ratio) - s[RANGE], -step), step)


@nb.njit(cache=True)
def steer(x: Array, a: int, want: float, speed: float, head: float, b: Build) -> float:
    """Move an axle's steering valve, rod and wheels; return the flow [of its own at full speed]: a rod's side has less area.

    `head`: share of the flow it asks for. The linkage is slower at its ends, the tyres' scrub slows what has too little pressure.
    """
    x[A_COIL], x[A_SEAT], x[A_SPOOL] = spool_of(x[A_COIL], x[A_SEAT], x[A_SPOOL], want, 0.0, b)
    size = max(abs(x[A_SPOOL]) - b.steer_overlap, 0.0) / (1.0 - b.steer_overlap)
    hand = math.copysign(1.0, x[A_SPOOL]) * (b.mirrored if a else 1.0)
    scrub = 0.08 * math.exp(-abs(speed) / 0.25)
    rate = b.steer_rate * (1.0 + hand * b.asymmetry) * size * head * (1.0 - scrub)
    rate *= 1.0 - 0.5 * x[ANGLE] ** 2
    x[ROD_V] += H / 0.04 * (math.copysign(rate, x[A_SPOOL]) - x[ROD_V])
    x[ROD] = min(max(x[ROD] + H * x[ROD_V], -0.6), 0.6)
    x[ANGLE] = min(max(x[ANGLE], x[ROD] - b.play), x[ROD] + b.play)
    return size


@nb.njit(cache=True)
def ground_of(x: float, y: float, field: Array, b: Build) -> tuple[float, float]:
    """How soft and how slick the ground is, 0 … 0.8; a slick stripe is narrower than the machine, so that one side stands in it."""
    wet = math.sin(x / 3.1 + field[0]) * math.sin(y / 2.3 + field[1]) + 0.5 * math.sin((x + y) / 1.7 + field[2])
    ice = math.sin(x / 6.7 + field[3]) + 0.8 * math.sin((0.6 * x - 0.8 * y) / 0.7 + field[4])
    return min(max(1.2 * (wet - b.soft), 0.0), 0.8), min(max(1.5 * (ice - b.slick), 0.0), 0.8)


@nb.njit(cache=True)
def rise_of(x: float, y: float, field: Array, b: Build) -> tuple[float, float]:
    """Slope of the ground along x and y: long ramps and short humps."""
    ramp = math.tanh(3.0 * math.sin(x / b.hill_length + field[5]))
    return (
        b.hill * (0.8 * ramp + 0.2 * math.cos(x / 1.9 + field[1])),
        b.hill * 0.6 * math.sin(y / b.hill_length + field[2]),
    )


@nb.njit(cache=True)
def loads_of(ax: float, ay: float, ahead: float, aside: float, b: Build, out: Array) -> None:
    """Loads of the wheels [N]: where the payload hangs (`ahead`, `aside` of the middle, of base and track), accelerations, slopes."""
    front = 0.5 + b.cg + ahead - b.height / b.base * ax / 9.81
    left = 0.5 + aside - b.height / b.track * ay / 9.81
    for i in range(4):
        share = (front if i < 2 else 1.0 - front) * (left if i % 2 else 1.0 - left)
        out[i] = b.mass * 9.81 * min(max(share, 0.03), 0.6)
