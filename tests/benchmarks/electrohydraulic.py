"""A heavy platform with electro-hydraulic wheel drives: a machine of physics that neither the simulator nor `hydrostatic.py` has.

Overlapping spools with flow forces and rate limits, two pressures per motor with leakage and reliefs, one slow pump on an engine
that droops; elastic tyres of unequal radii whose load shifts, hills and soft ground; axles with play on a shared flow; a PI law
with feed-forward, slew limits and anti-windup; speeds by the time between an encoder's edges; a recorder that jitters and
loses rows. Each seed is another individual with other equipment. Faults are those of L16 (4) and (8). For measuring only.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np
from electrohydraulic_physics import Array, Build, drive, refs_of
from hydrostatic import AXLES, WHEELS, courses

from replay.faults import FaultSpec
from replay.log.source_options import SignalSource
from replay.machine.config import Machine, Plant, haulotte
from replay.machine.geometry import four_wheel_geometry
from replay.signals.signal import Signal, Signals

NAME = "electrohydraulic"
STEP_S = 0.001
_START_NS = 1_786_000_000_000_000_000
_BAR = 1e5
#: What an individual's recorder has of the commands: of the body and of its wheels, of its wheels alone, of the body alone.
COMMANDS = ("both", "wheels", "body")


@lru_cache(maxsize=4)
def build(seed: int) -> tuple[Build, Array]:
    """The machine of a seed, and what differs between its wheels, shape (4, 7)."""
    rng = np.random.default_rng(80_000 + seed)
    u = rng.uniform
    top, mass, radius, supply = u(0.5, 1.8), u(4000.0, 11000.0), u(0.36, 0.52), u(170.0, 230.0) * _BAR
    motor = u(0.4, 0.6) * mass * 9.81 / 4 * radius / supply  # m³/rad: what it climbs
    full, most = u(1.15, 1.35) * top, motor * top / radius
    overlap = u(0.02, 0.07)
    flow = motor * full / radius / np.sqrt(0.43 * supply)
    parts = np.column_stack(
        [
            u(0.008, 0.04, 4) * most / supply,
            radius * (1 + rng.uniform(-0.012, 0.012, 4)),
            flow * u(0.95, 1.05, 4),
            overlap * u(0.85, 1.15, 4),
            u(0.01, 0.035, 4) * motor * supply,
            u(60.0, 130.0, 4),
            u(-0.006, 0.006, 4),
        ]
    )
    made = Build(
        top=top,
        full=full,
        cycle=int(rng.choice([10, 20, 40])),
        mass=mass,
        height=u(0.7, 1.4),
        cg=u(-0.08, 0.08),
        radius=radius,
        lateral=float(rng.choice([0.0, 0.08, 0.15])),
        motor=motor,
        inertia=u(0.006, 0.015) * mass * radius**2,
        volume=u(1.0, 2.5) * motor,
        relief=u(0.5, 1.1) * supply,
        supply=supply,
        pump=u(0.8, 1.4) * 4 * most,
        band=u(0.08, 0.15) * supply,
        pump_lag=u(0.08, 0.25),
        store=u(0.15, 0.5) * 4 * most / supply * 3,
        droop=u(0.02, 0.08),
        force=u(0.0, 0.05),
        rate=u(7.0, 20.0),
        overlap=overlap,
        known=u(0.6, 1.0),
        ramp=u(0.35, 0.9) * top,
        slew=u(3.0, 8.0),
        forward=u(0.85, 1.05),
        proportional=u(0.05, 0.2) / full,
        integral=u(0.5, 1.6) / full,
        authority=u(0.25, 0.45),
        pitch=2 * np.pi * radius / float(rng.choice([800, 1600, 3200])),
        edges=64,
        uneven=u(0.01, 0.05),
        stiffness=u(6.0, 14.0),
        grip=u(0.6, 0.85),
        roll=u(0.012, 0.035),
        hills=float(rng.choice([0.0, 0.03, 0.07])),
        waves=u(3.0, 7.0),
        ackermann=u(0.5, 1.0),
        steer_rate=u(0.25, 0.5),
        steer_gain=u(3.0, 6.0),
        steer_lag=u(0.02, 0.06),
        steer_overlap=u(0.02, 0.07),
        steer_known=u(0.7, 1.0),
        tolerance=u(0.003, 0.009),
        play=u(0.001, 0.005),
        inside=bool(rng.random() < 0.5),
        middle=u(-0.4, 0.4) if commands_of(seed) == "wheels" else 0.0,
        base=u(2.0, 3.2),
        track=u(1.4, 2.0),
    )
    return made, parts


def commands_of(seed: int) -> str:
    """Which commands the individual's recorder has, of `COMMANDS`."""
    return COMMANDS[int(np.random.default_rng(81_000 + seed).choice([0, 0, 1, 2]))]


