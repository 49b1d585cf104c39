"""What `forwarder.py` moves: engine, gear pumps, valves without compensators, motors, tyres, steering and loads, in SI units, step by step.

Written from first principles: a gear pump of fixed displacement for every axle, whose bypass compensator holds its pressure a
margin above the axle's most loaded wheel; valves behind it that nothing compensates, so that a less loaded wheel gets more; a
vent that takes the pressure off where it is too high, and gives it back later; orifices whose flow turns laminar in cold oil.
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
TANK = 3e5
#: State of a wheel: coil and spool (−1 … 1), pressures of the motor's ports [Pa], speed [rad/s], way [rad], deflections of the tyre
#: [m], integral of its law, command, filtered tacho [m/s].
COIL, SPOOL, PA, PB, TURN, ROLLED, ZX, ZY, TOTAL, ASKED, TACHO = range(11)
#: What differs between wheels: radius [m], overlap, gain of either edge, zero of the spool, leakage, friction, gain and zero of the
#: tacho, its ripple, gain and zero of the spool sensor.
RADIUS, OVERLAP, PLUS, MINUS, ZERO, LEAK, RUB, SCALE, SHIFT, WAVE, GAIN, OFFSET = range(12)
#: State of a pump: its pressure, what its compensator holds [Pa], whether it is vented.
P, SET, VENT = range(3)
#: State of an axle's steering: coil, spool, speed of the rod [rad/s], rod [rad], angle [rad], filtered sensor [rad].
A_COIL, A_SPOOL, ROD_V, ROD, ANGLE, POT = range(6)


class Build(NamedTuple):
    """What a seed draws; `flow`: of a wheel's valve, fully open, at the margin; `pump`: of an axle's pump at rated speed."""

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
    motor: float
    lobes: float
    ripple: float
    flow: float
    curve: float
    out: float
    pump: float
    margin: float
    comp_lag: float
    cut: float
    back: float
    most: float
    line: float
    hose: float
    leakage: float
    thin: float
    friction: float
    stiction: float
    loss: float
    laminar: float
    power: float
    droop: float
    governor: float
    idle: float
    cold: float
    warming: float
    coil: float
    hysteresis: float
    dead: float
    known: float
    forward: float
    proportional: float
    integral: float
    leak: float
    authority: float
    slew: float
    ramp: float
    brake_ramp: float
    filter: float
    step: float
    tacho_drift: float
    grip: float
    stiffness: float
    relaxation: float
    roll: float
    hill: float
    hill_length: float
    bump: float
    ackermann: float
    steer_rate: float
    steer_flow: float
    asymmetry: float
    mirrored: float
    steer_gain: float
    steer_dead: float
    tolerance: float
    play: float
    pot: float


@nb.njit(cache=True)
def spool_of(coil: float, spool: float, want: float, zero: float, b: Build) -> tuple[float, float]:
    """Coil and spool a step later: a lag, then friction that leaves a hysteresis."""
    coil += H / b.coil * (want + zero - coil)
    return coil, min(max(min(max(spool, coil - b.hysteresis), coil + b.hysteresis), -1.0), 1.0)


@nb.njit(cache=True)
def thickness(oil: float, b: Build) -> float:
    """Viscosity of the oil, of that at 45 °C."""
    return math.exp(-b.thin * (oil - 45.0))


@nb.njit(cache=True)
def orifice(k: float, across: float, thick: float, b: Build) -> tuple[float, float]:
    """Flow [m³/s] through an edge of `k` [m³/s/√Pa] and how it grows with the pressure across: turbulent, laminar where that is small."""
    root = math.sqrt(abs(across) + b.laminar * thick**2)
    return k * across / root, k / root


@nb.njit(cache=True)
def motor(w: Array, part: Array, supply: float, thick: float, b: Build) -> tuple[float, float, float, float]:
    """Move both ports of a motor; return its torque [N·m], flow from the pump [m³/s], how that grows, pressure it asks for [Pa]."""
    disp = b.motor * (1.0 + b.ripple * math.sin(b.lobes * w[ROLLED]))
    size = max(abs(w[SPOOL]) - part[OVERLAP], 0.0) / (1.0 - part[OVERLAP])
    ahead = w[SPOOL] > 0.0
    k = b.flow / math.sqrt(b.margin) * size**b.curve * (part[PLUS] if ahead else part[MINUS])
    fed, left = (PA, PB) if ahead else (PB, PA)
    q_in, g_in = orifice(k, supply - w[fed], thick, b)
    if q_in < 0.0:  # a check valve holds the load
        q_in = g_in = 0.0
    q_out, g_out = orifice(b.out * k, w[left] - TANK, thick, b)
    inner = b.leakage * part[LEAK] / thick
    turned, across, relief = disp * w[TURN], w[PA] - w[PB], b.flow / (0.05 * b.most)
    stiff = 1.0e9 / b.hose
    for port, sign in ((PA, 1.0), (PB, -1.0)):
        q, g = (q_in, g_in) if port == fed else (-q_out, g_out)
        over = max(w[port] - b.most, 0.0)
        net = q - sign * (turned + inner * across) - 0.3 * inner * w[port] - relief * over
        w[port] += H * stiff * net / (1.0 + H * stiff * (g + 1.3 * inner + (relief if over > 0.0 else 0.0)))
        w[port] = max(w[port], TANK)  # what lacks comes from the return line
    return disp * (w[PA] - w[PB]), q_in, g_in, w[fed] if size > 0.0 else TANK


@nb.njit(cache=True)
def pump(c: Array, most: float, made: float, taken: float, growth: float, thick: float, b: Build) -> float:
    """Move a gear pump's pressure by what its axle takes; return the power it takes [W]. `most`: pressure that the axle asks for."""
    if most > b.cut:
        c[VENT] = 1.0
    elif most < b.back * b.cut:
        c[VENT] = 0.0
    c[SET] += H / b.comp_lag * ((TANK if c[VENT] > 0.0 else most) + b.margin - c[SET])
    g = b.pump / 5e5
    over, slip = max(c[P] - c[SET], 0.0), 0.04 * b.pump / b.most / thick
    stiff = 1.0e9 / b.line
    net = made - taken - g * over - slip * c[P]
    c[P] = max(c[P] + H * stiff * net / (1.0 + H * stiff * (growth + slip + (g if over > 0.0 else 0.0))), TANK)
    return float(made * c[P])


