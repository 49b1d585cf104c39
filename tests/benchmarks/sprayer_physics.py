"""What `sprayer.py` moves: an accumulator on a charging pump, spools with limits of rate, motors, soft tyres, a tank that sloshes, in SI units.

Written from first principles: the supply is a pressure that swings between two limits, whatever the wheels ask; valves are
orifices on it that nothing compensates, so that a wheel's speed for an opening falls with its load and with the supply.
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
#: State of a wheel: command behind its hysteresis, spool, its rate, pressure across the motor [Pa], speed [rad/s], way [rad],
#: deflections of the tyre [m], integral of its law, command, edges since the last reading, last edge [teeth], its time [s], time of
#: the edge that the last reading ended at [s; negative: none], reading [m/s].
BACKLASH, SPOOL, RATE, DP, TURN, ROLLED, ZX, ZY, TOTAL, ASKED, COUNT, EDGE, LAST, SINCE, READ = range(15)
#: What differs between wheels: radius without load [m], overlap, gain ahead and back, zero of the spool, leakage, friction, eccentricity
#: of the pole wheel [rad], scale of the reading.
RADIUS, DEAD, PLUS, MINUS, ZERO, LEAK, RUB, WAVE, SCALE = range(9)
#: State of an axle's steering: command behind its hysteresis, spool, its rate, speed of the rod [rad/s], rod [rad], angle [rad].
A_BACKLASH, A_SPOOL, A_RATE, ROD_V, ROD, ANGLE = range(6)
#: State of the supply: pressure [Pa], whether the pump charges, speed of the engine [of rated], oil [°C].
P, CHARGES, ENGINE, OIL = range(4)


class Build(NamedTuple):
    """What a seed draws; `flow`: of a wheel's valve, fully open, at the supply's upper limit `high`; `node`, `delay`: in steps."""

    top: float
    mass: float
    tank: float
    slosh: float
    slosh_rate: float
    height: float
    cg: float
    radius: float
    sink: float
    lateral: float
    base: float
    track: float
    inertia: float
    motor: float
    flow: float
    high: float
    low: float
    capacity: float
    pump: float
    power: float
    droop: float
    governor: float
    cold: float
    warming: float
    drift: float
    thin: float
    leakage: float
    leak_rise: float
    friction: float
    stiction: float
    spool: float
    damping: float
    spool_rate: float
    hysteresis: float
    dead: float
    known: float
    forward: float
    proportional: float
    integral: float
    unwind: float
    slew: float
    ramp: float
    cruise: float
    delay: int
    node: int
    teeth: float
    tick: float
    least: float
    wait: float
    grip: float
    stiffness: float
    relaxation: float
    roll: float
    hill: float
    hill_length: float
    wet: float
    ackermann: float
    steer_rate: float
    steer_gain: float
    steer_dead: float
    asymmetry: float
    play: float
    stop: float
    tolerance: float
    bow: float
    gain: float


@nb.njit(cache=True)
def spool_of(x: Array, at: int, want: float, b: Build) -> None:
    """Move a spool, whose state starts at `x[at]`: hysteresis, then second order whose rate is limited."""
    x[at] = min(max(x[at], want - b.hysteresis), want + b.hysteresis)
    push = b.spool**2 * (x[at] - x[at + 1])
    rate = (x[at + 2] + H * push) / (1.0 + 2.0 * H * b.damping * b.spool)
    x[at + 2] = min(max(rate, -b.spool_rate), b.spool_rate)
    x[at + 1] = min(max(x[at + 1] + H * x[at + 2], -1.0), 1.0)


@nb.njit(cache=True)
def opening(spool: float, dead: float) -> float:
    """Share of its edge that a spool uncovers beyond its overlap."""
    return math.copysign(max(abs(spool) - dead, 0.0) / (1.0 - dead), spool)


@nb.njit(cache=True)
def motor(w: Array, part: Array, supply: Array, b: Build) -> tuple[float, float]:
    """Move the pressure across a motor; return its torque [N·m] and the flow taken [m³/s]."""
    size = opening(w[SPOOL] + part[ZERO], part[DEAD])
    sign = 1.0 if size > 0.0 else -1.0
    warm = supply[OIL] - 45.0
    full = b.flow * (part[PLUS] if size > 0.0 else part[MINUS]) * (1.0 + b.drift * warm) * abs(size)
    x = (supply[P] - sign * w[DP]) / b.high
    q = full * math.sqrt(x) if x > 0.0 else 0.0
    g = full / (2.0 * math.sqrt(max(x, 0.01)) * b.high) if x > 0.0 else 0.0
    leak = b.leakage * part[LEAK] * math.exp(b.thin * warm) * (1.0 + b.leak_rise * abs(w[DP]) / b.high)
    most, relief = 1.15 * b.high, b.flow / (0.05 * b.high)
    over = max(abs(w[DP]) - most, 0.0)
    stiff = 1.2e9 / (1.3 * b.motor)
    net = sign * q - b.motor * w[TURN] - leak * w[DP] - math.copysign(relief * over, w[DP])
    w[DP] += H * stiff * net / (1.0 + H * stiff * (g + leak + (relief if over > 0.0 else 0.0)))
    return b.motor * w[DP], q


@nb.njit(cache=True)
def charge(s: Array, taken: float, b: Build) -> None:
    """Move supply, engine and oil by the flow that all valves take [m³/s]: the pump charges from a lower limit up to an upper one."""
    if s[P] < b.low:
        s[CHARGES] = 1.0
    elif s[P] > b.high:
        s[CHARGES] = 0.0
    q = b.pump * s[ENGINE] * s[CHARGES]
    s[P] = min(max(s[P] + H * (q - taken) / b.capacity, 0.1 * b.high), 1.05 * b.high)
    work = q * s[P] / b.power
    s[ENGINE] += H / b.governor * (1.0 - b.droop * work - s[ENGINE])
    s[OIL] += H / b.warming * (30.0 * min(work, 1.2) + b.cold + 15.0 - s[OIL])


@nb.njit(cache=True)
def rolls_at(part: Array, load: float, b: Build) -> float:
    """Radius that a wheel rolls at under its load [m]: a third of how far its tyre is pressed flat is lost."""
    return part[RADIUS] - b.sink * load / (b.mass * 9.81 / 4.0) / 3.0


@nb.njit(cache=True)
def tyre(
    w: Array, radius: float, along: float, across: float, load: float, grip: float, b: Build
) -> tuple[float, float]:
    """Forces of a tyre [N], forward and left: deflections that relax with the way rolled; what holds falls beyond its peak."""
    rim = w[TURN] * radius
    slip, rolled, end = rim - along, abs(rim) / b.relaxation, 1.5 * b.relaxation
    w[ZX] = min(max(w[ZX] + H * (slip - rolled * w[ZX]), -end), end)
    w[ZY] = min(max(w[ZY] + H * (-across - rolled * w[ZY]), -end), end)
    kx, ky = w[ZX] / b.relaxation + 0.03 * slip, 0.8 * (w[ZY] / b.relaxation - 0.03 * across)
    size = math.hypot(kx, ky)
    if size < 1e-9:
        return 0.0, 0.0
    force = load * grip * math.sin(1.35 * math.atan(b.stiffness * size / (1.35 * grip))) / size
    return force * kx, force * ky


@nb.njit(cache=True)
def turn_wheel(
    w: Array, part: Array, torque: float, pull: float, radius: float, load: float, soft: float, brake: float, b: Build
) -> None:
    """Move a wheel by its motor, what the ground pulls [N], dry friction with more at rest, rolling resistance and the parking brake."""
    rub = part[RUB] * b.friction * (1.0 + b.stiction * math.exp(-((w[TURN] / 0.12) ** 2))) + 0.05 * abs(torque)
    rub += b.roll * (1.0 + 2.5 * soft) * load * radius + brake * 1.6 * b.motor * b.high
    push = torque - pull * radius - 0.3 * b.friction * w[TURN] * b.radius / b.top
    w[TURN] = dry(w[TURN], H / b.inertia * push, H / b.inertia * rub)
    w[ROLLED] += H * w[TURN]


@nb.njit(cache=True)
def steer(x: Array, want: float, hand: float, speed: float, supply: float, load: float, b: Build) -> float:
    """Move an axle's valve, its one cylinder, slower to the side where it fills its piston, and wheels behind play; return the flow taken."""
    spool_of(x, A_BACKLASH, want, b)
    size = opening(x[A_SPOOL], b.steer_dead)
    side = 1.0 - math.copysign(b.asymmetry, hand * size)
    scrub = 1.0 - min(0.3 * load / (b.mass * 4.9), 0.5) / (1.0 + (speed / 0.25) ** 2)
    x[ROD_V] += H / 0.06 * (b.steer_rate * side * size * scrub * math.sqrt(supply / b.high) - x[ROD_V])
    x[ROD] = min(max(x[ROD] + H * x[ROD_V], -b.stop), b.stop)
    x[ANGLE] = min(max(x[ANGLE], x[ROD] - b.play), x[ROD] + b.play)
    return 0.15 * b.pump * abs(x[ROD_V]) / b.steer_rate