def recorder_of(seed: int) -> str:
    """What records the individual's rows: its ``controller``, one a cycle, or a ``logger`` at a rate of its own that may repeat values."""
    return str(np.random.default_rng(86_000 + seed).choice(["controller", "logger"]))


def machine_of(individual: tuple[Build, Array]) -> Machine:
    """Its machine file: what is on the type plate; nothing of the plant."""
    made, _ = individual
    return replace(
        haulotte(),
        name=NAME,
        geometry=four_wheel_geometry(
            round(made.base, 2), round(made.track, 2), round(2 * made.radius, 3), made.lateral
        ),
        max_speed=round(made.top, 1),
        max_steer=0.5,
        plant=Plant(),
        assumed=("gear_ratio", "flow", "control"),
    )


def commands(seed: int, duration: float) -> tuple[Array, Array, Array]:
    """Speed [m/s], curvature [1/m] and angles of both axles [rad], shape (n, 2), that an operator asks for, per millisecond."""
    made, rng, n = build(seed)[0], np.random.default_rng(82_000 + seed), round(duration / STEP_S)
    speed, bend = np.zeros(n), np.zeros(n)
    at, sign = round(rng.uniform(1.0, 2.5) / STEP_S), 1.0
    while at < n:
        for _ in range(rng.integers(1, 4)):  # changes of speed without a stop
            length = round(rng.uniform(3.0, 8.0) / STEP_S)
            speed[at : at + length] = sign * rng.choice([0.2, 0.4, 0.6, 0.8, 0.95]) * rng.uniform(0.85, 1.0) * made.top
            at += length
        at += round(rng.choice([0.0, 1.2, 3.0]) / STEP_S)
        sign = -sign if rng.random() < 0.4 else sign
    at = round(rng.uniform(0.0, 3.0) / STEP_S)
    while at < n:
        length = round(rng.uniform(2.5, 8.0) / STEP_S)
        bend[at : at + length] = rng.uniform(-0.6, 0.6) / made.base if rng.random() < 0.7 else 0.0
        at += length
    hand = _smooth(rng.standard_normal(n), 1.0) * 0.3
    speed = _smooth(speed, rng.uniform(0.5, 1.2)) * (1 + 0.02 * hand)
    speed[np.abs(speed) < 0.004 * made.top] = 0.0
    bend = _smooth(bend, rng.uniform(0.8, 1.6))
    speed = speed / (1 + np.abs(bend) * made.track / 2)  # no wheel is asked for more than the greatest speed
    arms = np.array([made.base / 2, -made.base / 2]) - made.middle
    return speed, bend, np.arctan(bend[:, None] * arms)


def _smooth(x: Array, seconds: float) -> Array:
    """As a hand on a lever does it."""
    weights = np.hanning(round(seconds / STEP_S))
    return np.asarray(np.convolve(x, weights / weights.sum())[: x.size])


def asked(seed: int, duration: float) -> tuple[Array, dict[str, Array]]:
    """Time [s] and what is asked of every wheel [m/s] and axle [rad]."""
    made, (speed, bend, angle) = build(seed)[0], (x[::10] for x in commands(seed, duration))
    out, still = np.zeros((speed.size, 4)), np.zeros(2)
    for k in range(speed.size):
        refs_of(speed[k], bend[k], still, angle[k], made, out[k])
    return np.arange(speed.size) * 10 * STEP_S, dict(zip((*WHEELS, *AXLES), (*out.T, *angle.T), strict=True))


@lru_cache(maxsize=2)
def driven(seed: int, faults: tuple[FaultSpec, ...], duration: float) -> tuple[Array, ...]:
    """The mission per millisecond; see `drive`."""
    (made, parts), rng = build(seed), np.random.default_rng(83_000 + seed)
    speed, bend, angle = commands(seed, duration)
    loss, sat = courses(faults, duration, seed, made.top)
    noise = rng.standard_normal((speed.size, 6)) * 5e-4
    noise[:, 4:] += rng.uniform(-0.004, 0.004, 2)  # how well the angles were set to zero
    teeth = rng.uniform(-0.5, 0.5, (4, made.edges))
    spread = rng.uniform(-35.0, 35.0, (rng.integers(0, 50), 2))
    soft = np.column_stack([spread, rng.uniform(0.5, 2.5, len(spread)), rng.uniform(0.2, 0.8, len(spread))])
    return drive(speed, bend, angle, loss, sat, noise, teeth, soft, parts, made)


