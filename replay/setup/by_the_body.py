"""Wheel radius, track and wheelbase by what measures the body itself: odometry or GNSS beside the wheels, the yaw rate beside the two sides or the steering."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from replay.log.source_options import SignalSource
from replay.machine.geometry import WheelGeometry
from replay.machine.quantities import UNITS
from replay.machine.units import known_unit
from replay.setup.motion import held
from replay.signals.signal import Signal, Signals
from replay.signals.steering_command import is_steering_command

Array = NDArray[np.float64]

_STEP_S = 0.1
_MOST_S = 0.5  # by which one channel may come later than the other
_LEAST_S = 10.0  # of motion
_MOVES = 0.2  # of the largest speed
_TRIMMED = 0.2  # of the moments are left out that fit worst, twice: slip, faults, jumps of a position
_SOUND = 0.95  # share of the rest that the fit must explain
_SHORT_S, _EXACT = 3.0, 0.998  # of less motion, which only odometry made of the wheels explains so well
_SPEEDS = (("odom.v", "odometry"), ("gnss.speed", "the speed over ground"))


class Measured(NamedTuple):
    """A length [m] and what it is by."""

    length: float
    by: str


def radius_by_body(
    found: Signals, wheels: Sequence[str], fixed: Sequence[str], origins: Mapping[str, SignalSource]
) -> Measured | None:
    """Wheel radius that makes the mean of the wheels the measured speed of the body; None where nothing measures it.

    Odometry that the robot computes from its wheels tells the radius that its own software has.

    Parameters
    ----------
    found : Signals
        With rotations of the wheels in rad/s.
    wheels, fixed : Sequence[str]
        Wheels whose rotation is known, and those of them that no axle steers, which are preferred.
    origins : Mapping[str, SignalSource]
        Of all signals, with a negative gain where a wheel counts backwards.
    """
    names = [f"wheel.{w}.v" for w in (fixed or wheels) if f"wheel.{w}.v" in found.items]
    for name, by in _SPEEDS:
        body = found.items.get(name)
        if body is None or not names:
            continue
        at = moments([*(found.items[n] for n in names), body])
        mean = np.mean([forward(found.items[n], origins, at) for n in names], axis=0)
        there = held(body, at)
        if name == "gnss.speed":  # of satellites it has no sign, of a radar one
            mean, there = np.abs(mean), np.abs(there)
        gain = gain_of(mean, there)
        if gain is not None and gain > 0.0:
            return Measured(gain, by)
    return None


def track_by_yaw(
    found: Signals, places: Mapping[str, WheelGeometry], radius: float, origins: Mapping[str, SignalSource]
) -> Measured | None:
    """Track that makes what right wheels run faster than left ones the measured yaw rate; None where nothing measures it.

    Of a machine that skids it is the track of one that turned so without skidding.

    Parameters
    ----------
    found : Signals
        With rotations of the wheels in rad/s, or speeds of their rims in m/s.
    places : Mapping[str, WheelGeometry]
        Which wheels are fixed, and on which side.
    radius : float
        Of the wheels [m].
    origins : Mapping[str, SignalSource]
        As for `radius_by_body`.
    """
    yaw = found.items.get("imu.yaw_rate")
    sides = [
        [found.items[n] for w, p in places.items() if p.axle == "fixed" and sign * p.y > 0 and (n := f"wheel.{w}.v") in found.items]
        for sign in (1.0, -1.0)
    ]  # fmt: skip
    if yaw is None or not all(sides):
        return None
    at = moments([yaw, *sides[0], *sides[1]])
    left, right = (np.mean([rim(s, origins, at, radius) for s in side], axis=0) for side in sides)
    gain = gain_of(held(yaw, at), right - left)
    return Measured(abs(gain), "the yaw rate") if gain is not None else None


def base_by_yaw(found: Signals, base: float) -> Measured | None:
    """Distance from unsteered to steered wheels that makes the commanded steering angle the measured yaw rate; None where nothing measures it.

    Parameters
    ----------
    found : Signals
        With a commanded yaw rate that was made of a steering angle with that distance taken to be `base`.
    base : float
        Distance [m].

    Returns
    -------
    Measured or None
        Negative where the angle is positive to the right.
    """
    yaw, asked = found.items.get("imu.yaw_rate"), found.items.get("cmd.omega")
    if yaw is None or asked is None or not is_steering_command(asked):
        return None
    at = moments([yaw, asked])
    gain = gain_of(held(yaw, at), base * held(asked, at))
    return Measured(gain, "the yaw rate beside commanded speed and steering angle") if gain is not None else None


def base_by_angle(found: Signals, axle: str) -> Measured | None:
    """Distance from unsteered to steered wheels by the commanded speed, an axle's angle and the yaw rate; None where nothing measures it, or the angle is positive to the right."""
    leaf = next((x for x in ("phi", "phi_ref") if f"steer.{axle}.{x}" in found.items), "phi")
    signals = [found.items.get(n) for n in ("imu.yaw_rate", "cmd.v", f"steer.{axle}.{leaf}")]
    if any(s is None for s in signals):
        return None
    yaw, speed, angle = (s for s in signals if s is not None)
    at = moments([yaw, speed, angle])
    gain = gain_of(held(yaw, at), held(speed, at) * np.tan(held(angle, at)))
    return (
        Measured(gain, "the yaw rate beside commanded speed and steering angle")
        if gain is not None and gain > 0.0
        else None
    )


