"""What `harvester.py` moves: open-centre valves in series, motors behind counterbalance valves, an axle's lock, counters, in SI units.

Written from first principles: a gear pump of each side gives what its engine turns it; the front section of a side's block takes its wheel's
share past a bypass that its spool closes, and hands all of it on to the rear section, so that both share one pressure; a wheel moves once
the drop over its bypass is more than its load, which is why the same opening gives another speed for every load and every speed of the engine.
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
#: State of a wheel: pressure across its motor [Pa], the load that its section feels [Pa], pressure behind its damper [Pa], current and spool
#: (−1 … 1); speed [rad/s], way [rad] and deflections of the tyre [m] at the places of `tug_physics` (5 … 8); brake (1: shut), last tooth,
#: teeth against its bit of direction, that bit, reading [m/s], integral of its law, command, what moves the spool behind its hysteresis.
DP, FELT, CALM, COIL, SPOOL = range(5)
BRAKE, TOOTH, AGAINST, BIT, READ, TOTAL, ASKED, FORCE = range(9, 17)
#: What differs between wheels: radius without load [m], overlap ahead and back, opening (share), leakage, friction, scale of the reading,
#: time that its brake takes to open [s].
RADIUS, PLUS, MINUS, OPENS, LEAK, RUB, SCALE, RELEASE = range(8)
#: State of an axle: valve, rod [rad], angle [rad].
A_VALVE, ROD, ANGLE = range(3)
#: State of the supply: flow past the reliefs of right and left, pressures of their pumps [Pa], speed of the engine [of rated], oil (0 cold … 1).
SPILL_R, SPILL_L, P_R, P_L, ENGINE, WARM = range(6)
COUNTS = 24  # windows of a counter that are kept


class Build(NamedTuple):
    """What a seed draws; `full` [m/s]: of a wheel that takes all of its pump's flow at rated speed, in the range for fields."""

    top: float
    cycle: int
    mass: float
    hopper: float
    height: float
    cg: float
    radius: float
    sink: float
    lateral: float
    base: float
    track: float
    inertia: float
    motor: float
    full: float
    road: float
    most: float
    rest_drop: float
    in_drop: float
    closes: float
    curve: float
    hysteresis: float
    lag: float
    pilot: float
    pilot_lag: float
    damper: float
    leakage: float
    thin: float
    friction: float
    stiction: float
    lock: float
    lock_rear: bool
    power: float
    droop: float
    governor: float
    idle: float
    known_drop: float
    known_load: float
    known_overlap: float
    proportional: float
    integral: float
    slew: float
    lever: float
    ramp: float
    pitch: float
    windows: int
    grip: float
    stiffness: float
    relaxation: float
    roll: float
    slick: float
    rough: float
    hill: float
    hill_length: float
    ackermann: float
    steer_rate: float
    steer_gain: float
    steer_lag: float
    steer_dead: float
    scrub: float
    asymmetry: float
    play: float
    stop: float
    tolerance: float
    quantum: float
    speed_quantum: float
    angle_quantum: float


@nb.njit(cache=True)
def section(x: float, overlap: float, flow: float, load: float, drop: float, b: Build) -> tuple[float, float]:
    """What a section's wheel gets [share of the pump's rated flow] and the drop over it [Pa], for an opening of 0 … 1, the flow that comes in
    and the load of its motor [Pa]; `drop`: over its open bypass at rated flow [Pa]."""
    past = max(1.0 - x / b.closes, 0.004) ** 2 / math.sqrt(drop)
    goes = max((x - overlap) / (1.0 - overlap), 0.0) ** b.curve / math.sqrt(b.in_drop)
    if flow <= past * math.sqrt(load) or goes == 0.0:
        return 0.0, (flow / past) ** 2
    k, c = goes**2 - past**2, flow**2 + goes**2 * load  # k·s² + 2·flow·past·s − c = 0 with s² the drop
    if abs(k) < 1e-6 * past**2:
        s = c / (2.0 * flow * past)
    else:
        s = (math.sqrt((flow * past) ** 2 + k * c) - flow * past) / k
    return min(max(flow - past * s, 0.0), flow), s**2


