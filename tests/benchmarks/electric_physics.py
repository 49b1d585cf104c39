"""What `electric.py` moves: motors, drive lines, tyres, ground, electric steering cylinders and the body, in SI units, step by step.

Written from first principles: current loop and field weakening of permanent-magnet motors, i²-heating and derating, gears with
play and Stribeck friction on elastic shafts, tyres by Burckhardt's slip curve with a relaxation length, worm gears that lock.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numba as nb
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
H = 0.0005
#: State of a wheel's drive: current [of full], rotor and wheel [rad/s at the wheel], twist [rad], ways of both [m at the nominal
#: rim], deflections of the tyre [m], temperature [of the limit], room for torque [of full], own integral, command, loss of slip.
IQ, ROTOR, WHEEL, TWIST, ROLLED, HUB, ZX, ZY, HEAT, ROOM, TOTAL, ASKED = range(12)
#: What differs between wheels: radius [m], torque constant, friction, ripple, current sensor's gain and zero.
RADIUS, CONSTANT, RUB, RIPPLE, GAIN, ZERO = range(6)


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
    torque: float
    knee: float
    fastest: float
    lag: float
    poles: float
    heating: float
    sag: float
    rotor: float
    wheel: float
    shaft: float
    damping: float
    play: float
    friction: float
    stiction: float
    stribeck: float
    viscous: float
    gear_loss: float
    relaxation: float
    grip: float
    slope: float
    roll: float
    hills: float
    waves: float
    ramp: float
    brake_ramp: float
    jerk: float
    shared: bool
    proportional: float
    integral: float
    leak: float
    known_mass: float
    known_roll: float
    tilt: float
    slew: float
    reading_lag: float
    quantum_v: float
    quantum_u: float
    pitch: float
    hub_pitch: float
    tick: float
    uneven: float
    ackermann: float
    steer_rate: float
    steer_gain: float
    steer_lag: float
    steer_droop: float
    steer_play: float
    tolerance: float
    inside: bool
    rear: float


@nb.njit(cache=True)
def dry(speed: float, push: float, most: float) -> float:
    """Speed after a step's push against dry friction, which takes `most` of it at most and never turns it round."""
    speed += push
    return 0.0 if abs(speed) <= most else speed - math.copysign(most, speed)


@nb.njit(cache=True)
def motor(w: Array, part: Array, want: float, volts: float, b: Build) -> float:
    """Move a motor's current and temperature by a torque asked for (−1 … 1); return its torque at the wheel [N·m]."""
    size = abs(w[ROTOR])
    hot = min(max((1.15 - w[HEAT]) / 0.25, 0.35), 1.0)
    weak = min(1.0, b.knee * volts / max(size, 1e-6))
    over = min(max((b.fastest * volts - size) / (0.08 * b.fastest), 0.0), 1.0)
    w[ROOM] = hot * weak
    room = w[ROOM] * (over if want * w[ROTOR] > 0 else 1.0)
    goal = min(max(want, -room), room)
    w[IQ] += (goal - w[IQ]) * H / b.lag
    w[HEAT] += H / 150.0 * (b.heating * w[IQ] ** 2 + 0.25 - w[HEAT])
    turned = w[ROLLED] / b.radius
    ripple = 1.0 + part[RIPPLE] * (0.6 * math.sin(b.poles * turned) + 0.4 * math.sin(6.0 * b.poles * turned))
    return b.torque * part[CONSTANT] * (w[IQ] * ripple + 0.15 * part[RIPPLE] * math.sin(3.0 * b.poles * turned))


@nb.njit(cache=True)
def drive_line(w: Array, part: Array, torque: float, brake: float, b: Build) -> float:
    """Move the rotor against its gear's friction and brake; return the torque of the shaft, whose gear has play [N·m]."""
    inside = min(max(w[TWIST], -b.play), b.play)
    wound = w[TWIST] - inside
    shaft = 0.0
    if wound != 0.0:
        shaft = b.shaft * wound + b.damping * (w[ROTOR] - w[WHEEL])
        if shaft * wound < 0.0:
            shaft = 0.0
    slow = math.exp(-((w[ROTOR] / b.stribeck) ** 2))
    rub = part[RUB] * b.friction * (1.0 + (b.stiction - 1.0) * slow) + b.gear_loss * abs(shaft)
    push = torque - shaft - part[RUB] * b.viscous * w[ROTOR]
    w[ROTOR] = dry(w[ROTOR], H / b.rotor * push, H / b.rotor * (rub + brake * 1.6 * b.torque))
    w[TWIST] += H * (w[ROTOR] - w[WHEEL])
    w[ROLLED] += H * w[ROTOR] * b.radius
    return shaft


