"""What `tug.py` moves: wheel motors that hold speeds by themselves, a battery that sags, soft tyres and a towed mass, in SI units.

Written from first principles: an inverter follows a speed that it is told and droops with its torque, by an integral on its own
resolver or by the slip of an induction motor that it compensates for in part; what it can give falls with speed, voltage and heat,
and what it can take back by what the battery takes; an aircraft hangs on a bar that has play and rings.
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
#: State of a wheel: speed that its inverter follows [of full], its integral, torque [of full], torque behind the slip's filter, heat [of
#: the limit], speed [rad/s], way [rad], deflections of the tyre [m], angle and speed that its sensor's loop tracks [rad, rad/s], trim of
#: the controller, command, reading [m/s], whether the inverter is at its limit.
SET, INNER, TORQUE, SLOW, HEAT, TURN, ROLLED, ZX, ZY, TRACK, TRACK_V, TRIM, ASKED, READ, LIMITED = range(15)
#: What differs between wheels: radius without load [m], torque constant, friction, scale of the inverter's speed, errors of the angle
#: sensor once and twice a turn [rad], scale of the reading, phase of these errors [rad].
RADIUS, CONSTANT, RUB, OWN, ONCE, TWICE, SCALE, PHASE = range(8)
#: State of an axle's steering: speed of its motor [of full], rod [rad], angle [rad].
A_MOTOR, ROD, ANGLE = range(3)
#: State of the source and the tow: voltage [of rated], charge (share), speed of the aircraft [m/s], stretch of the bar [m].
VOLTS, CHARGE, TOWED, STRETCH = range(4)


class Build(NamedTuple):
    """What a seed draws; `full` [rad/s]: at a command of 1; `slips`: an induction motor without resolver; `regen`: share of power taken back."""

    top: float
    cycle: int
    mass: float
    height: float
    cg: float
    radius: float
    sink: float
    lateral: float
    base: float
    track: float
    inertia: float
    torque: float
    full: float
    knee: float
    slips: bool
    rated: float
    droop: float
    compensated: float
    stiff: float
    restore: float
    inner_slew: float
    lag: float
    heating: float
    charge: float
    sag: float
    regen: float
    friction: float
    stiction: float
    roll: float
    bar: float
    bar_damping: float
    bar_play: float
    towed_roll: float
    grip: float
    stiffness: float
    relaxation: float
    slick: float
    hill: float
    hill_length: float
    bandwidth: float
    quantum: float
    ramp: float
    tow_ramp: float
    forward: float
    integral: float
    cap: float
    ackermann: float
    steer_rate: float
    steer_gain: float
    steer_lag: float
    scrub: float
    play: float
    stop: float
    tolerance: float
    angle_quantum: float


@nb.njit(cache=True)
def motor(w: Array, part: Array, want: float, volts: float, takes: float, b: Build) -> float:
    """Move an inverter and its motor by the speed that it is told (−1 … 1); return the torque [N·m]. `takes`: share of torque for braking."""
    w[SET] += min(max(want - w[SET], -b.inner_slew * H), b.inner_slew * H)
    goal = w[SET] * b.full * part[OWN]
    size = abs(w[TURN]) / b.full
    weak = min(1.0, b.knee * volts / max(size, 1e-6))
    weak *= min(1.0, 1.7 * b.knee * volts / max(size, 1e-6))  # beyond, by the square
    room = weak * min(max((1.2 - w[HEAT]) / 0.2, 0.5), 1.0)
    if b.slips:
        w[SLOW] += H / 0.15 * (w[TORQUE] - w[SLOW])
        asks = ((goal - w[TURN]) / b.full + b.compensated * b.rated * w[SLOW]) / b.rated
    else:
        wrong = (goal - w[TURN]) / b.full - b.droop * w[TORQUE]
        asks = b.stiff * wrong + w[INNER]
        if abs(asks) < room or wrong * w[INNER] < 0.0:
            w[INNER] += H * b.restore * wrong
        if want == 0.0 and size < 0.002:
            w[INNER] -= H / 0.5 * w[INNER]
    most = room * (takes if asks * w[TURN] < 0.0 else 1.0)
    w[LIMITED] = 1.0 if abs(asks) >= most else 0.0
    w[TORQUE] += H / b.lag * (min(max(asks, -most), most) - w[TORQUE])
    w[HEAT] += H / 60.0 * (b.heating * w[TORQUE] ** 2 + 0.3 - w[HEAT])
    return b.torque * part[CONSTANT] * w[TORQUE]


@nb.njit(cache=True)
def source(s: Array, power: float, b: Build) -> float:
    """Move the battery by the motors' power [of all at full torque and the knee]; return the share of torque that braking may have."""
    s[CHARGE] = min(max(s[CHARGE] - H * power / 2500.0, 0.05), 1.0)
    s[VOLTS] += H / 0.05 * (0.9 + 0.1 * s[CHARGE] - b.sag * power - s[VOLTS])
    return min(max((1.04 - s[VOLTS]) / 0.04, 0.15), 1.0) * b.regen


