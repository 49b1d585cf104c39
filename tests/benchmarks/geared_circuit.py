"""A container carrier with a closed hydraulic circuit for every wheel: a machine of physics that no other one of `all_clear.py` has.

Pumps of variable displacement on a diesel whose throttle the operator moves, hoses that ring, motors of two displacements that are
shifted, a dead band and another gain by direction, oil that warms and takes up to 15 % of the gain, containers that are picked up
and put down, ramps, soft and slick ground, encoders counted in windows and sent at 25 or 50 Hz on a bus that is late and loses
frames, an operator who stands, creeps and changes his mind. Each seed is another individual on another drive. Faults are those of
L16 (4) and (8): on what the controller sees of speeds and angles, and on what a valve makes of its command. For measuring only.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np
from geared_circuit_control import drive
from geared_circuit_physics import Array, Build
from hydrostatic import AXLES, WHEELS, courses

from replay.faults import FaultSpec
from replay.log.source_options import SignalSource
from replay.machine.config import Machine
from replay.machine.toml_file import load_machine
from replay.signals.signal import Signal, Signals

NAME = "geared_circuit"
STEP_S = 0.001
_START_NS = 1_792_000_000_000_000_000
_BAR = 1e5
#: What an individual's recorder has of the commands: of the body and of its wheels, of its wheels alone, of the body alone.
COMMANDS = ("both", "wheels", "body")
#: Manoeuvres of a drive and how likely each is.
MANOEUVRES = {"haul": 0.28, "place": 0.26, "creep": 0.16, "turn": 0.14, "stand": 0.16}


@lru_cache(maxsize=4)
def build(seed: int) -> tuple[Build, Array]:
    """The machine of a seed, and what differs between its wheels, shape (4, 9)."""
    rng = np.random.default_rng(120_000 + seed)
    u = rng.uniform
    top, empty, radius, most = u(1.0, 3.2), u(7000.0, 26000.0), u(0.45, 0.8), u(300.0, 420.0) * _BAR
    ratio, lateral = u(1.3, 2.0), float(rng.choice([0.0, 0.1]))
    small = u(0.42, 0.6) * 9.81 * empty * 1.3 / 4 * radius / most / ratio  # m³/rad: what it climbs
    pump, frame = u(1.35, 1.6) * small * top / radius, int(rng.choice([40, 80]))  # of half a millisecond: 50 or 25 Hz
    windows = int(rng.choice([2, 3, 4])) if frame == 40 else int(rng.choice([1, 2]))
    give, ring, dead, asymmetry = u(1.5, 3.0) * small * ratio / 4e9, u(12.0, 35.0) * 6.28, u(0.03, 0.1), u(0.0, 0.08)
    hose = 2 / (give * ring**2)
    parts = np.column_stack(
        [
            radius * u(0.97, 0.995) * (1 + u(-0.012, 0.012, 4)),
            dead * u(0.85, 1.15, 4),
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
        cycle=int(rng.choice([20, 40])),
        frame=frame,
        windows=windows,
        mass=empty,
        height=u(0.9, 1.9),
        cg=u(-0.07, 0.07),
        radius=radius,
        lateral=lateral,
        base=u(2.6, 4.6),
        track=u(1.7, 2.6),
        inertia=u(0.006, 0.012) * empty * radius**2,
        small=small,
        ratio=ratio,
        pump=pump,
        give=give,
        hose=hose,
        damping=u(8.0, 20.0) * _BAR / pump,
        most=most,
        relief=u(0.9, 1.0) * most,
        leakage=u(0.015, 0.03) * pump / most,
        friction=u(0.012, 0.03) * small * ratio * most,
        stiction=u(1.2, 2.0),
        stribeck=u(0.05, 0.2),
        loss=u(0.03, 0.07),
        power=u(1.4, 2.0) * pump * most,
        droop=u(0.02, 0.06),
        governor=u(0.5, 1.0),
        cold=u(15.0, 45.0),
        warming=u(12.0, 30.0),
        fade=u(0.05, 0.15),
        coil=u(0.012, 0.03),
        lag=u(0.04, 0.1),
        rate=u(3.0, 8.0),
        hysteresis=u(0.003, 0.012),
        dead=dead,
        known=u(0.7, 1.0),
        forward=u(0.92, 1.05),
        proportional=u(0.03, 0.09),
        integral=u(0.12, 0.3),
        authority=u(0.25, 0.45),
        slew=u(2.5, 6.0),
        ramp=u(0.3, 0.7) * top,
        brake_ramp=u(0.4, 0.9) * top,
        pitch=u(0.004, 0.014) * top * windows * frame * 0.0005,
        stiffness=u(6.0, 13.0),
        shape=u(1.2, 1.6),
        relaxation=u(0.3, 0.6),
        grip=u(0.6, 0.9),
        roll=u(0.012, 0.03),
        hill=float(rng.choice([0.02, 0.04, 0.07])),
        hill_length=u(3.0, 9.0),
        ackermann=u(0.6, 1.0),
        steer_rate=u(0.25, 0.5),
        asymmetry=u(0.03, 0.2),
        mirrored=float(rng.choice([-1.0, 1.0])),
        steer_gain=u(2.0, 4.0),
        steer_dead=u(0.03, 0.09),
        tolerance=u(0.005, 0.01),
        play=u(0.001, 0.004),
        rear=float(rng.choice([0.7, 1.0])) if commands_of(seed) == "wheels" else 1.0,
    )
    return made, parts


def commands_of(seed: int) -> str:
    """Which commands the individual's recorder has, of `COMMANDS`."""
    return COMMANDS[int(np.random.default_rng(121_000 + seed).choice([0, 0, 1, 2]))]