@nb.njit(cache=True)
def grip_of(slip: float, soft: float, slick: float, b: Build) -> float:
    """Burckhardt's curve of friction over slip; soft ground flattens it, a slick one lowers it."""
    c1 = b.grip * (1.0 - 0.35 * soft) * (1.0 - 0.6 * slick)
    c2 = b.slope * (1.0 - 0.6 * soft) * (1.0 + slick)
    return c1 * (1.0 - math.exp(-c2 * slip)) - 0.25 * c1 * slip * (1.0 - soft)


@nb.njit(cache=True)
def tyre(
    w: Array, part: Array, along: float, across: float, load: float, soft: float, slick: float, b: Build
) -> tuple[float, float]:
    """Forces of a tyre [N], forward and to the left of its wheel, whose contact moves by `along` and `across` [m/s]."""
    rim = w[WHEEL] * part[RADIUS]
    slip, side, roll = rim - along, -across, abs(rim) / b.relaxation
    w[ZX] = min(max(w[ZX] + H * (slip - roll * w[ZX]), -b.relaxation), b.relaxation)
    w[ZY] = min(max(w[ZY] + H * (side - roll * w[ZY]), -b.relaxation), b.relaxation)
    kx, ky = w[ZX] / b.relaxation + 0.025 * slip, w[ZY] / b.relaxation + 0.025 * side
    size = min(math.hypot(kx, ky), 1.0)
    if size < 1e-9:
        return 0.0, 0.0
    force = load * grip_of(size, soft, slick, b) / math.hypot(kx, ky)
    return force * kx, 0.85 * force * ky


@nb.njit(cache=True)
def turn(w: Array, part: Array, shaft: float, force: float, load: float, soft: float, b: Build) -> None:
    """Move a wheel by its shaft and its tyre, against the rolling resistance; a heavy wheel sinks deeper into soft ground."""
    sunk = 0.10 * soft * math.sqrt(load / (b.mass * 9.81 / 4))
    rest = (b.roll + sunk) * load * part[RADIUS]
    w[WHEEL] = dry(w[WHEEL], H / b.wheel * (shaft - force * part[RADIUS]), H / b.wheel * rest)
    w[HUB] += H * w[WHEEL] * b.radius


@nb.njit(cache=True)
def steer(axle: Array, want: float, speed: float, supply: float, b: Build) -> None:
    """Move an axle (motor's speed of full, rod [rad], angle [rad]): a worm that nothing turns back, a clutch at its end, play."""
    axle[0] += min(max((want - axle[0]) * H / b.steer_lag, -6.0 * H), 6.0 * H)
    scrub = b.steer_droop * (0.4 + 0.6 * math.exp(-abs(speed) / 0.2))
    axle[1] = min(max(axle[1] + H * b.steer_rate * axle[0] * (1.0 - scrub) * supply, -0.55), 0.55)
    axle[2] = min(max(axle[2], axle[1] - b.steer_play), axle[1] + b.steer_play)


@nb.njit(cache=True)
def angle_of(axle: float, x: float, y: float, b: Build) -> float:
    """Angle of a wheel by that of its axle [rad]: the linkage gives the inner wheel some of what Ackermann asks for."""
    exact = math.atan(math.tan(axle) / (1.0 - y * math.tan(axle) / x))
    return axle + b.ackermann * (exact - axle)


@nb.njit(cache=True)
def loads_of(ax: float, ay: float, warp: float, b: Build, out: Array) -> None:
    """Loads of the wheels [N] under accelerations that springs feel [m/s²], slopes among them, on ground that twists the frame."""
    ahead = 0.5 + b.cg - b.height / b.base * ax / 9.81
    left = 0.5 - b.height / b.track * ay / 9.81
    for i in range(4):
        share = (ahead if i < 2 else 1.0 - ahead) * (left if i % 2 else 1.0 - left)
        share += (warp if i in (0, 3) else -warp) * 0.25
        out[i] = b.mass * 9.81 * min(max(share, 0.03), 0.6)


@nb.njit(cache=True)
def rise_of(x: float, y: float, b: Build) -> tuple[float, float]:
    """Slope of the ground along x and y."""
    return (
        b.hills * (0.7 * math.cos(x / b.waves + 0.6) + 0.3 * math.cos(2.7 * x / b.waves + y / b.waves)),
        b.hills * 0.6 * math.cos(y / b.waves + 1.9),
    )
