"""Seven kinds of robot with random sizes, motors, encoders and habits, and the missions that they are sent on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

KINDS = ("differential", "skid", "rocker", "ackermann", "mecanum", "tricycle", "car")
#: Kinds that turn by steering: on a circle about the middle of the rear axle.
STEERED = ("ackermann", "tricycle", "car")
H = 1e-3  # step of the physics [s]


@dataclass(frozen=True)
class Wheel:
    """A driven wheel: joint name, place [m], the direction of its rollers (0: none), and whether it is steered."""

    joint: str
    x: float
    y: float
    roller: float = 0.0
    steered: bool = False


@dataclass(frozen=True)
class Robot:
    """A robot.

    Attributes
    ----------
    kind : str
        Of `KINDS`.
    wheels : tuple[Wheel, ...]
        Driven wheels.
    radius, wheelbase, mass, top : float
        Of a wheel [m], of an Ackermann car [m], of the body [kg], largest commanded speed [m/s].
    rate : float
        Of its joint states [Hz].
    counts : float
        Of an encoder, in a turn of the wheel.
    smooth : float
        Time constant of the published speed [s].
    closed : bool
        Whether the encoder closes a speed loop; otherwise the duty follows the command alone.
    lag, accel, dead_time, deadband, rail : float
        Of the speed loop [s], of its reference [m/s²], of the bus [s], of duty that moves nothing [1], stall force of a wheel [N].
    described, positions, efforts, stamped : bool
        Whether /robot_description, positions and efforts of joints are logged; whether commands carry stamps.
    odometry : str
        ``wheels``, ``own`` (independent of the wheels) or ``none``.
    duties : bool
        Whether the efforts are duties instead of torques.
    """

    kind: str
    wheels: tuple[Wheel, ...]
    radius: float
    wheelbase: float
    mass: float
    top: float
    rate: float
    counts: float
    smooth: float
    closed: bool
    lag: float
    accel: float
    dead_time: float
    deadband: float
    rail: float
    described: bool
    positions: bool
    efforts: bool
    stamped: bool
    odometry: str
    duties: bool = False


@dataclass(frozen=True)
class Course:
    """What is asked and what is met, by steps of `H`.

    Attributes
    ----------
    v, lateral, omega : Array
        Commands [m/s], [m/s], [rad/s].
    silent : NDArray[np.bool_]
        Where no commands are published (a released joystick).
    slope, load : Array
        Grade [rad], mass beside the usual [1].
    kerbs : Array, shape (steps, wheels)
        Force against a wheel [N].
    stop : NDArray[np.bool_]
        Emergency stop pressed.
    """

    v: Array
    lateral: Array
    omega: Array
    silent: NDArray[np.bool_]
    slope: Array
    load: Array
    kerbs: Array
    stop: NDArray[np.bool_]


def robot_of(kind: str, rng: np.random.Generator) -> Robot:
    """A random robot of a kind."""
    size = {
        "differential": 0.4,
        "skid": 1.0,
        "rocker": 1.1,
        "ackermann": 0.8,
        "mecanum": 0.7,
        "tricycle": 1.2,
        "car": 1.0,
    }[kind] * rng.uniform(0.7, 1.4)
    half, base = 0.3 * size, 0.5 * size
    rows = {
        "differential": [0.0],
        "skid": [base / 2, -base / 2],
        "rocker": [base, 0.0, -base],
        "ackermann": [0.0],
        "tricycle": [0.6 * size],
        "car": [0.6 * size, 0.0],
    }
    names = {1: [""], 2: ["front_", "rear_"], 3: ["front_", "middle_", "rear_"]}
    xs = rows.get(kind, [base / 2, -base / 2])
    prefix = ["rear_"] if kind == "ackermann" else names[len(xs)]
    wheels = tuple(
        Wheel(
            f"{p}{side}_wheel_joint", x, y, 0.0 if kind != "mecanum" else float(np.sign(x) * np.sign(y)),
            kind == "car" and x > 0.0,
        )
        for p, x in zip(prefix, xs, strict=True)
        for side, y in (("left", half), ("right", -half))
    )  # fmt: skip
    if kind == "tricycle":  # one wheel that drives and steers
        wheels = (Wheel("front_wheel_joint", xs[0], 0.0, steered=True),)
    mass = 60.0 * size**2 * rng.uniform(0.6, 1.6)
    rate = {
        "differential": 20.0,
        "skid": 50.0,
        "rocker": 20.0,
        "ackermann": 50.0,
        "mecanum": 30.0,
        "tricycle": 20.0,
        "car": 50.0,
    }[kind]
    radius = (0.1 + 0.09 * size) * rng.uniform(0.7, 1.2)
    return Robot(
        kind, wheels, radius, 0.6 * size, mass,
        top=float(rng.uniform(0.6, 1.4) * (2.0 if kind in ("ackermann", "car") else 1.0)), rate=float(rng.choice([rate, rate, 10.0, 100.0])),
        counts=float(np.exp(rng.uniform(np.log(3e3), np.log(8e4)))), smooth=float(rng.choice([0.0, 0.05, 0.1])),
        closed=bool(rng.random() < 0.8), lag=float(rng.uniform(0.05, 0.3)), accel=float(rng.uniform(0.6, 3.0)),
        dead_time=float(rng.uniform(0.0, 0.15)), deadband=float(rng.uniform(0.0, 0.06)),
        rail=float(mass * 9.81 * rng.uniform(0.7, 1.3) / len(wheels)), described=bool(rng.random() < 0.5),
        positions=bool(rng.random() < 0.6), efforts=bool(rng.random() < 0.4), stamped=bool(rng.random() < 0.3),
        odometry=str(rng.choice(["wheels", "wheels", "own", "none"])),
    )  # fmt: skip


def course_of(robot: Robot, seconds: float, rng: np.random.Generator) -> Course:
    """A random mission: steps of a joystick, or the smooth commands of a planner; slopes, payload, kerbs, pauses."""
    n = round(seconds / H)
    joystick = rng.random() < 0.5
    v, lateral, omega, silent = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n, np.bool_)
    at = round(rng.uniform(1.0, 4.0) / H)
    turn = robot.top / (3.0 * (abs(robot.wheels[0].y) or 0.5 * robot.wheelbase) + 0.3)
    while at < n:
        length = round(rng.uniform(2.0, 9.0) / H)
        part = slice(at, min(n, at + length))
        what = rng.random()
        if what < 0.15:
            silent[part] = joystick
        elif what < 0.25 and robot.kind not in STEERED:
            omega[part] = rng.choice([-1, 1]) * rng.uniform(0.3, 0.9) * turn
        else:
            v[part] = rng.uniform(0.25, 1.0) * robot.top * (-1 if rng.random() < 0.15 else 1)
            omega[part] = 0.0 if rng.random() < 0.3 else rng.uniform(-0.6, 0.6) * turn
            if robot.kind == "mecanum" and rng.random() < 0.4:
                lateral[part] = rng.uniform(-0.5, 0.5) * robot.top
        at += length
    if not joystick:
        v, lateral, omega = (_eased(x, rng.uniform(0.5, 1.5)) for x in (v, lateral, omega))
    elif rng.random() < 0.5:  # a thumb is never still
        wobble = 1.0 + 0.05 * _eased(rng.normal(0.0, 8.0, n), 0.4)
        v, omega = v * wobble, omega * wobble
    slope = _eased(np.repeat(rng.normal(0.0, 0.05, 20), -(-n // 20))[:n], 2.0) * (rng.random() < 0.6)
    load = np.where(np.arange(n) > rng.integers(n), rng.uniform(0.7, 1.5), 1.0) if rng.random() < 0.4 else np.ones(n)
    kerbs = np.zeros((n, len(robot.wheels)))
    for _ in range(rng.poisson(3.0) if rng.random() < 0.5 else 0):
        begin = int(rng.integers(n))
        push = rng.uniform(0.3, 1.2) * robot.mass * 9.81 / len(robot.wheels)
        kerbs[begin : begin + round(rng.uniform(0.1, 0.4) / H), rng.integers(len(robot.wheels))] = push
    stop = np.zeros(n, np.bool_)
    if rng.random() < 0.15:
        begin = int(rng.uniform(0.2, 0.8) * n)
        stop[begin : begin + round(rng.uniform(3.0, 8.0) / H)] = True
    return Course(v, lateral, omega, silent, slope, load, kerbs, stop)


def _eased(x: Array, tau: float) -> Array:
    """x through two lags of `tau` [s]."""
    from scipy.signal import lfilter

    a = float(np.exp(-H / tau))
    once = lfilter([1 - a], [1, -a], x)
    return np.asarray(lfilter([1 - a], [1, -a], once))
