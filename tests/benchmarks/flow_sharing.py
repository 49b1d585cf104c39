"""A forestry carrier with load-sensing hydraulics that share too little flow: a machine of physics that no other one of `all_clear.py` has.

One pump on a diesel that droops, valves with a compensator behind every edge, motors of one or two displacements, another gain
on either edge, hysteresis, steering cylinders of two areas, a payload on a crane, ramps, soft and split ground, pole wheels timed
by their period. Each seed is another individual on another drive. Faults are those of L16 (4) and (8): on what the controller
sees of speeds and angles, and on what a valve makes of its command. For measuring only.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np
from flow_sharing_control import drive
from flow_sharing_physics import Array, Build
from hydrostatic import AXLES, WHEELS, courses

from replay.faults import FaultSpec
from replay.log.source_options import SignalSource
from replay.machine.config import Machine
from replay.machine.toml_file import load_machine
from replay.signals.signal import Signal, Signals

NAME = "flow_sharing"
STEP_S = 0.001
_START_NS = 1_790_000_000_000_000_000
_BAR = 1e5
#: What an individual's recorder has of the commands: of the body and of its wheels, of its wheels alone, of the body alone.
COMMANDS = ("both", "wheels", "body")
#: Manoeuvres of a drive and how likely each is.
MANOEUVRES = {"transit": 0.2, "work": 0.3, "creep": 0.12, "shuttle": 0.14, "turn": 0.12, "stand": 0.12}


@lru_cache(maxsize=4)
def build(seed: int) -> tuple[Build, Array]:
    """The machine of a seed, and what differs between its wheels, shape (4, 9)."""
    rng = np.random.default_rng(100_000 + seed)
    u = rng.uniform
    top, empty, radius, most = u(0.9, 2.8), u(6000.0, 20000.0), u(0.45, 0.7), u(210.0, 320.0) * _BAR
    mass, ratio = empty * (1 + u(0.0, 0.6)), float(rng.choice([1.0, 1.0, u(1.5, 2.0)]))
    small = u(0.42, 0.6) * 9.81 * empty * 1.3 / 4 * radius / most / ratio  # m³/rad: what it climbs
    flow = u(1.15, 1.35) * small * top / radius
    pump, overlap, progress = u(1.0, 1.4) * 4 * small * top / radius, u(0.03, 0.08), u(1.0, 1.35)
    asymmetry = u(0.03, 0.09)  # of the two edges of every valve
    parts = np.column_stack(
        [
            radius * u(0.97, 0.995) * (1 + u(-0.012, 0.012, 4)),
            overlap * u(0.85, 1.15, 4),
            (1 + asymmetry) * u(0.97, 1.03, 4),
            (1 - asymmetry) * u(0.97, 1.03, 4),
            u(-0.006, 0.006, 4),
            u(0.7, 1.4, 4),
            u(0.8, 1.25, 4),
            u(0.985, 1.015, 4),
            u(-0.004, 0.004, 4),
        ]
    )
    made = Build(
        top=top,
        cycle=int(rng.choice([20, 20, 40])),
        mass=mass,
        height=u(0.8, 1.5),
        cg=u(-0.08, 0.1),
        radius=radius,
        lateral=float(rng.choice([0.0, 0.07, 0.14])),
        base=u(2.3, 3.8),
        track=u(1.6, 2.3),
        inertia=u(0.006, 0.012) * empty * radius**2,
        small=small,
        ratio=ratio,
        flow=flow,
        volume=u(3.5, 6.0) * small * ratio,
        most=most,
        margin=u(15.0, 25.0) * _BAR,
        back=u(8.0, 20.0) * _BAR,
        pilot=u(35.0, 60.0) * _BAR,
        brake_lag=u(0.004, 0.01),
        relief=u(0.85, 1.05) * most,
        yields=u(0.1, 0.25),
        leakage=u(0.025, 0.06) * flow / most,
        friction=u(0.012, 0.035) * small * ratio * most,
        stiction=u(1.2, 2.0),
        stribeck=u(0.05, 0.2),
        loss=u(0.03, 0.08),
        pump=pump,
        pump_lag=u(0.05, 0.15),
        engine=u(0.85, 1.0),
        droop=u(0.03, 0.08),
        governor=u(0.4, 0.9),
        power=u(0.55, 0.9) * pump * most,
        coil=u(0.008, 0.02),
        lag=u(0.02, 0.05),
        rate=u(6.0, 15.0),
        hysteresis=u(0.003, 0.012),
        overlap=overlap,
        progress=progress,
        known=u(0.7, 1.0),
        known_progress=1 + u(0.6, 1.0) * (progress - 1),
        forward=u(0.88, 1.05),
        proportional=u(0.03, 0.12),
        integral=u(0.25, 0.6),
        authority=u(0.2, 0.4),
        slew=u(3.0, 8.0),
        ramp=u(0.35, 0.8) * top,
        brake_ramp=u(0.45, 1.0) * top,
        teeth=float(round(2 * np.pi * radius / (top * u(0.006, 0.02)))),  # 50 to 170 edges a second at the top
        tick=float(rng.choice([1e-6, 1e-5, 5e-5])),
        eccentric=u(0.02, 0.25),
        timeout=u(0.35, 0.7),
        reading_lag=u(0.02, 0.06),
        quantum=float(rng.choice([0.001, 1 / 256, 0.005])),
        stiffness=u(6.0, 13.0),
        shape=u(1.2, 1.6),
        relaxation=u(0.3, 0.6),
        grip=u(0.6, 0.9),
        roll=u(0.015, 0.035),
        soft=float(rng.choice([0.3, 0.8, 2.0])),
        slick=float(rng.choice([0.7, 1.2, 2.0])),
        hill=float(rng.choice([0.02, 0.06, 0.12])),
        hill_length=u(4.0, 10.0),
        ackermann=u(0.5, 1.0),
        steer_rate=u(0.2, 0.45),
        asymmetry=u(0.04, 0.2),
        mirrored=float(rng.choice([-1.0, 1.0])),
        steer_gain=u(2.5, 5.5),
        steer_overlap=u(0.02, 0.08),
        tolerance=u(0.004, 0.009),
        play=u(0.001, 0.004),
        inside=bool(rng.random() < 0.5),
        rear=float(rng.choice([0.6, 1.0])) if commands_of(seed) == "wheels" else 1.0,
    )
    return made, parts


def commands_of(seed: int) -> str:
    """Which commands the individual's recorder has, of `COMMANDS`."""
    return COMMANDS[int(np.random.default_rng(101_000 + seed).choice([0, 0, 1, 2]))]