@nb.njit(cache=True)
def rolls_at(part: Array, load: float, b: Build) -> float:
    """Radius that a wheel rolls at under its load [m]."""
    return part[RADIUS] - b.sink / 3.0 * load / (b.mass * 9.81 / 4.0)


@nb.njit(cache=True)
def tyre(
    w: Array, radius: float, along: float, across: float, load: float, grip: float, b: Build
) -> tuple[float, float]:
    """Forces of a tyre [N], forward and left; its deflections relax with the way rolled and never hold more than grip does."""
    slip, rolled = w[TURN] * radius - along, abs(w[TURN] * radius) / b.relaxation
    w[ZX] += H * (slip - rolled * w[ZX])
    w[ZY] += H * (-across - rolled * w[ZY])
    kx, ky = w[ZX] / b.relaxation, w[ZY] / b.relaxation
    size = math.hypot(kx, ky)
    most = 2.5 * grip / b.stiffness
    if size > most:
        w[ZX], w[ZY] = w[ZX] * most / size, w[ZY] * most / size
        kx, ky = kx * most / size, ky * most / size
    kx, ky = kx + 0.04 * slip, ky - 0.04 * across
    size = math.hypot(kx, ky)
    if size < 1e-9:
        return 0.0, 0.0
    force = load * grip * math.tanh(b.stiffness * size / grip) / size
    return force * kx, 0.9 * force * ky


@nb.njit(cache=True)
def turn_wheel(
    w: Array, part: Array, torque: float, pull: float, radius: float, load: float, brake: float, b: Build
) -> None:
    """Move a wheel by its motor, what the ground pulls [N], dry friction with more at rest, rolling resistance and the parking brake."""
    rub = part[RUB] * b.friction * (1.0 + b.stiction * math.exp(-((w[TURN] / 0.1) ** 2)))
    rub += b.roll * load * radius + brake * 1.2 * b.torque
    push = torque - pull * radius - 0.3 * b.friction * w[TURN] / b.full
    w[TURN] = dry(w[TURN], H / b.inertia * push, H / b.inertia * rub)
    w[ROLLED] += H * w[TURN]


@nb.njit(cache=True)
def sensor(w: Array, part: Array, b: Build) -> float:
    """Track a magnet's angle, whose errors turn with the wheel, by a loop of second order; return its speed [m/s]."""
    seen = w[ROLLED] + part[ONCE] * math.sin(w[ROLLED] + part[PHASE]) + part[TWICE] * math.sin(2.0 * w[ROLLED])
    wrong = seen - w[TRACK]
    w[TRACK_V] += H * b.bandwidth**2 * wrong
    w[TRACK] += H * (w[TRACK_V] + 1.4 * b.bandwidth * wrong)
    return w[TRACK_V] * b.radius * part[SCALE]


@nb.njit(cache=True)
def steer(x: Array, want: float, speed: float, load: float, volts: float, b: Build) -> None:
    """Move an axle's motor, its spindle, which nothing turns back, and wheels behind play; slower where the machine stands and is heavy there."""
    x[A_MOTOR] += H / b.steer_lag * (min(max(want, -1.0), 1.0) - x[A_MOTOR])
    drag = b.scrub * load / (b.mass * 4.9) / (1.0 + (speed / 0.15) ** 2)
    x[ROD] = min(max(x[ROD] + H * b.steer_rate * x[A_MOTOR] * max(1.0 - drag, 0.1) * volts, -b.stop), b.stop)
    x[ANGLE] = min(max(x[ANGLE], x[ROD] - b.play), x[ROD] + b.play)


@nb.njit(cache=True)
def tow(s: Array, speed: float, mass: float, rise: float, b: Build) -> float:
    """Move an aircraft on its bar; return its pull on the machine [N], backward where negative. `rise`: slope that it stands on."""
    if mass <= 0.0:
        s[TOWED], s[STRETCH] = speed, 0.0
        return 0.0
    s[STRETCH] += H * (speed - s[TOWED])
    beyond = s[STRETCH] - min(max(s[STRETCH], -b.bar_play), b.bar_play)
    force = 0.0
    if beyond != 0.0:
        force = b.bar * beyond + b.bar_damping * (speed - s[TOWED])
        if force * beyond < 0.0:
            force = 0.0
    push = H * (force / (mass * b.mass) - 9.81 * rise)
    s[TOWED] = dry(s[TOWED], push, H * 9.81 * b.towed_roll)
    return -force
