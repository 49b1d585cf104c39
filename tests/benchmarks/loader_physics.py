"""What `loader.py` moves: banks of on/off valves, a load-sensing pump, an engine that labours, tyres of unequal size and a pile, in SI units.

Written from first principles: a bank has valves of 8, 4, 2 and 1 sixteenths and one more sixteenth that is switched on for a share of a period;
each switches late, more so in cold oil, and a valve for the direction as well, while which the bank is shut. What flows goes by the root of
the pressure that is left, with a compensator or without; two frames turn about pivots ahead of and behind the engine.
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
STEPS = 16.0
#: State of a wheel: pressure across its motor [Pa], size of the motor (share), speed [rad/s], way [rad], deflections of the tyre [m], edge,
#: times of its last edges [s], size that the teeth tell [m/s], sign that it is given, integral of its law, command, drop at its bank that the
#: controller measures [of the margin], pressure behind the motor's damper [Pa].
DP, SIZE, TURN, ROLLED, ZX, ZY, EDGE, SINCE, BEFORE, RATE, SIGN, TOTAL, ASKED, SEEN, CALM = range(15)
#: What differs between wheels: radius without load [m], flow ahead and back, leakage, friction, time that its motor takes to change
#: its size [s], eccentricity of the toothed wheel [rad], scale of the reading.
RADIUS, PLUS, MINUS, LEAK, RUB, SHIFT, WAVE, SCALE = range(8)
#: State of a bank: direction, the one that it goes to, time left for it [s], sum of open valves; then of five valves state, goal, time left.
WAY, GOES, LEFT, OPEN, VALVES = range(5)
#: State of a frame: speed of the cylinder [rad/s], cylinder [rad], angle [rad].
ROD_V, ROD, ANGLE = range(3)
#: State of the supply: pressure [Pa], highest load as the pump hears it [Pa], speed of the engine [of rated], oil [°C].
P, HEARD, ENGINE, OIL = range(4)


class Build(NamedTuple):
    """What a seed draws; `half`: from the pivot's middle to a wheel [m]; `inset`: of the pivot [m]; `delay` [s]: at 60 °C; `dig`: a pile's force [of the weight]."""

    top: float
    cycle: int
    mass: float
    height: float
    cg: float
    radius: float
    sink: float
    half: float
    base: float
    inset: float
    inertia: float
    motor: float
    small: float
    flow: float
    compensated: bool
    pump: float
    margin: float
    most: float
    heard_lag: float
    bleeds: float
    leakage: float
    damper: float
    friction: float
    stiction: float
    power: float
    droop: float
    governor: float
    idle: float
    limits: bool
    lift_flow: float
    cold: float
    warming: float
    delay: float
    off: float
    period: float
    turns_delay: float
    forward: float
    proportional: float
    integral: float
    ramp: float
    teeth: float
    tick: float
    wait: float
    grip: float
    stiffness: float
    relaxation: float
    roll: float
    mud: float
    hill: float
    hill_length: float
    dig: float
    pile: float
    coupled: float
    steer_rate: float
    steer_gain: float
    asymmetry: float
    play: float
    stop: float
    tolerance: float


@nb.njit(cache=True)
def late(oil: float, b: Build) -> float:
    """How long a valve takes to open [s]: up to twice as long in cold oil, 15 to 40 ms in all."""
    return min(max(b.delay * (1.0 + 0.02 * (60.0 - oil)), 0.015), 0.04)


@nb.njit(cache=True)
def bank(x: Array, want: float, now: float, oil: float, weights: Array, b: Build) -> float:
    """Switch a bank by what it is told (−1 … 1); return its opening. `weights`: of its valves, of which the last is modulated."""
    wait = late(oil, b)
    steps = min(abs(want), 1.0) * STEPS
    way = x[WAY] if steps < 0.02 else math.copysign(1.0, want)
    if way != x[GOES]:
        x[GOES], x[LEFT] = way, b.turns_delay * wait
    if x[WAY] != x[GOES]:
        x[LEFT] -= H
        steps = 0.0
        if x[LEFT] <= 0.0:
            x[WAY] = x[GOES]
    code = min(int(steps), 15)
    share = steps - code
    if share * b.period < 0.7 * wait:
        share = 0.0
    elif (1.0 - share) * b.period < 0.7 * wait:
        share = 1.0
    total = 0.0
    for j in range(5):
        on = (code >> (3 - j)) & 1 == 1 if j < 4 else (now / b.period) % 1.0 < share
        goal, k = (1.0 if on else 0.0), VALVES + 3 * j
        if goal != x[k + 1]:
            x[k + 1], x[k + 2] = goal, wait * (1.0 if on else b.off)
        if x[k] != x[k + 1]:
            x[k + 2] -= H
            if x[k + 2] <= 0.0:
                x[k] = x[k + 1]
        total += weights[j] * x[k]
    x[OPEN] = x[WAY] * total / STEPS
    return x[OPEN]


@nb.njit(cache=True)
def motor(w: Array, part: Array, edge: float, s: Array, size: float, b: Build) -> tuple[float, float, float]:
    """Move the pressure across a motor by its bank's opening; return its torque [N·m], the flow taken [m³/s], the load that it reports [Pa]."""
    w[SIZE] += H / part[SHIFT] * (size - w[SIZE])
    d, sign = b.motor * w[SIZE], 1.0 if edge > 0.0 else -1.0
    load = max(sign * w[DP], 0.0)
    spare = max((s[P] - load) / b.margin, 0.0)
    drop = min(spare, 1.0 + 0.04 * (spare - 1.0)) if b.compensated else spare
    w[SEEN] += H / 0.08 * (drop - w[SEEN])
    full = (part[PLUS] if edge > 0.0 else part[MINUS]) * b.flow * abs(edge)
    q = full * math.sqrt(drop)
    g = full / (2.0 * math.sqrt(max(drop, 0.02)) * b.margin) if spare < 1.0 or not b.compensated else 0.0
    leak = b.leakage * part[LEAK] * math.exp(0.02 * (s[OIL] - 45.0))
    over, relief = max(abs(w[DP]) - b.most, 0.0), b.flow / (0.04 * b.most)
    stiff = 1.0e9 / (1.5 * b.motor)
    w[CALM] += H / 0.1 * (w[DP] - w[CALM])
    damps = b.damper * b.flow / b.most  # an orifice across the motor, with a volume behind it
    net = sign * q - d * w[TURN] - leak * w[DP] - damps * (w[DP] - w[CALM]) - math.copysign(relief * over, w[DP])
    w[DP] += H * stiff * net / (1.0 + H * stiff * (g + leak + damps + (relief if over > 0.0 else 0.0)))
    return d * w[DP], q, load if edge != 0.0 else 0.0