def machine_of(individual: tuple[Build, Array]) -> Machine:
    """The machine file as it is read: type plate and a tape measure; nothing of valves, motors and engine."""
    made = individual[0]
    rng = np.random.default_rng(round(made.mass))  # as wrong as this individual's users are
    base, track, wheel = (x * rng.uniform(0.98, 1.02) for x in (made.base, made.track, 2 * made.radius))
    text = (
        f'[machine]\nname = "{NAME}"\nwheels = ["FR", "FL", "RR", "RL"]\n\n[geometry]\nwheelbase = {base:.2f}\n'
        f"joint_spacing = {track:.2f}\nwheel_offset = {made.lateral:.2f}\nwheel_diameter = {wheel:.2f}\n"
        f'max_speed = {made.top * rng.uniform(0.95, 1.1):.1f}\nmax_steer = 0.5\n\n[control]\nlaw = "none"\n'
    )
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "machine.toml"
        path.write_text(text)
        return load_machine(path)


def commands(seed: int, duration: float) -> tuple[Array, Array]:
    """Speed of the body [m/s] and angles of both axles [rad], shape (n, 2), that an operator asks for, per millisecond."""
    made, rng, n = build(seed)[0], np.random.default_rng(102_000 + seed), round(duration / STEP_S)
    speed, bend, at, sign = np.zeros(n), np.zeros(n), round(rng.uniform(1.0, 2.5) / STEP_S), 1.0
    while at < n:
        kind = str(rng.choice(list(MANOEUVRES), p=list(MANOEUVRES.values())))
        legs, low, high, shortest, longest, curve = {
            "transit": (1, 0.7, 1.0, 5.0, 11.0, 0.25),
            "work": (2, 0.3, 0.65, 3.0, 6.0, 0.7),
            "creep": (1, 0.08, 0.18, 4.0, 8.0, 0.6),
            "shuttle": (3, 0.3, 0.6, 2.5, 4.5, 0.5),
            "turn": (1, 0.2, 0.45, 4.0, 8.0, 1.0),
            "stand": (1, 0.0, 0.0, 1.5, 5.0, 0.0),
        }[kind]
        for _ in range(legs):
            end = at + round(rng.uniform(shortest, longest) / STEP_S)
            speed[at:end] = sign * rng.uniform(low, high) * made.top
            bend[at:end] = curve * rng.uniform(0.4, 1.0) * rng.choice([-1.0, 0.0, 1.0], p=[0.4, 0.2, 0.4])
            if rng.random() < 0.5:  # a bend within the leg
                bend[(at + end) // 2 : end] = curve * rng.uniform(-1.0, 1.0)
            at, sign = end, -sign if kind == "shuttle" else sign
        if rng.random() < 0.4:
            at, sign = at + round(rng.uniform(0.5, 2.5) / STEP_S), -sign if rng.random() < 0.5 else sign
    front = 0.42 * _smooth(bend, rng.uniform(0.7, 1.4))
    angle = np.column_stack([front, -made.rear * front])
    curve = np.abs(np.tan(angle[:, 0]) - np.tan(angle[:, 1])) / made.base
    limit = made.top * (1 - 0.5 * np.abs(front) / 0.42) / (1 + curve * made.track / 2)  # slower in turns
    speed = _smooth(np.clip(speed, -limit, limit), rng.uniform(0.2, 0.7))
    speed[np.abs(speed) < 0.01 * made.top] = 0.0
    return speed, angle


def _smooth(x: Array, seconds: float) -> Array:
    """As a hand on a lever does it."""
    weights = np.hanning(round(seconds / STEP_S))
    return np.asarray(np.convolve(x, weights / weights.sum())[: x.size])


def asked(seed: int, duration: float) -> tuple[Array, dict[str, Array]]:
    """Time [s] and what is asked of every wheel [m/s] and axle [rad] where nothing fails."""
    ref = driven(seed, (), duration)[0][::10]
    return np.arange(len(ref)) * 10 * STEP_S, dict(zip((*WHEELS, *AXLES), ref.T, strict=True))


@lru_cache(maxsize=8)
def driven(seed: int, faults: tuple[FaultSpec, ...], duration: float) -> tuple[Array, ...]:
    """The mission per millisecond; see `drive`."""
    (made, parts), rng = build(seed), np.random.default_rng(103_000 + seed)
    speed, angle = commands(seed, duration)
    loss, sat = courses(faults, duration, seed, made.top)
    noise = rng.standard_normal((speed.size, 2)) * 5e-4 + rng.uniform(
        -0.004, 0.004, 2
    )  # how well they were set to zero
    crane = np.repeat(rng.uniform(-1.0, 1.0, (round(duration / 6.0) + 2, 2)), 6000, axis=0)[: speed.size]
    reach = rng.uniform(0.0, 1.0) * np.array([0.09, 0.05])
    shift = np.column_stack([_smooth(c, 3.0) for c in (crane * reach).T])
    field, oil = rng.uniform(0.0, 2 * np.pi, 6), float(rng.uniform(15.0, 65.0))
    return drive(speed, angle, loss, sat, noise, shift, field, parts, oil, made)


def _rows(rng: np.random.Generator, n: int, rate: float, loses: float, shake: float) -> tuple[np.ndarray, np.ndarray]:
    """Milliseconds at which a recorder takes its rows, and their stamps [ns], which come late by some of a period; rows are lost."""
    every = 1000.0 / rate
    due = np.arange(0.0, n - 1, every) + rng.uniform(0.0, every)
    at = np.clip(due + rng.normal(0.0, shake * every, due.size), 0, n - 1).astype(int)
    keep = rng.random(at.size) > loses
    for start in rng.integers(0, at.size, rng.integers(0, 3)):
        keep[start : start + int(rng.integers(3, 0.06 * rate + 5))] = False
    at = np.unique(at[keep])
    return at, _START_NS + at * 1_000_000 + rng.integers(0, 900_000, at.size)


def signals(seed: int, faults: Sequence[FaultSpec], duration: float, tier: str) -> Signals:
    """A mission as a recorder has it; with ``spool`` spools as well, with ``direct`` second speeds and angles too."""
    (made, parts), has = build(seed), commands_of(seed)
    rng, noise = np.random.default_rng(104_000 + seed), np.random.default_rng(105_000 + seed)
    demand, _ = commands(seed, duration)
    ref, true, read, given, done, body, _ = driven(seed, tuple(faults), duration)
    n, loses, shake = demand.size, float(rng.choice([0.0, 0.003, 0.01])), float(rng.choice([0.0, 0.05, 0.15]))
    rates = {"drive": float(rng.choice([50.0, 100.0, 100.0, 200.0])), "steer": float(rng.choice([20.0, 50.0, 100.0]))}
    rates |= {"valve": rates["drive"] * float(rng.choice([0.5, 1.0])), "cmd": 50.0, "imu": 100.0, "gnss": 5.0}
    rows = {group: _rows(rng, n, r, loses, shake) for group, r in rates.items()}
    columns: dict[str, tuple[str, Array]] = {}
    for i, w in enumerate(WHEELS):
        columns[f"wheel.{w}.v"], columns[f"wheel.{w}.u"] = ("drive", read[:, i]), ("drive", given[:, i])
        if has != "body":
            columns[f"wheel.{w}.v_ref"] = "drive", ref[:, i]
        spool = done[:, i] * parts[i, 7] + parts[i, 8] + 0.003 * noise.standard_normal(n)
        second = true[:, i] * (1 + noise.uniform(-0.004, 0.004)) + 0.003 * made.top * noise.standard_normal(n)
        if tier != "base":
            columns[f"wheel.{w}.u_applied"] = "valve", spool
        if tier == "direct":
            columns[f"wheel.{w}.v_true"] = "drive", second
    for a, axle in enumerate(AXLES, 4):
        columns[f"steer.{axle}.phi"], columns[f"steer.{axle}.phi_ref"] = ("steer", read[:, a]), ("steer", ref[:, a])
        columns[f"steer.{axle}.u"] = "steer", given[:, a]
        if tier != "base":
            columns[f"steer.{axle}.u_applied"] = "steer", done[:, a] + 0.003 * noise.standard_normal(n)
        if tier == "direct":
            columns[f"steer.{axle}.phi_true"] = "steer", true[:, a] + 8e-4 * noise.standard_normal(n)
    if has != "wheels":
        columns["cmd.v"], columns["cmd.omega"] = ("cmd", body[:, 3]), ("cmd", body[:, 3] * body[:, 4])
    if rng.random() < 0.6:
        columns["imu.yaw_rate"] = "imu", body[:, 2] + noise.uniform(-0.002, 0.002) + 0.005 * noise.standard_normal(n)
    if rng.random() < 0.4:
        columns["gnss.speed"] = "gnss", np.abs(np.hypot(body[:, 0], body[:, 1]) + 0.03 * noise.standard_normal(n))
    items = {}
    for name, (group, values) in columns.items():
        at, stamps = rows[group]
        origin = SignalSource(topic=f"/{group}", field=name)
        items[name] = Signal(name, stamps, np.ascontiguousarray(values[at]), origin, NAME, guessed=False)
    return Signals(items, {}, (), (), open_loop=False)
