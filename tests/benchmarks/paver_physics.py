"""What `paver.py` moves: motors that counterbalance valves lock, valves whose gain drifts with the oil, tyres, a screed that drags, in SI units.

Written from first principles: a pump feeds one port of a motor and cannot hold its wheel back; what comes out at the other port has
to pass a counterbalance valve that opens by the pressure of the first one, so that a wheel that nothing feeds is locked, and one that
is pushed brakes itself. All wheels hang on one pressure; what an opening lets in grows, or falls, by the oil's temperature.
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
#: State of a wheel: spool, its rate, pressures of both ports [Pa], how far the counterbalance valve is shut (share), speed [rad/s],
#: way [rad], deflections of the tyre [m], command, speed behind its filter [m/s], what the sensor sends [m/s].
SPOOL, RATE, PORT_A, PORT_B, SHUT, TURN, ROLLED, ZX, ZY, ASKED, FILTERED, SENT = range(12)
#: What differs between wheels: radius [m], overlap, gain ahead and back, zero of the spool, leakage, friction, drift by the oil (share
#: of the machine's), what the controller multiplies its command by, ripple of the gear, scale of the reading.
RADIUS, DEAD, PLUS, MINUS, ZERO, LEAK, RUB, DRIFT, TRIM, RIPPLE, SCALE = range(11)
#: State of an axle's steering: spool, speed of the rod [rad/s], rod [rad], angle [rad].
A_SPOOL, ROD_V, ROD, ANGLE = range(4)
#: State of the supply: pressure [Pa], oil [°C].
P, OIL = range(2)


class Build(NamedTuple):
    """What a seed draws; `drift`: of a valve's gain from 20 to 70 °C; `closed`: gain of the law, 0 where it is open; `bang`: valves on or off."""

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
    pressure: float
    sag: float
    margin: float
    lock: float
    pilot: float
    opens: float
    shuts: float
    leakage: float
    thin: float
    friction: float
    stiction: float
    cold: float
    hot: float
    warming: float
    drift: float
    knows: float
    spool: float
    damping: float
    dead: float
    known: float
    forward: float
    closed: float
    slew: float
    ramp: float
    filter: float
    renewed: int
    teeth: float
    grip: float
    stiffness: float
    relaxation: float
    roll: float
    soft: float
    grade: float
    camber: float
    ackermann: float
    steer_rate: float
    steer_gain: float
    steer_dead: float
    asymmetry: float
    bang: bool
    play: float
    stop: float
    tolerance: float


@nb.njit(cache=True)
def opening(spool: float, dead: float) -> float:
    """Share of its edge that a spool uncovers beyond its overlap."""
    return math.copysign(max(abs(spool) - dead, 0.0) / (1.0 - dead), spool)


@nb.njit(cache=True)
def valve(w: Array, want: float, b: Build) -> None:
    """Move a wheel's spool: second order."""
    w[RATE] = (w[RATE] + H * b.spool**2 * (want - w[SPOOL])) / (1.0 + 2.0 * H * b.damping * b.spool)
    w[SPOOL] = min(max(w[SPOOL] + H * w[RATE], -1.0), 1.0)


@nb.njit(cache=True)
def motor(w: Array, part: Array, s: Array, b: Build) -> tuple[float, float, float]:
    """Move a motor's ports and its counterbalance valve; return its torque, by how much it is locked [N·m], and the flow taken [m³/s]."""
    edge = opening(w[SPOOL] + part[ZERO], part[DEAD])
    way = 1.0 if edge > 0.0 else -1.0 if edge < 0.0 else 0.0
    warm = (s[OIL] - 45.0) / 50.0
    full = b.flow * abs(edge) * (part[PLUS] if edge > 0.0 else part[MINUS]) * (1.0 + b.drift * part[DRIFT] * warm)
    leak, relief = b.leakage * part[LEAK] * math.exp(b.thin * (s[OIL] - 45.0)), b.flow / (0.04 * b.pressure)
    stiff, taken = 1.2e9 / (0.8 * b.motor), 0.0
    for port in (PORT_A, PORT_B):
        sign = 1.0 if port == PORT_A else -1.0
        p, fed = w[port], way == sign
        x = min(max((s[P] - p) / b.margin, 0.0), 1.0)
        q = full * math.sqrt(x) if fed else 0.0
        g = full / (2.0 * math.sqrt(max(x, 0.02)) * b.margin) if fed and x < 1.0 else 0.0
        if not fed:  # to the tank, behind the spool
            q, g = -p * b.flow / (0.4 * b.pressure), 0.0
            p += H * stiff * q / (1.0 + H * stiff * b.flow / (0.4 * b.pressure))
        else:
            over = max(p - 1.1 * b.pressure, 0.0)
            net = q - sign * b.motor * w[TURN] - leak * p - relief * over
            p += H * stiff * net / (1.0 + H * stiff * (g + leak + (relief if over > 0.0 else 0.0)))
            taken += q
        w[port] = max(p, 0.0)
    pilot = w[PORT_A] if way > 0.0 else w[PORT_B] if way < 0.0 else 0.0
    goal = 1.0 - min(pilot / b.pilot, 1.0)
    lag = 0.01 if way == 0.0 else b.shuts if goal > w[SHUT] else b.opens  # its check valve shuts at once
    w[SHUT] += H / lag * (goal - w[SHUT])
    return b.motor * (w[PORT_A] - w[PORT_B]), b.motor * b.lock * w[SHUT], taken


