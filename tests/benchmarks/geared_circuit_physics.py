"""What `geared_circuit.py` moves: engine, pumps, hoses, motors, brakes, steering and loads, in SI units, step by step.

Written from first principles: a pump of variable displacement for every wheel on one diesel whose throttle an operator moves; its
control spool overlaps and its gain differs by direction and falls as the oil warms; oil gives way at both ends of a hose that has
a mass of its own, so that every circuit rings; motors of two displacements; relief valves across. Tyres are `flow_sharing_physics`.
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
#: State of a wheel: pilot pressure, control spool and swash plate (−1 … 1), pressure across [Pa] at pump and motor, speed [rad/s], way
#: [rad], deflections of the tyre [m], integral of its law, command, flow in the hose [m³/s]; 5, 7 and 8 are where `tyre` looks.
PILOT, SPOOL, SWASH, P1, P2, TURN, ROLLED, ZX, ZY, TOTAL, ASKED, HOSE = range(12)
#: What differs between wheels: radius [m], dead band, gain of either direction, zero of the spool, leakage, friction, spool sensor.
RADIUS, DEAD, PLUS, MINUS, ZERO, LEAK, RUB, GAIN, OFFSET = range(9)
#: State of the machine: engine's speed [of rated], oil [°C], displacement of the motors [of the small one].
ENGINE, OIL, RANGE = range(3)
#: State of an axle's steering: pilot, spool, speed of the rod [rad/s], rod [rad], angle [rad].
A_PILOT, A_SPOOL, ROD_V, ROD, ANGLE = range(5)


class Build(NamedTuple):
    """What a seed draws."""

    top: float
    cycle: int
    frame: int
    windows: int
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
    pump: float
    give: float
    hose: float
    damping: float
    most: float
    relief: float
    leakage: float
    friction: float
    stiction: float
    stribeck: float
    loss: float
    power: float
    droop: float
    governor: float
    cold: float
    warming: float
    fade: float
    coil: float
    lag: float
    rate: float
    hysteresis: float
    dead: float
    known: float
    forward: float
    proportional: float
    integral: float
    authority: float
    slew: float
    ramp: float
    brake_ramp: float
    pitch: float
    stiffness: float
    shape: float
    relaxation: float
    grip: float
    roll: float
    hill: float
    hill_length: float
    ackermann: float
    steer_rate: float
    asymmetry: float
    mirrored: float
    steer_gain: float
    steer_dead: float
    tolerance: float
    play: float
    rear: float


@nb.njit(cache=True)
def spool_of(pilot: float, spool: float, want: float, zero: float, b: Build) -> tuple[float, float]:
    """Pilot pressure and spool a step later: a lag, then friction that leaves a hysteresis."""
    pilot += H / b.coil * (want + zero - pilot)
    return pilot, min(max(min(max(spool, pilot - b.hysteresis), pilot + b.hysteresis), -1.0), 1.0)


@nb.njit(cache=True)
def plate_of(spool: float, part: Array, oil: float, b: Build) -> float:
    """Displacement that a control spool asks of its pump [of the greatest]: dead band, a gain of either direction, warm oil gives less."""
    size = max(abs(spool) - part[DEAD], 0.0) / (1.0 - part[DEAD])
    warm = min(max((oil - b.cold) / b.warming, 0.0), 1.2)
    return math.copysign((part[PLUS] if spool > 0 else part[MINUS]) * size * (1.0 - b.fade * warm), spool)


@nb.njit(cache=True)
def circuit(w: Array, part: Array, s: Array, b: Build) -> tuple[float, float]:
    """Move swash plate, pressures and hose of a wheel; return its motor's torque without friction [N·m] and the engine's power [W]."""
    goal = plate_of(w[SPOOL], part, s[OIL], b)
    cut = min(
        max((abs(w[P1]) - 0.95 * b.relief) / (0.1 * b.relief), 0.0), 1.0
    )  # pressure cut-off of a pump that pushes
    if goal * w[P1] > 0.0:
        goal *= 1.0 - 0.9 * cut
    w[SWASH] += min(max(H / b.lag * (goal - w[SWASH]), -b.rate * H), b.rate * H)
    thin = b.leakage * part[LEAK] * math.exp(0.02 * (s[OIL] - 45.0))
    made = b.pump * w[SWASH] * s[ENGINE]
    over = w[P1] - math.copysign(min(abs(w[P1]), b.relief), w[P1])
    w[P1] += H / b.give * (made - w[HOSE] - thin * w[P1] - over * b.pump / (0.06 * b.most))
    w[HOSE] += H / b.hose * (w[P1] - w[P2] - b.damping * w[HOSE])
    disp = b.small * s[RANGE]
    over = w[P2] - math.copysign(min(abs(w[P2]), b.relief), w[P2])
    w[P2] += H / b.give * (w[HOSE] - disp * w[TURN] - thin * w[P2] - over * b.pump / (0.06 * b.most))
    return disp * w[P2], made * w[P1]


@nb.njit(cache=True)
def roll(w: Array, part: Array, torque: float, force: float, load: float, brake: float, b: Build) -> None:
    """Move a wheel by motor and tyre against friction with a Stribeck part, rolling resistance and the parking brake."""
    slow = math.exp(-((w[TURN] / b.stribeck) ** 2))
    rub = (
        part[RUB] * b.friction * (1.0 + (b.stiction - 1.0) * slow) + b.loss * abs(torque) + b.roll * load * part[RADIUS]
    )
    rub += brake * 1.5 * b.small * b.ratio * b.most
    push = torque - force * part[RADIUS] - 0.1 * b.friction * w[TURN]
    w[TURN] = dry(w[TURN], H / b.inertia * push, H / b.inertia * rub)
    w[ROLLED] += H * w[TURN]


@nb.njit(cache=True)
def machine(s: Array, throttle: float, power: float, steering: float, low: bool, b: Build) -> None:
    """Move engine, oil and displacement by the throttle [of rated speed], the power that pumps take [W] and the gear."""
    load = max(power, 0.0) / b.power + 0.15 * steering + 0.06
    given = min(max((throttle * (1.0 + b.droop) - s[ENGINE]) / (2.0 * b.droop * throttle), 0.0), 1.1)
    s[ENGINE] = max(s[ENGINE] + H / b.governor * (given - load), 0.4)
    s[OIL] += H * b.warming / 70.0 * (0.6 + min(load, 1.0))
    step = H / 0.35 * (b.ratio - 1.0)
    s[RANGE] += min(max((b.ratio if low else 1.0) - s[RANGE], -step), step)


@nb.njit(cache=True)
def steer(x: Array, a: int, want: float, speed: float, engine: float, b: Build) -> float:
    """Move an axle's valve, rod and wheels; return its flow. A fixed pump on the engine feeds it; wheels that stand scrub."""
    x[A_PILOT], x[A_SPOOL] = spool_of(x[A_PILOT], x[A_SPOOL], want, 0.0, b)
    size = max(abs(x[A_SPOOL]) - b.steer_dead, 0.0) / (1.0 - b.steer_dead)
    hand = math.copysign(1.0, x[A_SPOOL]) * (b.mirrored if a else 1.0)
    scrub = 0.12 * math.exp(-abs(speed) / 0.2)
    rate = b.steer_rate * (1.0 + hand * b.asymmetry) * size * min(engine / 0.8, 1.15) * (1.0 - scrub)
    x[ROD_V] += H / 0.05 * (math.copysign(rate, x[A_SPOOL]) - x[ROD_V])
    x[ROD] = min(max(x[ROD] + H * x[ROD_V], -0.55), 0.55)
    x[ANGLE] = min(max(x[ANGLE], x[ROD] - b.play), x[ROD] + b.play)
    return size