@nb.njit(cache=True)
def opening_for(share: float, overlap: float, flow: float, load: float, b: Build) -> float:
    """Opening at which a wheel gets a share of the rated flow by what is known of a valve; 1 where none gives as much."""
    low, high = 0.0, 1.0
    for _ in range(16):
        mid = 0.5 * (low + high)
        if section(mid, overlap, flow, load, b.known_drop, b)[0] < share:
            low = mid
        else:
            high = mid
    return high


@nb.njit(cache=True)
def valve(w: Array, part: Array, want: float, b: Build) -> None:
    """Move a spool by the current that it is given (−1 … 1), late and with hysteresis."""
    w[COIL] += H / b.lag * (min(max(want, -1.0), 1.0) - w[COIL])
    w[FORCE] = min(max(w[FORCE], w[COIL] - b.hysteresis), w[COIL] + b.hysteresis)
    w[SPOOL] += H / (0.4 * b.lag) * (w[FORCE] - w[SPOOL])


@nb.njit(cache=True)
def motor(w: Array, part: Array, flow: float, size: float, s: Array, b: Build) -> tuple[float, float]:
    """Move a motor's pressure by what its section lets in; return its torque [N·m] and the drop over its section [Pa].

    A counterbalance valve holds what pushes: oil leaves only where some pressure lets it in. `size`: displacement (share).
    """
    sign, d = 1.0 if w[SPOOL] > 0.0 else -1.0, b.motor * size
    rated = b.motor * b.full / b.radius
    drop = b.rest_drop * (1.0 + b.thin * (0.5 - s[WARM]))
    w[FELT] += H / b.pilot_lag * (max(sign * w[DP], b.pilot) - w[FELT])
    overlap = part[PLUS] if sign > 0.0 else part[MINUS]
    got, over = section(min(abs(w[SPOOL]) * part[OPENS], 1.0), overlap, flow, w[FELT], drop, b)
    leak = b.leakage * part[LEAK] * (0.6 + 0.8 * s[WARM])
    beyond, relief = max(abs(w[DP]) - b.most, 0.0), rated / (0.04 * b.most)
    w[CALM] += H / 0.1 * (w[DP] - w[CALM])
    damps, stiff = b.damper * rated / b.most, 1.0e9 / (2.0 * b.motor)
    g = rated * flow / (4.0 * b.rest_drop + 2.0 * abs(w[DP])) if got > 0.0 else 0.0
    net = sign * got * rated - d * w[TURN] - leak * w[DP] - damps * (w[DP] - w[CALM])
    net -= math.copysign(relief * beyond, w[DP])
    w[DP] += H * stiff * net / (1.0 + H * stiff * (g + leak + damps + (relief if beyond > 0.0 else 0.0)))
    return d * w[DP], over


@nb.njit(cache=True)
def supply_of(s: Array, drops: Array, aside: float, throttle: float, b: Build) -> None:
    """Move the reliefs of both pumps and the engine by the drops over the sections of a side [Pa] and what steering takes [W]."""
    work = aside
    for side in range(2):
        p = drops[side] + drops[2 + side]
        goal = min(max(s[ENGINE] * (p / b.most - 1.0) * 2.0, 0.0), 0.98 * s[ENGINE])
        s[SPILL_R + side] += H / 0.03 * (goal - s[SPILL_R + side])
        s[P_R + side] += H / 0.02 * (min(p, 1.2 * b.most) - s[P_R + side])
        work += b.motor * b.full / b.radius * s[ENGINE] * s[P_R + side]
    fuel = min(max((throttle * (1.0 + b.droop) - s[ENGINE]) / b.droop, 0.0), 1.15)
    s[ENGINE] = min(max(s[ENGINE] + H / b.governor * (fuel - work / b.power / max(s[ENGINE], 0.3) - 0.08), 0.35), 1.1)


