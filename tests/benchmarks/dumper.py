"""A dumper with steered axles whose valves fade as their coils warm: a machine of physics of its own.

One pump on an engine that droops feeds compensated valves, of which the most loaded starves first; overlaps differ by direction;
spool sensors of 10 bits rest off zero; speeds are timed from tooth to tooth, late at low speed and nothing below a least one; two
steering cylinders per axle have play and end stops; an operator holds, jumps, waits long and reverses; the skip is filled and
tipped. Messages come at about 100, 50 and 20 Hz with jitter. Each seed is another individual on another drive. For measuring only.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np
from dumper_physics import Array, Build, drive
from hydrostatic import AXLES, WHEELS, courses

from replay.faults import FaultSpec
from replay.log.source_options import SignalSource
from replay.machine.config import Machine
from replay.machine.toml_file import load_machine
from replay.signals.signal import Signal, Signals

NAME = "dumper"
STEP_S = 0.001
_START_NS = 1_801_000_000_000_000_000


@lru_cache(maxsize=4)
def build(seed: int) -> tuple[Build, Array]:
    """The machine of a seed, and what differs between its wheels, shape (4, 9)."""
    rng = np.random.default_rng(170_000 + seed)
    u = rng.uniform
    top, empty, radius, most = u(1.5, 3.6), u(2500.0, 9000.0), u(0.38, 0.6), u(230.0, 330.0) * 1e5
    motor = u(0.55, 0.75) * 9.81 * empty * 1.5 / 4 * radius / most
    flow, pump = u(1.15, 1.4) * motor * top / radius, u(1.0, 1.3) * 4 * motor * top / radius
    ahead, back = u(0.06, 0.16), u(0.06, 0.16)
    steer_ahead, steer_back = u(0.05, 0.13, 2)
    teeth = float(rng.choice([100, 128, 200]))
    parts = np.column_stack(
        [
            radius * (1 + u(-0.01, 0.01, 4)), ahead * u(0.9, 1.1, 4), back * u(0.9, 1.1, 4), u(0.95, 1.05, 4), u(-0.006, 0.006, 4),
            u(0.7, 1.4, 4), u(0.75, 1.3, 4), np.full(4, teeth), u(0.985, 1.01) * (1 + u(-0.004, 0.004, 4)),
        ]
    )  # fmt: skip
    made = Build(
        top=top, mass=empty, height=u(0.8, 1.3), cg=u(-0.05, 0.05), radius=radius, lateral=float(rng.choice([0.0, 0.1])),
        base=u(2.1, 3.2), track=u(1.5, 2.0), inertia=u(0.006, 0.012) * empty * radius**2, motor=motor, flow=flow,
        curve=u(0.9, 1.4), pump=pump, margin=u(14.0, 24.0) * 1e5, most=most, leakage=u(0.03, 0.06) * flow / most,
        friction=u(0.01, 0.03) * motor * most, power=u(0.5, 0.8) * pump * most, droop=u(0.05, 0.12), governor=u(0.5, 1.0),
        work=u(0.85, 1.0), fade=u(0.08, 0.16), warming=u(25.0, 80.0), spool=u(60.0, 120.0), stick=u(0.002, 0.006),
        know_ahead=ahead * u(0.75, 0.98), know_back=back * u(0.75, 0.98), forward=u(0.85, 1.0), proportional=u(0.08, 0.2),
        integral=u(0.2, 0.5), slew=u(2.0, 5.0), ramp=u(0.35, 0.8) * top, grip=u(0.55, 0.85), stiffness=u(7.0, 12.0),
        relaxation=u(0.25, 0.5), roll=u(0.02, 0.045), hill=float(rng.choice([0.02, 0.05, 0.09])), ackermann=u(0.5, 1.0),
        steer_rate=u(0.3, 0.55), steer_gain=u(2.0, 4.5), steer_ahead=steer_ahead, steer_back=steer_back,
        steer_flow=u(0.08, 0.18) * pump, tolerance=u(0.006, 0.012), play=u(0.001, 0.004), stop=u(0.42, 0.5),
        least=u(0.012, 0.025) * top, span=u(1.05, 1.4),
    )  # fmt: skip
    return made, parts


def commands_of(seed: int) -> str:
    """Which commands the individual's recorder has: of the body and of its wheels, of its wheels alone, of the body alone."""
    return str(np.random.default_rng(171_000 + seed).choice(["both", "wheels", "body"], p=[0.5, 0.3, 0.2]))


