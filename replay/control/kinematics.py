"""Inverse kinematics: wheel speeds and steering angles of a commanded body motion, L1 (1) and L2 (2).

Readings of the printed text: the angle is taken along the direction in which the wheel rolls, so that reversing does
not turn the wheels round (φ = atan2(s·v_ky, s·v_kx), s = sgn(v_kx)), and ω_j of L1 is the yaw rate of the wheel frame,
ω_b + φ̇. Then v_c,i = s·|v_k| − (ω_b + φ̇)·d_i exactly. Where some wheels are not steered, v_c is the speed of the middle between
them: nothing else moves along the machine alone, as L1 supposes of its centre.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from replay.arrays.compiling import njit
from replay.machine.config import PhiDot
from replay.machine.geometry import Geometry, own_axle

_STANDSTILL = 1e-3


@dataclass(frozen=True)
class WheelCommands:
    """Commanded motion at the wheels.

    Attributes
    ----------
    speed : NDArray[np.float64], shape (n, wheels)
        v_c,i [m/s] in the order of the geometry's wheels.
    angle : NDArray[np.float64], shape (n, wheels)
        φ_c,i [rad].
    axle_angle : NDArray[np.float64], shape (n, axles)
        Direction of the velocity at the middle of each steered axle [rad].
    """

    speed: NDArray[np.float64]
    angle: NDArray[np.float64]
    axle_angle: NDArray[np.float64]


@dataclass
class CommandState:
    """What `wheel_commands` carries from block to block; empty before the first one.

    Attributes
    ----------
    held : dict[str, float]
        Last commanded angle of each wheel and axle [rad].
    source, rate : dict[str, float]
        Last angle whose derivative was taken [rad], and its low-passed derivative [rad/s], of each wheel.
    """

    held: dict[str, float] = field(default_factory=dict)
    source: dict[str, float] = field(default_factory=dict)
    rate: dict[str, float] = field(default_factory=dict)


def steering_angle(
    v_x: NDArray[np.float64], v_y: NDArray[np.float64], max_steer: float, held: float = 0.0
) -> NDArray[np.float64]:
    """Steering angle of a point that moves with (v_x, v_y): L2 (2) along the rolling direction.

    At standstill (|v| ≤ 1 mm/s, or NaN) the last angle is held; before any motion it is `held`.

    Parameters
    ----------
    v_x, v_y : NDArray[np.float64], shape (n,)
        Velocity of the joint in the body frame [m/s].
    max_steer : float
        The angle is clipped to ±max_steer [rad].
    held : float
        Last angle of the block before [rad].

    Returns
    -------
    NDArray[np.float64], shape (n,)
        φ_c [rad].
    """
    s = np.where(v_x < 0, -1.0, 1.0)
    angle = np.clip(np.arctan2(s * v_y, s * v_x), -max_steer, max_steer)
    moving = np.hypot(v_x, v_y) > _STANDSTILL
    last = np.maximum.accumulate(np.where(moving, np.arange(angle.size), -1))
    return np.where(last >= 0, angle[np.maximum(last, 0)], held)


def low_pass(x: NDArray[np.float64], dt: float, cutoff_hz: float, state: float = np.nan) -> NDArray[np.float64]:
    """First-order low-pass, started at the first sample or at the last output of the block before; NaN is passed over.

    Both of shape (n,); `dt` in s, `cutoff_hz` in Hz.
    """
    a = 1.0 - np.exp(-2 * np.pi * cutoff_hz * dt)
    return np.asarray(_scan_low_pass(x, a, state)[0])


@njit(cache=True)
def _scan_low_pass(x, a, state):  # type: ignore[no-untyped-def]
    """Filter y += a (x − y), returning the output and the state to carry on with."""
    out = np.empty(x.size)
    for k in range(x.size):
        if np.isnan(state):
            state = x[k]
        elif not np.isnan(x[k]):
            state += a * (x[k] - state)
        out[k] = state
    return out, state


def wheel_commands(
    v: NDArray[np.float64],
    omega: NDArray[np.float64],
    geometry: Geometry,
    *,
    dt: float,
    max_steer: float,
    phi_dot: PhiDot = "command",
    phi_dot_hz: float = 5.0,
    measured_angle: NDArray[np.float64] | None = None,
    state: CommandState | None = None,
) -> WheelCommands:
    """Map the commanded body motion to wheel speeds and steering angles: L1 (1), L2 (2).

    Parameters
    ----------
    v, omega : NDArray[np.float64], shape (n,)
        Commanded speed [m/s] and yaw rate [rad/s] of the body; NaN where unknown.
    geometry : Geometry
        Joint places, offsets and axles.
    dt : float
        Step [s].
    max_steer : float
        Limit of the steering angle [rad].
    phi_dot : str
        Source of φ̇: derivative of the commanded angle, of the measured one, or zero.
    phi_dot_hz : float
        Cut-off of the low-pass on φ̇ [Hz].
    measured_angle : NDArray[np.float64], shape (n, wheels), or None
        Measured φ_i [rad], for ``phi_dot="measured"``.
    state : CommandState or None
        Carried from the block before, and updated for the next one; None: a whole mission.
    """
    state = CommandState() if state is None else state
    angle = np.empty((v.size, len(geometry.wheels)))
    speed = np.empty(angle.shape)
    for i, (name, w) in enumerate(geometry.wheels.items()):
        v_x, v_y = v - omega * w.y, omega * (w.x - geometry.still_x)
        s = np.where(v_x < 0, -1.0, 1.0)
        if w.axle == "fixed":
            angle[:, i] = 0.0
            speed[:, i] = v_x - omega * w.offset
            continue
        angle[:, i] = steering_angle(v_x, v_y, max_steer, state.held.get(name, 0.0))
        state.held[name] = float(angle[-1, i])
        if phi_dot == "zero" or (phi_dot == "measured" and measured_angle is None):
            rate = np.zeros(v.size)
        else:
            source = angle[:, i] if measured_angle is None or phi_dot == "command" else measured_angle[:, i]
            rate = _angle_rate(name, source, dt, phi_dot_hz, state)
        # L1 (1): v_c,i = s·|v_k| − (ω_b + φ̇)·d_i
        speed[:, i] = s * np.hypot(v_x, v_y) - (omega + rate) * w.offset
    return WheelCommands(speed, angle, _axle_angles(v, omega, geometry, max_steer, state))


def _angle_rate(
    wheel: str, angle: NDArray[np.float64], dt: float, cutoff_hz: float, state: CommandState
) -> NDArray[np.float64]:
    """φ̇ [rad/s], low-passed, of a wheel's angle φ [rad]; the state is carried on."""
    before = state.source.get(wheel, float(angle[0]))
    rate = low_pass(np.diff(angle, prepend=before) / dt, dt, cutoff_hz, state.rate.get(wheel, np.nan))
    state.source[wheel], state.rate[wheel] = float(angle[-1]), float(rate[-1])
    return rate