@nb.njit(cache=True)
def rise_of(x: float, y: float, field: Array, b: Build) -> tuple[float, float]:
    """Slope of the ground along x and y: level stretches, ramps, undulation."""
    ramp = math.sin(x / b.hill_length + field[0]) + 0.5 * math.sin(y / b.hill_length + field[1])
    steep = math.copysign(min(max(2.0 * (abs(ramp) - 0.4), 0.0), 1.0), ramp)
    return b.hill * (0.85 * steep + 0.15 * math.sin(x / 1.3 + field[2])), b.hill * 0.5 * math.sin(y / 3.7 + field[3])


@nb.njit(cache=True)
def ground_of(x: float, y: float, field: Array) -> tuple[float, float]:
    """How soft and how slick the ground under a wheel is, 0 … 0.7."""
    wet = math.sin(x / 2.7 + field[4]) + math.sin((x + 2 * y) / 1.9 + field[5]) - 1.1
    ice = math.sin((x - y) / 4.3 + field[2]) + math.sin((2 * y - x) / 1.4 + field[0]) - 1.3
    return min(max(wet, 0.0), 0.7), min(max(ice, 0.0), 0.7)


@nb.njit(cache=True)
def loads_of(mass: float, ax: float, ay: float, ahead: float, b: Build, out: Array) -> None:
    """Loads of the wheels [N] by payload (`ahead` of the middle, of base), accelerations and slopes [m/s²]."""
    front = 0.5 + b.cg + ahead - b.height / b.base * ax / 9.81
    left = 0.5 - b.height / b.track * ay / 9.81
    for i in range(4):
        share = (front if i < 2 else 1.0 - front) * (left if i % 2 else 1.0 - left)
        out[i] = mass * 9.81 * min(max(share, 0.02), 0.65)