def machine_of(individual: tuple[Build, Array]) -> Machine:
    """The machine file as it is read: type plate and a tape measure; nothing of pumps, motors and engine."""
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


def commands(seed: int, duration: float) -> tuple[Array, ...]:
    """What an operator asks for, per millisecond: speed of the body [m/s], angles of both axles [rad], shape (n, 2), low gear,
    throttle [of rated speed], mass [kg] and how far ahead of the middle it hangs [of base].
    """
    made, rng, n = build(seed)[0], np.random.default_rng(122_000 + seed), round(duration / STEP_S)
    speed, bend, low, throttle, mass, ahead = (
        np.zeros(n),
        np.zeros(n),
        np.ones(n),
        np.full(n, 0.75),
        np.zeros(n),
        np.zeros(n),
    )
    at, sign, heavy = round(rng.uniform(1.0, 4.0) / STEP_S), float(rng.choice([-1.0, 1.0])), False
    share, hangs = rng.uniform(0.1, 0.45), rng.uniform(-0.06, 0.06)
    while at < n:
        kind = str(rng.choice(list(MANOEUVRES), p=list(MANOEUVRES.values())))
        legs, least, most, shortest, longest, curve, rev = {
            "haul": (1, 0.6, 1.0, 6.0, 13.0, 0.3, 1.0),
            "place": (3, 0.1, 0.4, 2.0, 5.0, 0.7, 0.85),
            "creep": (1, 0.03, 0.1, 4.0, 9.0, 0.4, 0.75),
            "turn": (1, 0.15, 0.4, 4.0, 8.0, 1.0, 0.85),
            "stand": (1, 0.0, 0.0, 4.0, 12.0, 0.0, 0.65),
        }[kind]
        for _ in range(legs):
            end = min(at + round(rng.uniform(shortest, longest) / STEP_S), n)
            shaky = np.repeat(rng.normal(0.0, 0.09, (end - at) // 400 + 1), 400)[: end - at]  # a hand that corrects
            speed[at:end] = sign * rng.uniform(least, most) * made.top * np.clip(1 + shaky, 0.5, 1.3)
            bend[at:end] = curve * rng.uniform(0.3, 1.0) * rng.choice([-1.0, 0.0, 1.0], p=[0.4, 0.2, 0.4])
            if rng.random() < 0.5:  # a bend within the leg
                bend[(at + end) // 2 : end] = curve * rng.uniform(-1.0, 1.0)
            low[at:], throttle[at:end] = float(kind != "haul"), np.clip(rev * rng.uniform(0.92, 1.08), 0.65, 1.0)
            if kind == "stand" and end - at > 5000 and rng.random() < 0.7:  # a container comes or goes
                heavy = not heavy
                mass[(at + end) // 2 :], ahead[(at + end) // 2 :] = share * heavy, hangs * heavy
            elif kind == "stand":
                bend[at:end] = rng.uniform(-0.6, 0.6) * (rng.random() < 0.3)  # turns the wheels while it stands
            at, sign = end, -sign if kind == "place" and rng.random() < 0.6 else sign
        if rng.random() < 0.4:
            at, sign = at + round(rng.uniform(0.5, 4.0) / STEP_S), -sign if rng.random() < 0.5 else sign
    front = 0.4 * _smooth(bend, rng.uniform(0.8, 1.6))
    angle = np.column_stack([front, -made.rear * front])
    curve_of = np.abs(np.tan(angle[:, 0]) - np.tan(angle[:, 1])) / made.base
    limit = (
        made.top
        * throttle
        * np.where(low > 0, 1 / made.ratio, 1.05)
        * (1 - 0.4 * np.abs(front) / 0.4)
        / (1 + curve_of * made.track / 2)
    )
    speed = _smooth(np.clip(speed, -limit, limit), rng.uniform(0.3, 0.8))
    speed[np.abs(speed) < 0.008 * made.top] = 0.0
    return speed, angle, low, _smooth(throttle, 1.0, 0.75), made.mass * (1 + _smooth(mass, 2.0)), _smooth(ahead, 2.0)


def _smooth(x: Array, seconds: float, start: float = 0.0) -> Array:
    """As a hand on a lever does it."""
    weights = np.hanning(round(seconds / STEP_S))
    return np.asarray(start + np.convolve(x - start, weights / weights.sum())[: x.size])


def asked(seed: int, duration: float) -> tuple[Array, dict[str, Array]]:
    """Time [s] and what is asked of every wheel [m/s] and axle [rad] where nothing fails."""
    ref = driven(seed, (), duration)[0][::10]
    return np.arange(len(ref)) * 10 * STEP_S, dict(zip((*WHEELS, *AXLES), ref.T, strict=True))


def frames_of(seed: int, duration: float) -> Array:
    """Whether a frame of the front's and of the rear's sensors arrives in a millisecond, shape (n, 2): late by some, some never."""
    made, rng, n = build(seed)[0], np.random.default_rng(123_000 + seed), round(duration / STEP_S)
    out, every, loses = np.zeros((n, 2)), made.frame // 2, float(rng.choice([0.002, 0.01, 0.03]))
    for a in range(2):
        due = np.arange(0, n, every)
        late = rng.gamma(1.5, 1.5, due.size).astype(int) + int(rng.integers(0, every // 2))
        due = np.clip(due + np.minimum(late, every - 2), 0, n - 1)[rng.random(due.size) > loses]
        for start in rng.integers(0, due.size, rng.integers(0, 3)):  # a bus that is busy
            due[start : start + int(rng.integers(2, 6))] = due[start]
        out[due, a] = 1.0
    return out


@lru_cache(maxsize=8)
def driven(seed: int, faults: tuple[FaultSpec, ...], duration: float) -> tuple[Array, ...]:
    """The mission per millisecond; see `drive`."""
    (made, parts), rng = build(seed), np.random.default_rng(124_000 + seed)
    speed, angle, low, throttle, mass, ahead = commands(seed, duration)
    loss, sat = courses(faults, duration, seed, made.top)
    noise = rng.standard_normal((speed.size, 2)) * 6e-4 + rng.uniform(
        -0.004, 0.004, 2
    )  # how well they were set to zero
    field, frames = rng.uniform(0.0, 2 * np.pi, 6), frames_of(seed, duration)
    return drive(speed, angle, low, throttle, mass, ahead, frames, loss, sat, noise, field, parts, made)


def _rows(rng: np.random.Generator, n: int, rate: float, loses: float) -> tuple[np.ndarray, np.ndarray]:
    """Milliseconds at which a recorder takes its rows, and their stamps [ns]: late by some of a period, and some are lost."""
    every = 1000.0 / rate
    due = np.arange(rng.uniform(0.0, every), n - 1, every)
    at = np.unique(
        np.clip(due + rng.gamma(1.2, 0.06 * every, due.size), 0, n - 1).astype(int)[rng.random(due.size) > loses]
    )
    return at, _START_NS + at * 1_000_000 + rng.integers(0, 900_000, at.size)


def signals(seed: int, faults: Sequence[FaultSpec], duration: float, tier: str) -> Signals:
    """A mission as a recorder has it; with ``spool`` spools as well, with ``direct`` second speeds and angles too."""
    (made, parts), has = build(seed), commands_of(seed)
    rng, noise = np.random.default_rng(125_000 + seed), np.random.default_rng(126_000 + seed)
    demand = commands(seed, duration)[0]
    ref, true, read, given, done, body, _ = driven(seed, tuple(faults), duration)
    n, loses = demand.size, float(rng.choice([0.0, 0.003, 0.01]))
    rates = {"command": float(rng.choice([20.0, 50.0, 100.0])), "spool": float(rng.choice([25.0, 50.0]))}
    rates |= {"second": float(rng.choice([20.0, 50.0])), "lever": 20.0, "imu": float(rng.choice([50.0, 100.0]))}
    rows = {group: _rows(rng, n, r, loses) for group, r in rates.items()}
    for axle, frame in zip(AXLES, frames_of(seed, duration).T, strict=True):
        at = np.flatnonzero(frame)
        rows[axle] = at, _START_NS + at * 1_000_000 + rng.integers(0, 900_000, at.size)
    columns: dict[str, tuple[str, Array]] = {}
    for i, w in enumerate(WHEELS):
        columns[f"wheel.{w}.v"], columns[f"wheel.{w}.u"] = (AXLES[i // 2], read[:, i]), ("command", given[:, i])
        if has != "body":
            columns[f"wheel.{w}.v_ref"] = "command", ref[:, i]
        spool = done[:, i] * parts[i, 7] + parts[i, 8] + 0.003 * noise.standard_normal(n)
        second = true[:, i] * (1 + noise.uniform(-0.004, 0.004)) + 0.004 * made.top * noise.standard_normal(n)
        if tier != "base":
            columns[f"wheel.{w}.u_applied"] = "spool", spool
        if tier == "direct":
            columns[f"wheel.{w}.v_true"] = "second", second
    for a, axle in enumerate(AXLES, 4):
        columns[f"steer.{axle}.phi"], columns[f"steer.{axle}.phi_ref"] = (axle, read[:, a]), ("command", ref[:, a])
        columns[f"steer.{axle}.u"] = "command", given[:, a]
        if tier != "base":
            columns[f"steer.{axle}.u_applied"] = "spool", done[:, a] + 0.003 * noise.standard_normal(n)
        if tier == "direct":
            columns[f"steer.{axle}.phi_true"] = "second", true[:, a] + 1e-3 * noise.standard_normal(n)
    if has != "wheels":
        columns["cmd.v"], columns["cmd.omega"] = ("lever", body[:, 3]), ("lever", body[:, 3] * body[:, 4])
    if rng.random() < 0.7:
        drift = noise.uniform(-0.008, 0.008) + noise.uniform(-0.004, 0.004) * np.arange(n) / n
        columns["imu.yaw_rate"] = "imu", body[:, 2] + drift + 0.005 * noise.standard_normal(n)
    items = {}
    for name, (group, values) in columns.items():
        at, stamps = rows[group]
        origin = SignalSource(topic=f"/{group}", field=name)
        items[name] = Signal(name, stamps, np.ascontiguousarray(values[at]), origin, NAME, guessed=False)
    return Signals(items, {}, (), (), open_loop=False)