@nb.njit(cache=True)
def supply_of(s: Array, first: float, taken: float, asks: float, throttle: float, b: Build) -> None:
    """Move pump, engine and oil by what steering and lift (`first`) and wheels take [m³/s] and the highest load [Pa].

    The pump gives no more pressure than its cut-off and no more power than its limit; the engine droops where both are high.
    """
    s[HEARD] += (
        H / (b.heard_lag if asks > s[HEARD] else b.bleeds) * (asks - s[HEARD])
    )  # a line that bleeds by an orifice
    goal = min(s[HEARD] + b.margin, b.most + b.margin)
    most = b.pump * s[ENGINE]
    if b.limits:
        most = min(most, 0.95 * b.power * s[ENGINE] / max(s[P], 1e6))
    room = (most - first - taken) * 1.0e9 / (10.0 * b.motor)
    s[P] = max(s[P] + H * min((goal - s[P]) / 0.03, room), 1e5)
    work = (first + taken) * s[P] / b.power / max(s[ENGINE], 0.3)
    fuel = min(max((throttle * (1.0 + b.droop) - s[ENGINE]) / b.droop, 0.0), 1.15)
    s[ENGINE] = min(max(s[ENGINE] + H / b.governor * (fuel - work - 0.1), 0.3), 1.1)
    s[OIL] += H / b.warming * (30.0 * min(work, 1.2) + b.cold + 15.0 - s[OIL])


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
    slip, rolled, end = (
        rim - along,
        (abs(rim) + abs(along)) / 2.0 / b.relaxation,
        3.0 * grip / b.stiffness * b.relaxation,
    )
    w[ZX] = min(max(w[ZX] + H * (slip - rolled * w[ZX]), -end), end)
    w[ZY] = min(max(w[ZY] + H * (-across - rolled * w[ZY]), -end), end)
    kx, ky = w[ZX] / b.relaxation + 0.06 * slip, 0.8 * (w[ZY] / b.relaxation - 0.06 * across)
    size = math.hypot(kx, ky)
    if size < 1e-9:
        return 0.0, 0.0
    force = load * grip * math.sin(1.35 * math.atan(b.stiffness * size / (1.35 * grip))) / size
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
def pile_force(depth: float, mass: float, b: Build) -> float:
    """What a heap of logs or gravel holds against the bucket [N], that is so deep in it [m]."""
    return b.dig * mass * 9.81 * min(max(depth, 0.0) / b.pile, 1.0) ** 1.3


@nb.njit(cache=True)
def fold(x: Array, edge: float, hand: float, speed: float, load: float, s: Array, left: float, b: Build) -> float:
    """Move a frame's cylinder by its bank's opening, slower to one side, and the frame behind play; return the flow taken [m³/s].

    `left`: share of the steering flow that the other frame leaves.
    """
    slower = 1.0 - math.copysign(b.asymmetry, hand * edge)
    scrub = 1.0 - min(0.3 * load / (b.mass * 4.9), 0.5) / (1.0 + (speed / 0.3) ** 2)
    rate = b.steer_rate * slower * edge * scrub * min(s[ENGINE] / 0.4, 1.0) * left
    x[ROD_V] += H / 0.05 * (rate - x[ROD_V])
    x[ROD] = min(max(x[ROD] + H * x[ROD_V], -b.stop), b.stop)
    x[ANGLE] = min(max(x[ANGLE], x[ROD] - b.play), x[ROD] + b.play)
    return 0.12 * b.pump * abs(rate) / b.steer_rate


@nb.njit(cache=True)
def toothed(w: Array, part: Array, now: float, b: Build) -> None:
    """Time teeth that pass, in ticks of a counter; it tells no direction, and slow turning late; below a tooth in `wait` it reads nothing."""
    teeth = (w[ROLLED] + part[WAVE] * math.sin(w[ROLLED])) * b.teeth / (2.0 * math.pi)
    pitch = 2.0 * math.pi / b.teeth * b.radius * part[SCALE]
    moved = math.floor(teeth) - w[EDGE]
    if moved != 0.0:
        beyond = teeth - math.floor(teeth) if moved > 0.0 else math.floor(teeth) + 1.0 - teeth
        when = now - min(beyond / max(abs(w[TURN]) * b.teeth / (2.0 * math.pi), 1e-3), H)
        period = max(math.floor((when - w[SINCE]) / b.tick + 0.5) * b.tick, H)
        w[RATE] = min(abs(moved) * pitch / period, 2.0 * b.top)
        w[EDGE], w[BEFORE], w[SINCE] = math.floor(teeth), w[SINCE], when
    w[RATE] = min(w[RATE], 1.3 * pitch / max(now - w[SINCE], H))
    if now - w[SINCE] > b.wait:
        w[RATE] = 0.0