def _axle_angles(
    v: NDArray[np.float64], omega: NDArray[np.float64], geometry: Geometry, max_steer: float, state: CommandState
) -> NDArray[np.float64]:
    """Direction of the velocity at the middle of each steered axle [rad], shape (n, axles); the state is carried on."""
    out = np.empty((v.size, len(geometry.axles)))
    for j, axle in enumerate(geometry.axles):
        x = geometry.axle_x(axle) - geometry.still_x
        y = next((w.y for name, w in geometry.wheels.items() if axle == own_axle(name)), 0.0)
        key = f"axle {axle}"
        out[:, j] = steering_angle(v - omega * y, omega * x, max_steer, state.held.get(key, 0.0))
        state.held[key] = float(out[-1, j])
    return out


def rotation(axle_angle: NDArray[np.float64], geometry: Geometry) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Centre of rotation that the steering angles ask for: curvature ω/v_bx [1/m] and side slip v_by/v_bx [1].

    An axle's angle is the direction of the velocity at (x_A, 0); two axle angles fix the centre of rotation. With one
    steered axle the unsteered wheels' axis takes the place of the second.

    Parameters
    ----------
    axle_angle : NDArray[np.float64], shape (n, axles)
        In the order of ``geometry.axles`` [rad].

    Returns
    -------
    curvature, lateral : NDArray[np.float64], shape (n,)
        Zero where the geometry has no shared axle.
    """
    axles = geometry.axles
    n = axle_angle.shape[0]
    places = [(geometry.axle_x(a), np.tan(axle_angle[:, axles.index(a)])) for a in axles if a in ("front", "rear")]
    fixed = [w.x for w in geometry.wheels.values() if w.axle == "fixed"]
    if len(places) == 1:
        places.append((float(np.mean(fixed)) if fixed else 0.0, np.zeros(n)))
    if len(places) < 2 or places[0][0] == places[1][0]:
        return np.zeros(n), np.zeros(n)
    # at (x, 0): v_y/v_x = (v_by + ω x)/v_bx = tan φ
    curvature = np.asarray((places[0][1] - places[1][1]) / (places[0][0] - places[1][0]))
    return curvature, np.asarray(places[0][1] - curvature * places[0][0])


def wheel_angles(axle_angle: NDArray[np.float64], geometry: Geometry) -> NDArray[np.float64]:
    """Angle of each wheel from the measured axle angles; see `rotation`.

    Parameters
    ----------
    axle_angle : NDArray[np.float64], shape (n, axles)
        In the order of ``geometry.axles`` [rad].

    Returns
    -------
    NDArray[np.float64], shape (n, wheels)
        φ_i [rad].
    """
    out = np.zeros((axle_angle.shape[0], len(geometry.wheels)))
    curvature, lateral = rotation(axle_angle, geometry)
    for i, (name, w) in enumerate(geometry.wheels.items()):
        if w.axle == own_axle(name):
            out[:, i] = axle_angle[:, geometry.axles.index(w.axle)]
        elif w.axle != "fixed":
            out[:, i] = np.arctan((lateral + curvature * w.x) / (1.0 - curvature * w.y))
    return out


def speed_ratios(axle_angle: NDArray[np.float64], geometry: Geometry) -> NDArray[np.float64]:
    """Wheel speed per forward speed of the body without slip, the angles held: s·|v_k|/v_bx − κ·d_i by L1 (1).

    Parameters
    ----------
    axle_angle : NDArray[np.float64], shape (n, axles)
        Measured axle angles [rad].

    Returns
    -------
    NDArray[np.float64], shape (n, wheels)
        Ratios [1]; all 1 straight ahead.
    """
    curvature, lateral = rotation(axle_angle, geometry)
    out = np.empty((axle_angle.shape[0], len(geometry.wheels)))
    for i, w in enumerate(geometry.wheels.values()):
        k_x, k_y = 1.0 - curvature * w.y, lateral + curvature * w.x
        rolling = k_x if w.axle == "fixed" else np.sign(k_x) * np.hypot(k_x, k_y)
        out[:, i] = rolling - curvature * w.offset
    return out


def commands_by_angles(
    phi_ref: NDArray[np.float64], phi: NDArray[np.float64], v: NDArray[np.float64], geometry: Geometry
) -> NDArray[np.float64]:
    """Commanded wheel speeds of a machine for which no yaw rate is commanded [m/s], shape (n, wheels): `speed_ratios` times the body's.

    NaN where no shared axle is steered, but for wheels on the middle line, which go as the body does.

    Parameters
    ----------
    phi_ref, phi : NDArray[np.float64], shape (n, axles)
        Commanded angles, taken where they are known, and measured ones [rad].
    v : NDArray[np.float64], shape (n,)
        Commanded speed of the body [m/s].
    """
    if not set(geometry.axles) & {"front", "rear"}:
        middle = np.array([w.axle == "fixed" and w.y == 0.0 for w in geometry.wheels.values()])
        return np.where(middle, v[:, np.newaxis], np.nan)
    return v[:, np.newaxis] * speed_ratios(np.where(np.isfinite(phi_ref), phi_ref, phi), geometry)