@nb.njit(cache=True)
def supply_of(s: Array, taken: float, b: Build) -> None:
    """Move pressure and oil by the flow taken [m³/s]."""
    s[P] += H / 0.1 * (b.pressure * (1.0 - b.sag * taken / (4.0 * b.flow)) - s[P])
    s[OIL] += H / b.warming * (b.hot + 15.0 * taken / (4.0 * b.flow) - s[OIL])


@nb.njit(cache=True)
def tyre(w: Array, part: Array, along: float, across: float, load: float, grip: float, b: Build) -> tuple[float, float]:
    """Forces of a tyre [N], forward and left: deflections that relax with the way rolled, and what grip holds."""
    rim = w[TURN] * part[RADIUS]
    slip, rolled, end = rim - along, abs(rim) / b.relaxation, 2.5 * b.relaxation * b.grip / b.stiffness
    w[ZX] = min(max(w[ZX] + H * (slip - rolled * w[ZX]), -end), end)
    w[ZY] = min(max(w[ZY] + H * (-across - rolled * w[ZY]), -end), end)
    kx, ky = w[ZX] / b.relaxation + 0.05 * slip, 0.7 * (w[ZY] / b.relaxation - 0.05 * across)
    size = math.hypot(kx, ky)
    if size < 1e-9:
        return 0.0, 0.0
    force = load * grip * (1.0 - math.exp(-b.stiffness * size / grip)) / size
    return force * kx, force * ky


@nb.njit(cache=True)
def turn_wheel(w: Array, part: Array, torque: float, locked: float, pull: float, load: float, b: Build) -> None:
    """Move a wheel by its motor and what the ground pulls [N], against its lock, dry friction with more at rest, rolling resistance."""
    rub = part[RUB] * b.friction * (1.0 + b.stiction * math.exp(-((w[TURN] / 0.05) ** 2))) + 0.05 * abs(torque)
    way = w[TURN] * b.radius / b.top
    push = torque - pull * part[RADIUS] - (0.4 * b.friction + (0.1 + w[SHUT]) * b.motor * b.pressure) * way
    w[TURN] = dry(w[TURN], H / b.inertia * push, H / b.inertia * (rub + locked + b.roll * load * b.radius))
    w[ROLLED] += H * w[TURN]


@nb.njit(cache=True)
def sense(w: Array, part: Array, b: Build) -> None:
    """Filter a speed that the gear's teeth ripple."""
    good = w[TURN] * b.radius * part[SCALE] * (1.0 + part[RIPPLE] * math.sin(b.teeth * w[ROLLED]))
    w[FILTERED] += H / b.filter * (good - w[FILTERED])


@nb.njit(cache=True)
def steer(x: Array, want: float, hand: float, speed: float, oil: float, load: float, b: Build) -> None:
    """Move an axle's valve, its cylinder, slower to one side and in cold oil, and wheels behind play."""
    x[A_SPOOL] += H / (0.02 if b.bang else 0.05) * (want - x[A_SPOOL])
    edge = opening(x[A_SPOOL], b.steer_dead)
    slower = (1.0 - math.copysign(b.asymmetry, hand * edge)) * (1.0 + b.drift * (oil - 45.0) / 50.0)
    scrub = 1.0 - min(0.35 * load / (b.mass * 4.9), 0.5) / (1.0 + (speed / 0.08) ** 2)
    x[ROD_V] += H / 0.05 * (b.steer_rate * slower * edge * scrub - x[ROD_V])
    x[ROD] = min(max(x[ROD] + H * x[ROD_V], -b.stop), b.stop)
    x[ANGLE] = min(max(x[ANGLE], x[ROD] - b.play), x[ROD] + b.play)