def is_rotation(origin: SignalSource) -> bool:
    """Whether a channel has a unit of turns, rather than of the rim's speed."""
    unit = known_unit(origin.unit)
    return unit in ("rad/s", "rpm", "rev/s", "deg/s") or (unit == "rad" and origin.derivative)


def forward(signal: Signal, origins: Mapping[str, SignalSource], at: NDArray[np.int64]) -> Array:
    """Rotation at some moments [rad/s], positive forward, shape (n,) as these."""
    origin = origins.get(signal.name, signal.origin)
    return held(signal, at) * (1.0 if origin.gain * signal.origin.gain > 0.0 else -1.0)


def rim(signal: Signal, origins: Mapping[str, SignalSource], at: NDArray[np.int64], radius: float) -> Array:
    """Speed of a wheel's rim [m/s] at some moments, positive forward, both of shape (n,), as its source in `origins` says; `radius` in m.

    Without a unit it is in m/s.
    """
    origin = origins.get(signal.name, signal.origin)
    unit = known_unit(origin.unit)
    scale = UNITS[unit][1] if unit is not None and not signal.origin.unit else 1.0  # else it is in SI already
    return held(signal, at) * scale * origin.gain / signal.origin.gain * (radius if is_rotation(origin) else 1.0)


def moments(signals: Sequence[Signal]) -> NDArray[np.int64]:
    """Moments at which all of some signals were recorded [ns], shape (n,)."""
    first, last = max(int(s.stamps[0]) for s in signals), min(int(s.stamps[-1]) for s in signals)
    return np.arange(first, last, round(_STEP_S * 1e9), dtype=np.int64)


def gain_of(x: Array, y: Array, step_s: float = _STEP_S) -> float | None:
    """Share of x that y is, by least trimmed squares at the delay that fits best; None where y is no share of x.

    Parameters
    ----------
    x, y : NDArray[np.float64], shape (n,)
        In one unit.
    step_s : float
        Between two samples [s].
    """
    most = round(_MOST_S / step_s)
    best: tuple[float, float] | None = None
    for late in range(-most, most + 1):
        a, b = (x[: x.size - late], y[late:]) if late >= 0 else (x[-late:], y[:late])
        known = np.isfinite(a) & np.isfinite(b)
        a, b = a[known], b[known]
        moving = np.abs(a) > _MOVES * float(np.quantile(np.abs(a), 0.95)) if a.size else np.zeros(0, np.bool_)
        seconds = np.count_nonzero(moving) * step_s
        if seconds < _SHORT_S:
            continue
        a, b = a[moving], b[moving]
        kept = np.ones(a.size, np.bool_)
        gain = 0.0
        for _ in range(3):
            gain = float(a[kept] @ b[kept] / (a[kept] @ a[kept]))
            off = np.abs(b - gain * a)
            kept = off <= np.quantile(off, 1.0 - _TRIMMED)
        spread = float(b[kept] @ b[kept])
        sound = 1.0 - float(off[kept] @ off[kept]) / spread if spread > 0.0 else 0.0
        if sound >= (_SOUND if seconds >= _LEAST_S else _EXACT) and (best is None or sound > best[0]):
            best = sound, gain
    return None if best is None else best[1]