@nb.njit(cache=True)
def roll(w: Array, part: Array, torque: float, force: float, load: float, brake: float, b: Build) -> None:
    """Move a wheel by motor and tyre against friction, more at rest than turning, rolling resistance and the parking brake."""
    slow = math.exp(-((w[TURN] / 0.12) ** 2))
    rub = part[RUB] * b.friction * (1.0 + (b.stiction - 1.0) * slow) + b.loss * abs(torque)
    rub += b.roll * load * part[RADIUS] + brake * 1.5 * b.motor * b.most
    w[TURN] = dry(w[TURN], H / b.inertia * (torque - force * part[RADIUS]), H / b.inertia * rub)
    w[ROLLED] += H * w[TURN]


@nb.njit(cache=True)
def tyre(w: Array, part: Array, along: float, across: float, load: float, soft: float, b: Build) -> tuple[float, float]:
    """Forces of a tyre [N], forward and left: bristles that bend up to what grip holds; soft ground is less stiff and shears."""
    rim = w[TURN] * part[RADIUS]
    slip, rolled = rim - along, abs(rim) / b.relaxation
    w[ZX] = w[ZX] + H * (slip - rolled * w[ZX])
    w[ZY] = w[ZY] + H * (-across - rolled * w[ZY])
    most = b.grip * load * (1.0 - 0.5 * soft)
    k = b.stiffness * load * (1.0 - 0.5 * soft) / b.relaxation
    bent = k * math.hypot(w[ZX], w[ZY])
    if bent > 1.4 * most:  # bristles slide
        w[ZX], w[ZY] = w[ZX] * 1.4 * most / bent, w[ZY] * 1.4 * most / bent
    fx, fy = k * (w[ZX] + 0.02 * slip), 0.8 * k * (w[ZY] - 0.02 * across)
    size = math.hypot(fx, fy) / most
    scale = math.tanh(size) / size if size > 1e-6 else 1.0
    return fx * scale, fy * scale


