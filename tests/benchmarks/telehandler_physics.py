"""What `telehandler.py` moves: a load-sensing pump, compensators, motors of two sizes, tyres and a boom's weight, in SI units.

Written from first principles: every valve has a compensator before it that answers late and, where its wheel pulls little, gives
a little less or more; the pump hears the highest load through a line that lags; steering comes first, the boom beside; a motor's
size goes to its smaller one in a fraction of a second, which halves its torque and nearly doubles its speed for an opening.
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
#: State of a wheel: current, current behind its hysteresis, spool, its rate, drop at the edge [of the margin], pressure across the
#: motor [Pa], size of the motor (share), speed [rad/s], way [rad], deflections of the tyre [m], integral of its law, command, edge,
#: its time [s], that of the one before, reading [m/s], sense of turn that the logic has, edges against it.
CURRENT, BACKLASH, SPOOL, RATE, DROP, DP, SIZE, TURN, ROLLED, ZX, ZY, TOTAL, ASKED, EDGE, SINCE, BEFORE, READ, SENSE, AGAINST = range(19)  # fmt: skip
#: What differs between wheels: radius without load [m], overlap, gain ahead and back, zero of the spool, leakage, friction, time that
#: its motor takes to change its size [s], eccentricity of its poles [rad], their unevenness [rad], scale of the reading.
RADIUS, DEAD, PLUS, MINUS, ZERO, LEAK, RUB, SHIFT, WAVE, UNEVEN, SCALE = range(11)
#: State of an axle's steering: current, current behind its hysteresis, spool, its rate, speed of the rod [rad/s], rod [rad], angle [rad].
A_CURRENT, A_BACKLASH, A_SPOOL, A_RATE, ROD_V, ROD, ANGLE = range(7)
#: State of the supply: pressure [Pa], the load that the pump hears [Pa], speed of the engine [of rated], oil [°C].
P, HEARD, ENGINE, OIL = range(4)


class Build(NamedTuple):
    """What a seed draws; `motor`: large, `flow`: of a wheel's valve, fully open; `small`: smaller size of a motor (share); `dither` [Hz, of full]."""

    top: float
    mass: float
    height: float
    cg: float
    radius: float
    sink: float
    lateral: float
    base: float
    track: float
    inertia: float
    motor: float
    small: float
    front_shifts: bool
    flow: float
    curve: float
    pump: float
    margin: float
    most: float
    comp_lag: float
    flow_force: float
    heard_lag: float
    leakage: float
    friction: float
    stiction: float
    power: float
    droop: float
    governor: float
    idle: float
    spares: float
    boom_flow: float
    cold: float
    warming: float
    coil: float
    spool: float
    damping: float
    hysteresis: float
    dither_hz: float
    dither: float
    dead: float
    known: float
    forward: float
    proportional: float
    integral: float
    unwind: float
    slew: float
    ramp: float
    teeth: float
    flips: int
    wait: float
    grip: float
    stiffness: float
    relaxation: float
    roll: float
    gravel: float
    hill: float
    hill_length: float
    ackermann: float
    steer_rate: float
    steer_gain: float
    steer_dead: float
    asymmetry: float
    creep: float
    play: float
    stop: float
    tolerance: float


@nb.njit(cache=True)
def spool_of(x: Array, want: float, now: float, oil: float, b: Build) -> None:
    """Move a valve, whose state starts at `x[0]`: coil, dither, hysteresis of the pilot stage (more in cold oil), spool."""
    x[0] += H / b.coil * (want - x[0])
    shaken = x[0] + (b.dither * math.sin(2.0 * math.pi * b.dither_hz * now) if abs(x[0]) > 0.02 else 0.0)
    band = b.hysteresis * (1.0 + 0.01 * max(50.0 - oil, 0.0))
    x[1] = min(max(x[1], shaken - band), shaken + band)
    goal = 0.0 if abs(x[0]) < 0.5 * band else x[1]  # springs centre it where nothing is asked
    x[3] = (x[3] + H * b.spool**2 * (goal - x[2])) / (1.0 + 2.0 * H * b.damping * b.spool)
    x[2] = min(max(x[2] + H * x[3], -1.0), 1.0)


@nb.njit(cache=True)
def opening(spool: float, dead: float) -> float:
    """Share of its edge that a spool uncovers beyond its overlap."""
    return math.copysign(max(abs(spool) - dead, 0.0) / (1.0 - dead), spool)


@nb.njit(cache=True)
def motor(w: Array, part: Array, supply: Array, size: float, b: Build) -> tuple[float, float, float]:
    """Move a compensator, the pressure across a motor and its size; return its torque [N·m], the flow taken [m³/s], the load that it reports [Pa]."""
    w[SIZE] += H / part[SHIFT] * (size - w[SIZE])
    d = b.motor * w[SIZE]
    edge = opening(w[SPOOL] + part[ZERO], part[DEAD])
    sign = 1.0 if edge > 0.0 else -1.0
    load = max(sign * w[DP], 0.0)
    spare = (supply[P] - load) / b.margin
    pinched = 1.0 - b.flow_force * max(spare - 1.0, 0.0) * b.margin / b.most
    w[DROP] += H / b.comp_lag * (max(min(pinched, spare), 0.0) - w[DROP])
    drop = max(min(w[DROP], spare), 0.0)
    full = (part[PLUS] if edge > 0.0 else part[MINUS]) * b.flow * abs(edge) ** b.curve
    q = full * math.sqrt(drop)
    g = full / (2.0 * math.sqrt(max(drop, 0.02)) * b.margin) if spare < w[DROP] else 0.0
    leak = b.leakage * part[LEAK] * math.exp(0.02 * (supply[OIL] - 45.0))
    over, relief = max(abs(w[DP]) - b.most, 0.0), b.flow / (0.04 * b.most)
    stiff = 1.2e9 / (1.3 * b.motor)
    net = sign * q - d * w[TURN] - leak * w[DP] - math.copysign(relief * over, w[DP])
    w[DP] += H * stiff * net / (1.0 + H * stiff * (g + leak + (relief if over > 0.0 else 0.0)))
    return d * w[DP], q, load if edge != 0.0 else 0.0