def machine_of(individual: tuple[Build, Array]) -> Machine:
    """The machine file as it is read: type plate and a tape measure."""
    made = individual[0]
    rng = np.random.default_rng(round(made.mass))
    base, track, wheel = (x * rng.uniform(0.98, 1.02) for x in (made.base, made.track, 2 * made.radius))
    text = (
        f'[machine]\nname = "{NAME}"\nwheels = ["FR", "FL", "RR", "RL"]\n\n[geometry]\nwheelbase = {base:.2f}\n'
        f"joint_spacing = {track:.2f}\nwheel_offset = {made.lateral:.2f}\nwheel_diameter = {wheel:.2f}\n"
        f'max_speed = {made.top * rng.uniform(0.95, 1.1):.1f}\nmax_steer = 0.45\n\n[control]\nlaw = "none"\n'
    )
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "machine.toml"
        path.write_text(text)
        return load_machine(path)


def commands(seed: int, duration: float) -> tuple[Array, ...]:
    """What an operator asks for, per millisecond: speed [m/s], angles of both axles [rad], shape (n, 2), mass [kg], its place ahead."""
    made, rng, n = build(seed)[0], np.random.default_rng(172_000 + seed), round(duration / STEP_S)
    speed, bend, rear, load = np.zeros(n), np.zeros(n), -np.ones(n), np.zeros(n)
    alone, at, sign = (
        commands_of(seed) == "wheels",
        round(rng.uniform(0.5, 6.0) / STEP_S),
        float(rng.choice([-1.0, 1.0])),
    )
    full = float(rng.choice([0.0, 0.6, 0.9]))
    load[:] = full
    while at < n:
        kind = str(rng.choice(["haul", "shunt", "creep", "work"], p=[0.4, 0.25, 0.15, 0.2]))
        legs, low, high, short, long = {
            "haul": (1, 0.5, 0.95, 7.0, 14.0), "shunt": (3, 0.2, 0.55, 2.0, 5.0), "creep": (1, 0.06, 0.2, 4.0, 9.0),
            "work": (2, 0.25, 0.7, 3.0, 7.0),
        }[kind]  # fmt: skip
        if alone:
            rear[at:] = float(rng.choice([-1.0, 0.0]))
        for _ in range(legs):
            end = min(at + round(rng.uniform(short, long) / STEP_S), n)
            speed[at:end] = sign * rng.uniform(low, high) * made.top  # held; changed by a step within some legs
            if rng.random() < 0.4:
                speed[(at + end) // 2 : end] = sign * rng.uniform(low, high) * made.top
            bend[at:end] = rng.uniform(-1.0, 1.0) * float(rng.random() < 0.65)
            if rng.random() < 0.4:
                bend[(at + end) // 2 : end] = rng.uniform(-1.0, 1.0)
            at, sign = end, -sign if kind == "shunt" else sign
        if rng.random() < 0.6:  # stands, is filled or tips
            at += round((rng.uniform(5.0, 14.0) if rng.random() < 0.35 else rng.uniform(0.5, 3.0)) / STEP_S)
            if rng.random() < 0.4:
                full = 0.0 if full > 0.4 else float(rng.uniform(0.5, 1.0))
                load[at:] = full
            sign = -sign if rng.random() < 0.5 else sign
    front = 0.36 * _smooth(bend, 0.6)
    angle = np.column_stack([front, _smooth(rear, 1.5, -1.0) * front])
    curve = np.abs(np.tan(angle[:, 0]) - np.tan(angle[:, 1])) / made.base
    limit = made.top * (1 - 0.45 * np.abs(front) / 0.36) / (1 + curve * made.track / 2)
    speed = _smooth(np.clip(speed, -limit, limit), 0.2)
    speed[np.abs(speed) < 0.01 * made.top] = 0.0
    load = _smooth(load, 2.0, float(load[0]))
    return speed, angle, made.mass * (1 + load), 0.1 * load


def _smooth(x: Array, seconds: float, start: float = 0.0) -> Array:
    weights = np.hanning(round(seconds / STEP_S))
    return np.asarray(start + np.convolve(x - start, weights / weights.sum())[: x.size])


def asked(seed: int, duration: float) -> tuple[Array, dict[str, Array]]:
    """Time [s] and what is asked of every wheel [m/s] and axle [rad] where nothing fails."""
    ref = driven(seed, (), duration)[0][::10]
    return np.arange(len(ref)) * 10 * STEP_S, dict(zip((*WHEELS, *AXLES), ref.T, strict=True))


@lru_cache(maxsize=8)
def driven(seed: int, faults: tuple[FaultSpec, ...], duration: float) -> tuple[Array, ...]:
    """The mission per millisecond; see `drive`."""
    (made, parts), rng = build(seed), np.random.default_rng(174_000 + seed)
    loss, sat = courses(faults, duration, seed, made.top)
    speed, angle, mass, ahead = commands(seed, duration)
    noise = rng.standard_normal((speed.size, 6)) * np.array([0.003] * 4 + [7e-4] * 2)
    noise[:, 4:] += rng.uniform(-0.004, 0.004, 2)
    return drive(speed, angle, mass, ahead, loss, sat, noise, rng.uniform(0.0, 2 * np.pi, 6), parts, made)


def _rows(rng: np.random.Generator, n: int, rate: float) -> tuple[np.ndarray, np.ndarray]:
    """Milliseconds at which a message is made, at a rate that is not quite what it says, and stamps [ns] of its arrival."""
    every = 1000.0 / rate * rng.uniform(0.999, 1.001)
    when = np.arange(rng.uniform(0.0, every), n - 2, every)
    at = np.unique(np.clip(when + rng.normal(0.0, 0.06 * every, when.size), 0, n - 1).astype(int))
    late = rng.uniform(0.5, 8.0) + rng.gamma(1.5, 0.1 * every, at.size)
    return at, _START_NS + np.maximum.accumulate(np.round((at + late) * 1e6).astype(np.int64)) + np.arange(at.size)


def signals(seed: int, faults: Sequence[FaultSpec], duration: float, tier: str) -> Signals:
    """A mission as a recorder has it; with ``spool`` spools as well, with ``direct`` second speeds and angles too."""
    made, has = build(seed)[0], commands_of(seed)
    rng, noise = np.random.default_rng(175_000 + seed), np.random.default_rng(176_000 + seed)
    ref, true, read, given, done, body, _ = driven(seed, tuple(faults), duration)
    n, columns = len(ref), {}
    bits, zero, gain = made.span / 512, rng.uniform(-0.02, 0.02), rng.uniform(0.98, 1.02, 6)
    spools = (
        np.round((gain * done + zero + rng.uniform(-0.004, 0.004, 6)) / bits + 0.3 * noise.standard_normal((n, 6)))
        * bits
    )
    gyro, gnss = rng.random(2) < 0.5
    for i, w in enumerate(WHEELS):
        columns[f"wheel.{w}.v"], columns[f"wheel.{w}.u"] = (100.0, read[:, i]), (50.0, given[:, i])
        if has != "body":
            columns[f"wheel.{w}.v_ref"] = 50.0, ref[:, i]
        if tier != "base":
            columns[f"wheel.{w}.u_applied"] = 100.0, spools[:, i]
        if tier == "direct":
            second = true[:, i] * (1 + noise.uniform(-0.005, 0.005)) + 0.004 * made.top * noise.standard_normal(n)
            columns[f"wheel.{w}.v_true"] = 50.0, second
    for a, axle in enumerate(AXLES, 4):
        columns[f"steer.{axle}.phi"], columns[f"steer.{axle}.phi_ref"] = (100.0, read[:, a]), (50.0, ref[:, a])
        columns[f"steer.{axle}.u"] = 50.0, given[:, a]
        if tier != "base":
            columns[f"steer.{axle}.u_applied"] = 100.0, spools[:, a]
        if tier == "direct":
            columns[f"steer.{axle}.phi_true"] = 50.0, true[:, a] + 1e-3 * noise.standard_normal(n)
    if has != "wheels":
        columns["cmd.v"], columns["cmd.omega"] = (20.0, body[:, 3]), (20.0, body[:, 3] * body[:, 4])
    if gyro:
        columns["imu.yaw_rate"] = 100.0, body[:, 2] + noise.uniform(-0.008, 0.008) + 0.006 * noise.standard_normal(n)
    if gnss:
        columns["gnss.speed"] = 10.0, np.abs(body[:, 0] + 0.03 * noise.standard_normal(n))
    items = {}
    for name, (rate, values) in columns.items():
        at, stamps = _rows(rng, n, rate)
        origin = SignalSource(topic=f"/{name.split('.')[0]}", field=name)
        items[name] = Signal(name, stamps, np.ascontiguousarray(values[at]), origin, NAME, guessed=False)
    return Signals(items, {}, (), (), open_loop=False)