def _rows(rng: np.random.Generator, n: int, rate: float, loses: float, shake: float) -> tuple[np.ndarray, np.ndarray]:
    """Milliseconds at which a recorder takes its rows, and their stamps [ns]: jitter, and rows that are lost."""
    every = 1000.0 / rate
    at = np.arange(0.0, n - 1, every)
    at = np.clip(at + 1 + rng.uniform(-shake, shake, at.size) * every, 0, n - 1).astype(int)
    keep = rng.random(at.size) > loses
    for start in rng.integers(0, at.size, rng.integers(0, 4)):
        keep[start : start + int(rng.integers(3, 12))] = False
    at = np.unique(at[keep])
    return at, _START_NS + at * 1_000_000 + rng.integers(0, 400_000, at.size)


def signals(seed: int, faults: Sequence[FaultSpec], duration: float, tier: str) -> Signals:
    """A mission as a recorder has it; with ``spool`` openings as well, with ``direct`` second speeds and angles too."""
    made, has, rng = build(seed)[0], commands_of(seed), np.random.default_rng(84_000 + seed)
    speed, bend, _ = commands(seed, duration)
    ref, true, read, given, opened, body = driven(seed, tuple(faults), duration)
    n, own = speed.size, 2000.0 / made.cycle
    rate = own if recorder_of(seed) == "controller" else min(float(rng.choice([50.0, 100.0, 125.0, 250.0])), 2 * own)
    loses, gyro, ground = rng.choice([0.0, 0.002, 0.01]), rng.random() < 0.6, rng.random() < 0.4
    noise = np.random.default_rng(85_000 + seed)
    shake = 0.0 if recorder_of(seed) == "controller" else 0.12
    rows = {
        g: _rows(rng, n, r, loses, shake)
        for g, r in (("drive", rate), ("steer", rate), ("cmd", 50.0), ("imu", 100.0), ("gnss", 5.0))
    }
    columns: dict[str, tuple[str, Array]] = {}
    for i, w in enumerate(WHEELS):
        columns[f"wheel.{w}.v"], columns[f"wheel.{w}.u"] = ("drive", read[:, i]), ("drive", given[:, i])
        if has != "body":
            columns[f"wheel.{w}.v_ref"] = "drive", ref[:, i]
        if tier != "base":
            columns[f"wheel.{w}.u_applied"] = "drive", opened[:, i] + 0.003 * noise.standard_normal(n)
        if tier == "direct":
            second = true[:, i] * (1 + noise.uniform(-0.003, 0.003))
            columns[f"wheel.{w}.v_true"] = "drive", second + 0.004 * made.top * noise.standard_normal(n)
    for a, axle in enumerate(AXLES, 4):
        columns[f"steer.{axle}.phi"], columns[f"steer.{axle}.phi_ref"] = ("steer", read[:, a]), ("steer", ref[:, a])
        columns[f"steer.{axle}.u"] = "steer", given[:, a]
        if tier != "base":
            columns[f"steer.{axle}.u_applied"] = "steer", opened[:, a] + 0.003 * noise.standard_normal(n)
        if tier == "direct":
            columns[f"steer.{axle}.phi_true"] = "steer", true[:, a] + 0.001 * noise.standard_normal(n)
    if has != "wheels":
        columns["cmd.v"], columns["cmd.omega"] = ("cmd", speed), ("cmd", speed * bend)
    if gyro:
        columns["imu.yaw_rate"] = "imu", body[:, 2] + noise.uniform(-0.002, 0.002) + 0.005 * noise.standard_normal(n)
    if ground:
        columns["gnss.speed"] = "gnss", np.abs(np.hypot(body[:, 0], body[:, 1]) + 0.02 * noise.standard_normal(n))
    items = {}
    for name, (group, values) in columns.items():
        at, stamps = rows[group]
        origin = SignalSource(topic=f"/{group}", field=name)
        items[name] = Signal(name, stamps, np.ascontiguousarray(values[at]), origin, NAME, guessed=False)
    return Signals(items, {}, (), (), open_loop=False)