@nb.njit(cache=True)
def supply_of(s: Array, first: float, taken: float, asks: float, throttle: float, b: Build) -> None:
    """Move pump, engine and oil by the flow that steering and boom (`first`) and wheels take [m³/s] and the highest load [Pa]."""
    s[HEARD] += H / b.heard_lag * (asks - s[HEARD])
    goal = min(s[HEARD], b.most) + b.margin
    room = (b.pump * s[ENGINE] - first - taken) * 1.0e9 / (10.0 * b.motor)
    s[P] = max(s[P] + H * min((goal - s[P]) / 0.04, room), 1e5)
    work = (first + taken) * s[P] / b.power / max(s[ENGINE], 0.3)
    fuel = min(max((throttle * (1.0 + b.droop) - s[ENGINE]) / b.droop, 0.0), 1.1) if throttle > 0.0 else -1.0
    s[ENGINE] = min(max(s[ENGINE] + H / b.governor * (fuel - work - 0.12), 0.0), 1.1)
    s[OIL] += H / b.warming * (30.0 * min(work, 1.2) + b.cold + 12.0 - s[OIL])


@nb.njit(cache=True)
def rolls_at(part: Array, load: float, b: Build) -> float:
    """Radius that a wheel rolls at under its load [m]."""
    return part[RADIUS] - b.sink / 3.0 * load / (b.mass * 9.81 / 4.0)


@nb.njit(cache=True)
def tyre(
    w: Array, radius: float, along: float, across: float, load: float, grip: float, b: Build
) -> tuple[float, float]:
    """Forces of a tyre [N], forward and left: deflections that relax with the way rolled, and what grip holds, which falls beyond its peak."""
    rim = w[TURN] * radius
    slip, rolled, end = rim - along, abs(rim) / b.relaxation, 1.5 * b.relaxation
    w[ZX] = min(max(w[ZX] + H * (slip - rolled * w[ZX]), -end), end)
    w[ZY] = min(max(w[ZY] + H * (-across - rolled * w[ZY]), -end), end)
    kx, ky = w[ZX] / b.relaxation + 0.03 * slip, 0.8 * (w[ZY] / b.relaxation - 0.03 * across)
    size = math.hypot(kx, ky)
    if size < 1e-9:
        return 0.0, 0.0
    force = load * grip * math.sin(1.3 * math.atan(b.stiffness * size / (1.3 * grip))) / size
    return force * kx, force * ky


@nb.njit(cache=True)
def turn_wheel(
    w: Array, part: Array, torque: float, pull: float, radius: float, load: float, loose: float, brake: float, b: Build
) -> None:
    """Move a wheel by its motor, what the ground pulls [N], dry friction with more at rest, rolling resistance and the parking brake."""
    rub = part[RUB] * b.friction * (1.0 + b.stiction * math.exp(-((w[TURN] / 0.12) ** 2))) + 0.04 * abs(torque)
    rub += b.roll * (1.0 + 1.5 * loose) * load * radius + brake * 1.5 * b.motor * b.most
    push = torque - pull * radius - 0.3 * b.friction * w[TURN] * b.radius / b.top
    w[TURN] = dry(w[TURN], H / b.inertia * push, H / b.inertia * rub)
    w[ROLLED] += H * w[TURN]


@nb.njit(cache=True)
def steer(
    x: Array, want: float, now: float, hand: float, speed: float, side: float, supply: Array, load: float, b: Build
) -> float:
    """Move an axle's valve, its cylinder, slower to one side, and wheels behind play; return the flow taken.

    A cylinder that is shut in gives way slowly to the force from the side, in shares of the load.
    """
    spool_of(x, want, now, supply[OIL], b)
    edge = opening(x[A_SPOOL], b.steer_dead)
    slower = 1.0 - math.copysign(b.asymmetry, hand * edge)
    scrub = 1.0 - min(0.3 * load / (b.mass * 4.9), 0.5) / (1.0 + (speed / 0.25) ** 2)
    rate = b.steer_rate * slower * edge * scrub * min(supply[ENGINE] / 0.4, 1.0)
    x[ROD_V] += H / 0.06 * (rate - (0.0 if edge != 0.0 else b.creep * side) - x[ROD_V])
    x[ROD] = min(max(x[ROD] + H * x[ROD_V], -b.stop), b.stop)
    x[ANGLE] = min(max(x[ANGLE], x[ROD] - b.play), x[ROD] + b.play)
    return 0.12 * b.pump * abs(rate) / b.steer_rate


@nb.njit(cache=True)
def lagged(x: Array, lag: Array) -> Array:
    """Columns behind first-order filters of some time constants [s], per millisecond."""
    out = x.copy()
    for k in range(1, x.shape[0]):
        for i in range(x.shape[1]):
            out[k, i] = out[k - 1, i] + (x[k, i] - out[k - 1, i]) * min(0.001 / lag[i], 1.0)
    return out
