"""A forwarder that loads logs, with a gear pump for every axle and valves that nothing compensates: a machine of physics of its own.

The more loaded wheel of an axle sets the pressure, the other one gets more flow for the same opening; a vent takes the pressure off
above a limit and gives it back below a lower one; oil that is cold at first makes small openings slow and leaks more as it warms; the
engine idles where nothing moves, droops, and lends power to a crane that loads grapple by grapple; stumps, banks and soft ground;
tachos with ripple behind filters and converters of 12 bits; messages at 200 Hz that are late by channel. Each seed is another
individual on another drive. Faults are those of L16 (4) and (8): on what the controller sees of speeds and angles, and on what a
valve makes of its command. For measuring only.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np
from forwarder_control import drive
from forwarder_physics import Array, Build
from hydrostatic import AXLES, WHEELS, courses

from replay.faults import FaultSpec
from replay.log.source_options import SignalSource
from replay.machine.config import Machine
from replay.machine.toml_file import load_machine
from replay.signals.signal import Signal, Signals

NAME = "forwarder"
STEP_S = 0.001
_START_NS = 1_795_000_000_000_000_000
_BAR = 1e5
#: What an individual's recorder has of the commands: of the body and of its wheels, of its wheels alone, of the body alone.
COMMANDS = ("both", "wheels", "body")
#: Manoeuvres of a drive and how likely each is.
MANOEUVRES = {"strip": 0.3, "road": 0.2, "load": 0.2, "shunt": 0.16, "turn": 0.14}


@lru_cache(maxsize=4)
def build(seed: int) -> tuple[Build, Array]:
    """The machine of a seed, and what differs between its wheels, shape (4, 12)."""
    rng = np.random.default_rng(140_000 + seed)
    u = rng.uniform
    top, empty, radius, most = u(1.2, 3.2), u(6000.0, 18000.0), u(0.45, 0.7), u(280.0, 380.0) * _BAR
    motor = u(0.5, 0.65) * 9.81 * empty * 1.3 / 4 * radius / most  # m³/rad: what it climbs
    flow, cut = u(1.15, 1.35) * motor * top / radius, u(0.86, 0.95) * most
    pump, dead, gap = u(1.15, 1.4) * 2 * motor * top / radius, u(0.05, 0.2), u(0.0, 0.08)
    parts = np.column_stack(
        [
            radius * u(0.97, 0.995) * (1 + u(-0.012, 0.012, 4)),
            dead * u(0.9, 1.1, 4),
            (1 + gap) * u(0.96, 1.04, 4),
            (1 - gap) * u(0.96, 1.04, 4),
            u(-0.008, 0.008, 4),
            u(0.7, 1.4, 4),
            u(0.8, 1.25, 4),
            u(0.988, 1.012, 4),
            u(-0.002, 0.002, 4),
            u(0.003, 0.012, 4),
            u(0.985, 1.015, 4),
            u(-0.004, 0.004, 4),
        ]
    )
    made = Build(
        top=top, cycle=int(rng.choice([20, 40])), mass=empty, height=u(1.0, 1.6), cg=u(-0.02, 0.12), radius=radius,
        lateral=float(rng.choice([0.0, 0.08])), base=u(2.8, 4.6), track=u(1.7, 2.4), inertia=u(0.006, 0.012) * empty * radius**2,
        motor=motor, lobes=float(rng.choice([6, 8, 9])), ripple=u(0.004, 0.02), flow=flow, curve=u(1.0, 1.5), out=u(0.8, 1.0),
        pump=pump, margin=u(16.0, 26.0) * _BAR, comp_lag=u(0.01, 0.03), cut=cut, back=u(0.8, 0.9), most=most,
        line=u(2.0, 5.0) * motor, hose=u(1.5, 3.0) * motor, leakage=u(0.02, 0.05) * flow / most, thin=u(0.018, 0.03),
        friction=u(0.012, 0.03) * motor * most, stiction=u(1.2, 1.8), loss=u(0.03, 0.07), laminar=u(0.3, 1.5) * _BAR,
        power=u(0.8, 1.2) * pump * most, droop=u(0.04, 0.1), governor=u(0.4, 0.8), idle=u(0.5, 0.65), cold=u(8.0, 45.0),
        warming=u(20.0, 60.0), coil=u(0.02, 0.05), hysteresis=u(0.01, 0.02), dead=dead, known=u(0.75, 0.95),
        forward=u(0.88, 1.0), proportional=u(0.05, 0.15), integral=u(0.15, 0.35), leak=u(4.0, 10.0), authority=u(0.25, 0.45),
        slew=u(2.5, 6.0), ramp=u(0.3, 0.6) * top, brake_ramp=u(0.4, 0.8) * top, filter=u(0.03, 0.08), step=1.5 * top,
        tacho_drift=u(-0.006, 0.006), grip=u(0.6, 0.85), stiffness=u(6.0, 11.0), relaxation=u(0.3, 0.6), roll=u(0.02, 0.04),
        hill=float(rng.choice([0.02, 0.06, 0.1])), hill_length=u(3.0, 8.0), bump=float(rng.choice([0.0, 0.04, 0.1])),
        ackermann=u(0.6, 1.0), steer_rate=u(0.25, 0.45), steer_flow=u(0.1, 0.2) * pump, asymmetry=u(0.03, 0.18),
        mirrored=float(rng.choice([-1.0, 1.0])), steer_gain=u(2.0, 4.0), steer_dead=u(0.03, 0.1), tolerance=u(0.005, 0.01),
        play=u(0.001, 0.004), pot=u(0.02, 0.05),
    )  # fmt: skip
    return made, parts


def commands_of(seed: int) -> str:
    """Which commands the individual's recorder has, of `COMMANDS`."""
    return COMMANDS[int(np.random.default_rng(141_000 + seed).choice([0, 0, 1, 2]))]


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
    """What an operator asks for, per millisecond: speed of the body [m/s], angles of both axles [rad], shape (n, 2), mass [kg], how far
    ahead [of base] and aside [of track] of the middle it hangs, power of the crane [of the engine's].
    """
    made, rng, n = build(seed)[0], np.random.default_rng(142_000 + seed), round(duration / STEP_S)
    speed, bend, rear, extra, swing, crane = (np.zeros(n) for _ in range(6))
    alone = commands_of(seed) == "wheels"  # steers with the front axle alone for some of the way
    at, sign, heavy = round(rng.uniform(1.0, 4.0) / STEP_S), float(rng.choice([-1.0, 1.0])), rng.uniform(0.0, 0.3)
    extra[:], rear[:] = heavy, -1.0
    while at < n:
        kind = str(rng.choice(list(MANOEUVRES), p=list(MANOEUVRES.values())))
        legs, least, most, shortest, longest, curve = {
            "strip": (2, 0.15, 0.5, 3.0, 7.0, 0.5),
            "road": (1, 0.6, 1.0, 6.0, 12.0, 0.25),
            "load": (2, 0.05, 0.15, 1.5, 3.0, 0.3),
            "shunt": (3, 0.2, 0.5, 2.0, 4.5, 0.7),
            "turn": (1, 0.2, 0.45, 4.0, 8.0, 1.0),
        }[kind]
        if alone and kind in ("road", "turn"):
            rear[at:] = float(rng.choice([-1.0, 0.0]))
        for _ in range(legs):
            if kind == "load":  # the crane takes a grapple of logs
                end = min(at + round(rng.uniform(3.0, 6.0) / STEP_S), n)
                side = rng.uniform(-0.08, 0.08)
                crane[at:end], swing[at:end] = rng.uniform(0.1, 0.3), side
                heavy = min(heavy + rng.uniform(0.03, 0.1), 0.8)
                extra[(at + end) // 2 :] = heavy
                at = end
            end = min(at + round(rng.uniform(shortest, longest) / STEP_S), n)
            shaky = np.repeat(rng.normal(0.0, 0.05, (end - at) // 500 + 1), 500)[: end - at]  # a hand that corrects
            speed[at:end] = sign * rng.uniform(least, most) * made.top * np.clip(1 + shaky, 0.6, 1.3)
            bend[at:end] = curve * rng.uniform(0.3, 1.0) * rng.choice([-1.0, 0.0, 1.0], p=[0.4, 0.2, 0.4])
            if rng.random() < 0.5:  # a bend within the leg
                bend[(at + end) // 2 : end] = curve * rng.uniform(-1.0, 1.0)
            at, sign = end, -sign if kind == "shunt" else sign
        if rng.random() < 0.45:
            at, sign = at + round(rng.uniform(0.5, 5.0) / STEP_S), -sign if rng.random() < 0.5 else sign
    front = 0.38 * _smooth(bend, rng.uniform(0.8, 1.6))
    angle = np.column_stack([front, _smooth(rear, 2.0, -1.0) * front])
    curve_of = np.abs(np.tan(angle[:, 0]) - np.tan(angle[:, 1])) / made.base
    limit = made.top * (1 - 0.4 * np.abs(front) / 0.38) / (1 + curve_of * made.track / 2)
    speed = _smooth(np.clip(speed, -limit, limit), rng.uniform(0.3, 0.8))
    speed[np.abs(speed) < 0.008 * made.top] = 0.0
    extra = _smooth(extra, 1.5, float(extra[0]))
    return speed, angle, made.mass * (1 + extra), -0.12 * extra, _smooth(swing, 2.0), crane


def _smooth(x: Array, seconds: float, start: float = 0.0) -> Array:
    """As a hand on a lever does it."""
    weights = np.hanning(round(seconds / STEP_S))
    return np.asarray(start + np.convolve(x - start, weights / weights.sum())[: x.size])


def asked(seed: int, duration: float) -> tuple[Array, dict[str, Array]]:
    """Time [s] and what is asked of every wheel [m/s] and axle [rad] where nothing fails."""
    ref = driven(seed, (), duration)[0][::10]
    return np.arange(len(ref)) * 10 * STEP_S, dict(zip((*WHEELS, *AXLES), ref.T, strict=True))


@lru_cache(maxsize=8)
def driven(seed: int, faults: tuple[FaultSpec, ...], duration: float) -> tuple[Array, ...]:
    """The mission per millisecond; see `drive`."""
    (made, parts), rng = build(seed), np.random.default_rng(144_000 + seed)
    speed, angle, mass, ahead, aside, crane = commands(seed, duration)
    loss, sat = courses(faults, duration, seed, made.top)
    size = np.array([0.0015 * made.top] * 4 + [6e-4] * 2)
    noise = rng.standard_normal((speed.size, 6)) * size
    noise[:, 4:] += rng.uniform(-0.004, 0.004, 2)  # how well they were set to zero
    field = rng.uniform(0.0, 2 * np.pi, 6)
    return drive(speed, angle, mass, ahead, aside, crane, loss, sat, noise, field, parts, made)


def _rows(rng: np.random.Generator, n: int, rate: float, loses: float) -> tuple[np.ndarray, np.ndarray]:
    """Milliseconds at which a message is made, and stamps [ns] of its arrival: a channel's own delay, jitter, and some are lost."""
    every = 1000.0 / rate
    at = np.unique(np.arange(rng.uniform(0.0, every), n - 1, every).astype(int))
    at = at[rng.random(at.size) > loses]
    late = rng.uniform(0.5, 12.0) + rng.gamma(1.3, 0.15 * every, at.size)
    stamps = np.maximum.accumulate(np.round((at + late) * 1e6).astype(np.int64))
    return at, _START_NS + stamps + np.arange(at.size)  # messages never overtake one another


def signals(seed: int, faults: Sequence[FaultSpec], duration: float, tier: str) -> Signals:
    """A mission as a recorder has it; with ``spool`` spools as well, with ``direct`` second speeds and angles too."""
    (made, parts), has = build(seed), commands_of(seed)
    rng, noise = np.random.default_rng(145_000 + seed), np.random.default_rng(146_000 + seed)
    ref, true, read, given, done, body, _ = driven(seed, tuple(faults), duration)
    n, loses = len(ref), float(rng.choice([0.0, 0.002, 0.01]))
    columns: dict[str, tuple[float, Array]] = {}
    for i, w in enumerate(WHEELS):
        columns[f"wheel.{w}.v"], columns[f"wheel.{w}.u"] = (200.0, read[:, i]), (200.0, given[:, i])
        if has != "body":
            columns[f"wheel.{w}.v_ref"] = 200.0, ref[:, i]
        spool = done[:, i] * parts[i, 10] + parts[i, 11] + 0.003 * noise.standard_normal(n)
        second = true[:, i] * (1 + noise.uniform(-0.004, 0.004)) + 0.003 * made.top * noise.standard_normal(n)
        if tier != "base":
            columns[f"wheel.{w}.u_applied"] = 200.0, np.round(spool * 2048) / 2048
        if tier == "direct":
            columns[f"wheel.{w}.v_true"] = 100.0, second
    for a, axle in enumerate(AXLES, 4):
        columns[f"steer.{axle}.phi"], columns[f"steer.{axle}.phi_ref"] = (200.0, read[:, a]), (100.0, ref[:, a])
        columns[f"steer.{axle}.u"] = 100.0, given[:, a]
        if tier != "base":
            columns[f"steer.{axle}.u_applied"] = 200.0, done[:, a] + 0.003 * noise.standard_normal(n)
        if tier == "direct":
            columns[f"steer.{axle}.phi_true"] = 100.0, true[:, a] + 1e-3 * noise.standard_normal(n)
    if has != "wheels":
        columns["cmd.v"], columns["cmd.omega"] = (50.0, body[:, 3]), (50.0, body[:, 3] * body[:, 4])
    if rng.random() < 0.7:
        drift = noise.uniform(-0.006, 0.006) + noise.uniform(-0.003, 0.003) * np.arange(n) / n
        columns["imu.yaw_rate"] = 100.0, body[:, 2] + drift + 0.005 * noise.standard_normal(n)
    items = {}
    for name, (rate, values) in columns.items():
        at, stamps = _rows(rng, n, rate, loses)
        origin = SignalSource(topic=f"/{name.split('.')[0]}", field=name)
        items[name] = Signal(name, stamps, np.ascontiguousarray(values[at]), origin, NAME, guessed=False)
    return Signals(items, {}, (), (), open_loop=False)