@nb.njit(cache=True)
def turn_wheel(
    w: Array, part: Array, torque: float, pull: float, radius: float, load: float, shuts: float, b: Build
) -> None:
    """Move a wheel by its motor and its axle's lock, what the ground pulls [N], dry friction with more at rest, rolling and its brake."""
    w[BRAKE] = min(max(w[BRAKE] + (H / 0.2 if shuts > 0.0 else -H / part[RELEASE]), 0.0), 1.0)
    rub = part[RUB] * b.friction * (1.0 + b.stiction * math.exp(-((w[TURN] / 0.1) ** 2))) + 0.03 * abs(torque)
    rub += b.roll * load * radius + w[BRAKE] * 1.2 * b.motor * b.most
    push = torque - pull * radius - 0.2 * b.friction * w[TURN] * b.radius / b.top
    w[TURN] = dry(w[TURN], H / b.inertia * push, H / b.inertia * rub)
    w[ROLLED] += H * w[TURN]


@nb.njit(cache=True)
def count(w: Array, part: Array, counts: Array, k: int, b: Build) -> None:
    """Teeth of the last 10 ms, a bit of direction that follows after three of them, and a reading over the last windows."""
    tooth = math.floor(w[ROLLED] * b.radius / b.pitch)
    moved = tooth - w[TOOTH]
    w[TOOTH] = tooth
    if moved * w[BIT] < 0.0:
        w[AGAINST] += abs(moved)
        if w[AGAINST] >= 3.0:
            w[BIT], w[AGAINST] = -w[BIT], 0.0
    elif moved != 0.0:
        w[AGAINST] = 0.0
    counts[k % COUNTS] = w[BIT] * abs(moved)
    total = 0.0
    for j in range(b.windows):
        total += counts[(k - j) % COUNTS]
    w[READ] = total * b.pitch / (0.01 * b.windows) * part[SCALE]


@nb.njit(cache=True)
def steer(x: Array, want: float, hand: float, speed: float, load: float, s: Array, b: Build) -> float:
    """Move an axle's valve, its cylinder, which is slower to one side and where it stands, and the wheels behind play; return what it takes [W]."""
    x[A_VALVE] += H / b.steer_lag * (min(max(want, -1.0), 1.0) - x[A_VALVE])
    size = max(abs(x[A_VALVE]) - b.steer_dead, 0.0) / (1.0 - b.steer_dead)
    drag = min(b.scrub * load / (b.mass * 4.9), 0.7) / (1.0 + (speed / 0.15) ** 2)
    slower = 1.0 - math.copysign(b.asymmetry, hand * x[A_VALVE])
    rate = b.steer_rate * math.copysign(size, x[A_VALVE]) * slower * (1.0 - drag) * min(s[ENGINE] / 0.6, 1.0)
    x[ROD] = min(max(x[ROD] + H * rate, -b.stop), b.stop)
    x[ANGLE] = min(max(x[ANGLE], x[ROD] - b.play), x[ROD] + b.play)
    return 0.1 * b.power * abs(rate) / b.steer_rate


@nb.njit(cache=True)
def bump(x: float, y: float, field: Array, b: Build) -> float:
    """How much a pot hole or a clod holds a wheel at a place [of its load]."""
    return b.rough * max(math.sin(x / 0.5 + field[3]) * math.sin(y / 0.4 + field[4]) - 0.7, 0.0) / 0.3


@nb.njit(cache=True)
def loads_of(total: float, front: float, left: float, warp: float, out: Array) -> None:
    """Loads of the wheels [N] by shares of front and left, on ground that twists the frame by a share."""
    for i in range(4):
        share = (front if i < 2 else 1.0 - front) * (left if i % 2 else 1.0 - left)
        twist = warp if i in (0, 3) else -warp
        out[i] = total * 9.81 * min(max(share + 0.25 * twist, 0.03), 0.6)