@nb.njit(cache=True)
def engine_of(s: Array, asked: float, power: float, b: Build) -> None:
    """Move engine [of rated] and oil [°C] by the speed asked for and the power taken [W]: droop, a governor that takes its time."""
    load = min(power / b.power / max(s[0], 0.3), 1.3)
    given = min(max((asked * (1.0 + 0.5 * b.droop) - s[0]) / b.droop, 0.0), 1.05)
    s[0] = max(s[0] + H / b.governor * (given - load - 0.04), 0.4)
    s[1] += H * (b.warming / 60.0 * min(power / b.power, 1.0) - 0.0004 * (s[1] - 10.0))


@nb.njit(cache=True)
def steer(x: Array, a: int, want: float, speed: float, engine: float, load: float, b: Build) -> float:
    """Move an axle's valve, cylinder and wheels; return the flow it takes. A loaded axle that stands turns slower; it has play."""
    x[A_COIL], x[A_SPOOL] = spool_of(x[A_COIL], x[A_SPOOL], want, 0.0, b)
    size = max(abs(x[A_SPOOL]) - b.steer_dead, 0.0) / (1.0 - b.steer_dead)
    hand = math.copysign(1.0, x[A_SPOOL]) * (b.mirrored if a else 1.0)
    scrub = 1.0 - min(0.2 * load / (b.mass * 4.9), 0.4) * math.exp(-abs(speed) / 0.15)
    rate = b.steer_rate * (1.0 + hand * b.asymmetry) * size * scrub * min(engine / 0.7, 1.0)
    x[ROD_V] += H / 0.06 * (math.copysign(rate, x[A_SPOOL]) - x[ROD_V])
    x[ROD] = min(max(x[ROD] + H * x[ROD_V], -0.55), 0.55)
    x[ANGLE] = min(max(x[ANGLE], x[ROD] - b.play), x[ROD] + b.play)
    return b.steer_flow * abs(x[ROD_V]) / b.steer_rate


@nb.njit(cache=True)
def ground(x: float, y: float, field: Array, b: Build) -> tuple[float, float, float]:
    """Slope along x and along y, and softness (0 … 0.8) under a wheel: banks, and stumps that a wheel climbs and comes down from."""
    bank = math.sin(x / b.hill_length + field[0]) + 0.4 * math.sin(y / b.hill_length + field[1])
    wide = b.hill * math.tanh(2.0 * bank)
    sx, sy = math.sin(x / 0.45 + field[2]), math.sin(y / 0.6 + field[3])
    stump = max(sx * sy * math.sin((x + y) / 3.1 + field[4]) - 0.5, 0.0)
    bump = 4.0 * b.bump * stump * math.cos(x / 0.45 + field[2])
    soft = math.sin(x / 3.3 + field[5]) + math.sin((x + 2.0 * y) / 2.3 + field[4]) - 0.9
    return wide + bump, 0.5 * b.hill * math.sin(y / 4.1 + field[3]), min(max(soft, 0.0), 0.8)


@nb.njit(cache=True)
def loads_of(mass: float, ax: float, ay: float, ahead: float, aside: float, b: Build, out: Array) -> None:
    """Loads of the wheels [N] by where the mass hangs (`ahead` and `aside` of the middle, of base and track), accelerations, slopes."""
    front = 0.5 + b.cg + ahead - b.height / b.base * ax / 9.81
    left = 0.5 + aside - b.height / b.track * ay / 9.81
    for i in range(4):
        share = (front if i < 2 else 1.0 - front) * (left if i % 2 else 1.0 - left)
        out[i] = mass * 9.81 * min(max(share, 0.02), 0.65)
