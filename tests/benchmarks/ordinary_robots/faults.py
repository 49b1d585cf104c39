"""Faults of ordinary robots, and what each does to what is published."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SENSORS = ("encoder_dead", "encoder_frozen", "encoder_scaled", "encoder_noisy", "encoder_spikes", "encoder_late")
DRIVES = ("motor_dead", "motor_weak", "motor_on", "jammed")
#: Nobody's fault: no part may be named for them.
EVENTS = ("ignored", "estop")
#: Of the inertial unit and of odometry: no wheel may be named for them.
BODY = ("gyro_dead", "gyro_frozen", "gyro_scaled", "gyro_offset", "odometry_frozen", "odometry_scaled")
#: All through the log, and shorter than the others; behind the others, since the place in the list is part of the seed.
ALL_THROUGH = ("encoder_off", "gyro_off", "motor_gone")
SHORT = ("encoder_dropped",)
#: Of a drive whose loop makes up for them: torque that is lost behind its current, a brake that drags; for a time, and all through.
HIDDEN, HIDDEN_ALL = ("torque_lost", "brake_drags"), ("motor_faint", "torque_gone", "brake_on")
FAULTS = (*SENSORS, *DRIVES, *EVENTS, *BODY, *ALL_THROUGH, *SHORT, *HIDDEN, *HIDDEN_ALL)


@dataclass(frozen=True)
class Fault:
    """A fault of one wheel, in steps [first, last) of the physics.

    Attributes
    ----------
    kind : str
        Of `FAULTS`.
    wheel, first, last : int
        Where and when.
    size : float
        Scale, noise [rad/s], delay [s], share of the duty, duty, time in which a jammed wheel comes to rest [s], offset [rad/s].
    counted : bool
        Whether it is in the counts, so that position and speed loop have it too, or in the published speed alone.
    """

    kind: str
    wheel: int
    first: int
    last: int
    size: float
    counted: bool

    @property
    def side(self) -> str:
        """Side of the wheel, or ``machine`` where no wheel has a fault."""
        sensors, drives = (*SENSORS, "encoder_off", "encoder_dropped"), (*DRIVES, "motor_gone", *HIDDEN, *HIDDEN_ALL)
        return "sensor" if self.kind in sensors else "actuator" if self.kind in drives else "machine"


def fault_of(kind: str, wheels: int, moving: NDArray[np.bool_], step: float, rng: np.random.Generator) -> Fault:
    """A random fault that begins while the robot is commanded to move.

    Parameters
    ----------
    kind : str
        Of `FAULTS`.
    wheels : int
        Of the robot.
    moving : NDArray[np.bool_], shape (n,)
        Where it is commanded to move.
    step : float
        Of the physics [s].
    rng : np.random.Generator
        Randomness.
    """
    n = moving.size
    places = np.flatnonzero(moving[: round(0.75 * n)])
    places = places[places > 0.2 * n]
    first = int(rng.choice(places))
    last = n if rng.random() < 0.25 else min(n, first + round(rng.uniform(6.0, 20.0) / step))
    if kind in (*ALL_THROUGH, *HIDDEN_ALL):
        first, last = 0, n
    if kind in SHORT:
        last = min(n, first + round(1.5 / step))
    size = {
        "encoder_scaled": float(rng.choice([rng.uniform(0.35, 0.7), rng.uniform(1.45, 2.2)])),
        "encoder_noisy": float(rng.uniform(0.5, 3.0)),
        "encoder_spikes": 60.0,
        "encoder_late": float(rng.uniform(0.3, 1.0)),
        "jammed": float(rng.uniform(0.02, 0.15)),
        "motor_weak": float(rng.uniform(0.2, 0.5)),
        "torque_lost": float(rng.uniform(0.25, 0.6)),
        "torque_gone": float(rng.uniform(0.25, 0.6)),
        "brake_drags": float(rng.uniform(0.1, 0.3)),
        "brake_on": float(rng.uniform(0.1, 0.3)),
        "motor_faint": float(rng.uniform(0.3, 0.6)),
        "motor_on": float(rng.choice([-1, 1]) * rng.uniform(0.4, 0.9)),
        "gyro_scaled": float(rng.choice([rng.uniform(0.3, 0.7), rng.uniform(1.4, 2.2)])),
        "odometry_scaled": float(rng.choice([rng.uniform(0.3, 0.7), rng.uniform(1.4, 2.2)])),
        "gyro_offset": float(rng.choice([-1, 1]) * rng.uniform(0.1, 0.5)),
    }.get(kind, 1.0)
    if kind == "encoder_off":
        size = float(rng.choice([0.8, 1.3]))
    elif kind == "gyro_off":
        size = float(rng.choice([-0.05, 0.05]))
    return Fault(kind, int(rng.integers(wheels)), first, last, size, bool(rng.random() < 0.5))


def published(t: Array, speed: Array, fault: Fault, step: float, rng: np.random.Generator) -> Array:
    """Published speed [rad/s] at the times `t` [s] with a fault of the encoder in it."""
    out = speed.copy()
    inside = np.flatnonzero((t >= fault.first * step) & (t < fault.last * step))
    if inside.size == 0:
        return out
    if fault.kind in ("encoder_dead", "encoder_dropped"):
        out[inside] = 0.0
    elif fault.kind == "encoder_frozen":
        out[inside] = out[inside[0]]
    elif fault.kind in ("encoder_scaled", "encoder_off") and not fault.counted:
        out[inside] *= fault.size
    elif fault.kind == "encoder_noisy":
        out[inside] += rng.normal(0.0, fault.size, inside.size)
    elif fault.kind == "encoder_spikes":
        hit = inside[rng.random(inside.size) < 0.04]
        out[hit] += fault.size * rng.choice([-1, 1], hit.size)
    elif fault.kind == "encoder_late":
        out[inside] = np.interp(t[inside] - fault.size, t, speed)
    return out


def of_the_body(t: Array, x: Array, fault: Fault | None, sensor: str, step: float) -> Array:
    """What a ``gyro`` or ``odometry`` shows of x at the times `t` [s] with a fault of it; x itself where it has none."""
    if fault is None or not fault.kind.startswith(f"{sensor}_"):
        return x
    inside = np.flatnonzero((t >= fault.first * step) & (t < fault.last * step))
    out = x.copy()
    if inside.size:
        out[inside] = {
            "dead": np.zeros(inside.size),
            "frozen": np.full(inside.size, x[inside[0]]),
            "scaled": fault.size * x[inside],
            "offset": x[inside] + fault.size,
            "off": x[inside] + fault.size,
        }[fault.kind.rpartition("_")[2]]
    return out
