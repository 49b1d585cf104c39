"""A loader with one closed hydrostatic circuit per wheel: flow is set by swash plates, not by valves in front of a shared pressure.

Pumps with a dead band, another gain backward and a pressure cut-off, an engine that droops and an anti-stall, motors that change
between two displacements while they drive, leakage that grows as the oil warms, a payload taken and left in a mission, pulses
counted per cycle of the controller, a steering with priority. Faults are those of L16 (4) and (8). For measuring only.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import flow_sharing
import numpy as np
from closed_circuit_physics import Array, Build, drive
from hydrostatic import AXLES, WHEELS, _smooth, courses

from replay.faults import FaultSpec
from replay.log.source_options import SignalSource
from replay.machine.config import Machine
from replay.signals.signal import Signal, Signals

NAME = "closed_circuit"
STEP_S = 0.001


@lru_cache(maxsize=4)
def build(seed: int) -> tuple[Build, Array]:
    """The machine of a seed, and what differs between its wheels, shape (4, 7)."""
    rng = np.random.default_rng(120_000 + seed)
    u = rng.uniform
    top, mass, radius, most = u(1.0, 3.0), u(5000.0, 18000.0), u(0.45, 0.75), u(300.0, 420.0) * 1e5
    load, ratio = u(0.1, 0.5) * mass, u(0.5, 0.7)
    motor = u(0.45, 0.65) * 9.81 * (mass + load) / 4 * radius / most / ratio
    flow, dead = u(1.15, 1.35) * motor * ratio * top / radius, u(0.02, 0.07)
    flow = max(flow, 1.1 * motor * 0.62 * top / radius)  # enough for the change of displacement
    skew = u(0.0, 0.08)
    parts = np.column_stack(
        [
            radius * u(0.97, 0.995) * (1 + u(-0.012, 0.012, 4)),
            dead * u(0.85, 1.15, 4),
            (1 + skew) * u(0.97, 1.03, 4),
            (1 - skew) * u(0.97, 1.03, 4),
            u(0.7, 1.4, 4),
            u(0.8, 1.25, 4),
            u(-0.005, 0.005, 4),
        ]
    )
    made = Build(
        top=top, mass=mass, load=load, height=u(0.8, 1.4), cg=u(-0.05, 0.1), radius=radius, lateral=float(rng.choice([0.0, 0.1])),
        base=u(2.2, 3.4), track=u(1.6, 2.2), middle=0.0, inertia=u(0.006, 0.012) * mass * radius**2, motor=motor, ratio=ratio,
        flow=flow, volume=u(4.0, 9.0) * motor, most=most, charge=u(18e5, 28e5), leakage=u(0.02, 0.06) * flow / most,
        heat=u(0.012, 0.025), friction=u(0.01, 0.03) * motor * most, lag=u(0.015, 0.04), swing=u(0.03, 0.08), rate=u(2.0, 5.0),
        dead=dead, hysteresis=u(0.002, 0.008), known=u(0.75, 1.0), power=u(1.0, 1.6) * 4 * flow * most * 0.35, droop=u(0.05, 0.12),
        forward=u(0.9, 1.05), proportional=u(0.03, 0.12), integral=u(0.2, 0.5), slew=u(2.0, 5.0), ramp=u(0.3, 0.7) * top,
        teeth=float(round(2 * np.pi * radius / (0.02 * top * u(0.015, 0.05)))), cycle=40, grip=u(0.6, 0.85), stiffness=u(6.0, 12.0),
        relaxation=u(0.3, 0.6), roll=u(0.015, 0.03), hill=float(rng.choice([0.02, 0.06, 0.1])), waves=u(4.0, 10.0),
        steer_rate=u(0.2, 0.45), steer_gain=u(2.5, 5.0), steer_dead=u(0.02, 0.08), asymmetry=u(0.03, 0.18),
    )  # fmt: skip
    return made, parts


def machine_of(individual: tuple[Build, Array]) -> Machine:
    """The machine file: type plate and a tape measure."""
    return replace(flow_sharing.machine_of(individual), name=NAME)  # type: ignore[arg-type]


def commands(seed: int, duration: float) -> tuple[Array, Array]:
    """Speed of the body [m/s] and angles of both axles [rad], shape (n, 2): irregular legs, creeping, long stops."""
    made, rng, n = build(seed)[0], np.random.default_rng(121_000 + seed), round(duration / STEP_S)
    speed, bend, at, sign = np.zeros(n), np.zeros(n), round(rng.uniform(1.0, 3.0) / STEP_S), 1.0
    while at < n:
        share = rng.uniform(0.08, 0.18) if rng.random() < 0.2 else rng.uniform(0.3, 0.95)
        end = at + round(rng.uniform(3.0, 10.0) / STEP_S)
        speed[at:end] = sign * share * made.top
        speed[at:end] *= 1.0 + 0.1 * np.repeat(rng.standard_normal((end - at) // 700 + 1), 700)[: speed[at:end].size]
        bend[at:end] = rng.uniform(-0.36, 0.36) if rng.random() < 0.7 else 0.0
        at, sign = end, -sign if rng.random() < 0.4 else sign
        if rng.random() < 0.45:
            at += round((rng.uniform(4.0, 9.0) if rng.random() < 0.25 else rng.uniform(0.5, 3.0)) / STEP_S)
    front = _smooth(bend, rng.uniform(0.7, 1.4))
    angle = np.column_stack([front, -front])
    limit = made.top * (1 - 0.5 * np.abs(front) / 0.42) / (1 + np.abs(np.tan(front)) * made.track / made.base)
    speed = _smooth(np.clip(speed, -limit, limit), rng.uniform(0.3, 0.8))
    speed[np.abs(speed) < 0.01 * made.top] = 0.0
    return speed, angle


def asked(seed: int, duration: float) -> tuple[Array, dict[str, Array]]:
    """Time [s] and what is asked of every wheel [m/s] and axle [rad] where nothing fails."""
    ref = driven(seed, (), duration)[0][::10]
    return np.arange(len(ref)) * 10 * STEP_S, dict(zip((*WHEELS, *AXLES), ref.T, strict=True))


@lru_cache(maxsize=8)
def driven(seed: int, faults: tuple[FaultSpec, ...], duration: float) -> tuple[Array, ...]:
    """The mission per millisecond; see `drive`."""
    (made, parts), rng = build(seed), np.random.default_rng(122_000 + seed)
    speed, angle = commands(seed, duration)
    loss, sat = courses(faults, duration, seed, made.top)
    noise = rng.standard_normal((speed.size, 2)) * 5e-4 + rng.uniform(-0.003, 0.003, 2)
    first = rng.uniform(0.2, 0.5) * duration  # a payload is taken, and left
    t = np.arange(speed.size) * STEP_S
    loaded = np.clip((t - first) / 2.0, 0.0, 1.0) - np.clip(
        (t - first - rng.uniform(0.2, 0.4) * duration) / 2.0, 0.0, 1.0
    )
    return drive(
        speed, angle, loss, sat, noise, loaded, rng.uniform(0, 6.3, 4), parts, float(rng.uniform(15.0, 60.0)), made
    )


def signals(seed: int, faults: Sequence[FaultSpec], duration: float, tier: str) -> Signals:
    """A mission as a recorder has it; with ``spool`` spools as well, with ``direct`` second speeds and angles too."""
    made, _ = build(seed)
    rng, noise = np.random.default_rng(124_000 + seed), np.random.default_rng(125_000 + seed)
    ref, true, read, given, done, body = driven(seed, tuple(faults), duration)
    n, loses, shake = len(ref), float(rng.choice([0.0, 0.005])), float(rng.choice([0.0, 0.1]))
    rates = {"drive": 50.0, "valve": 200.0, "steer": float(rng.choice([20.0, 50.0])), "cmd": 50.0, "imu": 100.0}
    rows = {group: flow_sharing._rows(rng, n, r, loses, shake) for group, r in rates.items()}
    columns: dict[str, tuple[str, Array]] = {
        "cmd.v": ("cmd", body[:, 3]),
        "cmd.omega": ("cmd", body[:, 3] * body[:, 4]),
        "imu.yaw_rate": ("imu", body[:, 2] + noise.uniform(-0.01, 0.01) + 0.005 * noise.standard_normal(n)),
    }
    for i, w in enumerate(WHEELS):
        columns[f"wheel.{w}.v"], columns[f"wheel.{w}.u"] = ("drive", read[:, i]), ("drive", given[:, i])
        columns[f"wheel.{w}.v_ref"] = "drive", ref[:, i]
        second = true[:, i] * (1 + noise.uniform(-0.004, 0.004)) + 0.003 * made.top * noise.standard_normal(n)
        if tier != "base":
            columns[f"wheel.{w}.u_applied"] = "valve", done[:, i] + 0.003 * noise.standard_normal(n)
        if tier == "direct":
            columns[f"wheel.{w}.v_true"] = "valve", second
    for a, axle in enumerate(AXLES, 4):
        columns[f"steer.{axle}.phi"], columns[f"steer.{axle}.phi_ref"] = ("steer", read[:, a]), ("steer", ref[:, a])
        columns[f"steer.{axle}.u"] = "steer", given[:, a]
        if tier != "base":
            columns[f"steer.{axle}.u_applied"] = "steer", done[:, a] + 0.003 * noise.standard_normal(n)
        if tier == "direct":
            columns[f"steer.{axle}.phi_true"] = "steer", true[:, a] + 8e-4 * noise.standard_normal(n)
    items = {}
    for name, (group, values) in columns.items():
        at, stamps = rows[group]
        origin = SignalSource(topic=f"/{group}", field=name)
        items[name] = Signal(name, stamps, np.ascontiguousarray(values[at]), origin, NAME, guessed=False)
    return Signals(items, {}, (), (), open_loop=False)
