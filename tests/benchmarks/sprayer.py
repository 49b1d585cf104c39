"""A field sprayer on four driven and steered wheels, fed from an accumulator: a machine of physics of its own.

The supply swings between two pressures, orifices on it give less where the load is high, and spools have hysteresis and a
limited rate; the controller knows its overlap too well or too little; nodes time pole wheels 10 to 25 times a second, late at
low speed, nothing below a least one; tyres roll at radii that its emptying, sloshing tank changes; slopes, ruts and wet ground come
by side; steering cylinders are slower to one side. Topics come at rates of their own, with losses, in batches of nearly one
stamp. Each seed is another individual on another drive. For measuring only.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np
from hydrostatic import AXLES, WHEELS, courses
from sprayer_control import drive
from sprayer_physics import Array, Build

from replay.faults import FaultSpec
from replay.log.source_options import SignalSource
from replay.log.stamp_order import spread_ticks
from replay.machine.config import Machine
from replay.machine.toml_file import load_machine
from replay.signals.signal import Signal, Signals

NAME = "sprayer"
STEP_S = 0.001
_START_NS = 1_805_000_000_000_000_000


@lru_cache(maxsize=4)
def build(seed: int) -> tuple[Build, Array]:
    """The machine of a seed, and what differs between its wheels, shape (4, 9)."""
    rng = np.random.default_rng(180_000 + seed)
    u = rng.uniform
    top, empty, radius, high = u(1.8, 4.5), u(2500.0, 9000.0), u(0.5, 0.85), u(190.0, 260.0) * 1e5
    tank, sink, dead = u(0.3, 0.7), u(0.015, 0.04), u(0.03, 0.12)
    motor = u(0.42, 0.55) * 9.81 * empty * (1 + tank) / 4 * radius / high  # m³/rad: twice what its steepest hill takes
    need = motor * top / radius
    least = u(0.01, 0.02) * top
    rolls = radius - sink / 3 * (1 + 0.5 * tank)  # at half a tank, where the speeds are calibrated
    scale = rolls / radius * u(0.99, 1.01)
    parts = np.column_stack(
        [
            radius * (1 + u(-0.006, 0.006, 4)), dead * u(0.9, 1.1, 4), u(0.96, 1.04, 4), u(0.95, 1.03, 4), u(-0.006, 0.006, 4),
            u(0.7, 1.5, 4), u(0.75, 1.3, 4), u(-0.004, 0.004, 4), scale * (1 + u(-0.003, 0.003, 4)),
        ]
    )  # fmt: skip
    made = Build(
        top=top, mass=empty, tank=tank, slosh=u(0.2, 0.5), slosh_rate=u(2.5, 4.5), height=u(1.1, 1.5), cg=u(-0.04, 0.06),
        radius=radius, sink=sink, lateral=float(rng.choice([0.0, 0.12])), base=u(2.5, 3.6), track=u(1.8, 2.6),
        inertia=u(0.006, 0.012) * empty * radius**2, motor=motor, flow=u(1.5, 1.9) * need, high=high, low=u(0.82, 0.92) * high,
        capacity=u(1.5, 5.0) * need / high * 4, pump=u(1.2, 1.5) * 4 * need, power=u(0.9, 1.3) * 4 * need * high, droop=u(0.04, 0.12),
        governor=u(0.4, 0.9), cold=u(5.0, 40.0), warming=u(40.0, 150.0), drift=u(0.001, 0.003), thin=u(0.015, 0.03),
        leakage=u(0.015, 0.035) * need / high, leak_rise=u(0.5, 2.0), friction=u(0.01, 0.03) * motor * high, stiction=u(0.4, 1.0),
        spool=u(35.0, 80.0), damping=u(0.6, 0.95), spool_rate=u(4.0, 12.0), hysteresis=u(0.003, 0.015), dead=dead,
        known=u(0.7, 1.12), forward=u(0.85, 1.02), proportional=u(0.16, 0.32), integral=u(0.4, 0.8), unwind=u(0.3, 0.8),
        slew=u(2.0, 5.0), ramp=u(0.25, 0.5) * top, cruise=float(rng.choice([0.0, u(0.05, 0.15)])), delay=int(rng.integers(20, 60)),
        node=int(rng.choice([80, 100, 120, 200])), teeth=float(rng.choice([100, 160, 240])), tick=u(1e-4, 5e-4), least=least, wait=u(0.25, 0.7),
        grip=u(0.55, 0.85), stiffness=u(7.0, 12.0), relaxation=u(0.3, 0.6), roll=u(0.025, 0.05),
        hill=float(rng.choice([0.03, 0.07, 0.12])), hill_length=u(6.0, 15.0), wet=float(rng.choice([0.2, 0.6, 1.0])),
        ackermann=u(0.5, 1.0), steer_rate=u(0.3, 0.5), steer_gain=u(2.0, 4.0), steer_dead=u(0.03, 0.1), asymmetry=u(0.06, 0.2),
        play=u(0.001, 0.004), stop=u(0.46, 0.55), tolerance=u(0.006, 0.012), bow=u(-0.04, 0.04), gain=u(-0.04, 0.04),
    )  # fmt: skip
    return made, parts


def commands_of(seed: int) -> str:
    """Which commands the individual's recorder has: of the body and of its wheels, of its wheels alone, of the body alone."""
    return str(np.random.default_rng(181_000 + seed).choice(["both", "wheels", "body"], p=[0.5, 0.3, 0.2]))


def machine_of(individual: tuple[Build, Array]) -> Machine:
    """The machine file as it is read: type plate and a tape measure."""
    made = individual[0]
    rng = np.random.default_rng(round(made.mass))
    base, track, wheel = (x * rng.uniform(0.98, 1.02) for x in (made.base, made.track, 2 * made.radius))
    text = (
        f'[machine]\nname = "{NAME}"\nwheels = ["FR", "FL", "RR", "RL"]\n\n[geometry]\nwheelbase = {base:.2f}\n'
        f"joint_spacing = {track:.2f}\nwheel_offset = {made.lateral:.2f}\nwheel_diameter = {wheel:.2f}\n"
        f'max_speed = {made.top * rng.uniform(0.95, 1.1):.1f}\nmax_steer = 0.48\n\n[control]\nlaw = "none"\n'
    )
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "machine.toml"
        path.write_text(text)
        return load_machine(path)


def commands(seed: int, duration: float) -> tuple[Array, ...]:
    """What a driver asks for, per millisecond: speed [m/s], angles of both axles [rad], shape (n, 2), and how full the tank is (0 … 1)."""
    made, rng, n = build(seed)[0], np.random.default_rng(182_000 + seed), round(duration / STEP_S)
    speed, bend, rear, use, fill = np.zeros(n), np.zeros(n), -np.ones(n), np.zeros(n), np.zeros(n)
    alone, at, sign = commands_of(seed) == "wheels", round(rng.uniform(0.5, 5.0) / STEP_S), 1.0
    start = rng.uniform(0.1, 1.0)
    while at < n:
        kind = str(rng.choice(["row", "headland", "creep", "shunt", "stand"], p=[0.35, 0.2, 0.17, 0.13, 0.15]))
        if kind == "stand":
            long = rng.uniform(3.0, 10.0)
            end = min(at + round(long / STEP_S), n)
            fill[at:end] = rng.uniform(0.03, 0.08) if rng.random() < 0.4 and long > 5.0 else 0.0
            at = end
            continue
        legs, low, high, short, long, curve = {
            "row": (1, 0.4, 0.95, 7.0, 16.0, 0.12), "headland": (1, 0.25, 0.5, 5.0, 11.0, 1.0),
            "creep": (1, 0.1, 0.3, 5.0, 10.0, 0.5), "shunt": (2, 0.2, 0.5, 3.0, 6.0, 0.7),
        }[kind]  # fmt: skip
        if alone:
            rear[at:] = float(rng.choice([-1.0, -0.5, 0.0]))
        for _ in range(legs):
            end = min(at + round(rng.uniform(short, long) / STEP_S), n)
            foot = np.cumsum(rng.normal(0.0, 0.02, (end - at) // 400 + 1)).repeat(400)[
                : end - at
            ]  # a foot that wanders
            speed[at:end] = sign * rng.uniform(low, high) * made.top * np.clip(1.0 + foot, 0.75, 1.2)
            bend[at:end] = curve * rng.uniform(0.4, 1.0) * rng.choice([-1.0, 1.0])
            if kind != "headland" and rng.random() < 0.6:
                bend[(at + end) // 2 : end] = curve * rng.uniform(-1.0, 1.0)
            use[at:end] = rng.uniform(0.003, 0.008) if kind == "row" else 0.0
            at, sign = end, -sign if kind == "shunt" else sign
        if rng.random() < 0.4:
            at += round(rng.uniform(0.5, 3.5) / STEP_S)
    front = 0.38 * _smooth(bend, rng.uniform(0.8, 1.6))
    angle = np.column_stack([front, _smooth(rear, 2.0, -1.0) * front])
    turns = np.abs(np.tan(angle[:, 0]) - np.tan(angle[:, 1])) / made.base
    limit = made.top * (1 - 0.45 * np.abs(front) / 0.38) / (1 + turns * made.track / 2)
    speed = _smooth(np.clip(speed, -limit, limit), rng.uniform(0.6, 1.4))
    speed[np.abs(speed) < 0.01 * made.top] = 0.0
    return speed, angle, np.clip(start + np.cumsum(fill - use) * STEP_S, 0.0, 1.0)


def _smooth(x: Array, seconds: float, start: float = 0.0) -> Array:
    """As a foot on a pedal does it."""
    weights = np.hanning(round(seconds / STEP_S))
    return np.asarray(start + np.convolve(x - start, weights / weights.sum())[: x.size])


def asked(seed: int, duration: float) -> tuple[Array, dict[str, Array]]:
    """Time [s] and what is asked of every wheel [m/s] and axle [rad] where nothing fails."""
    ref = driven(seed, (), duration)[0][::10]
    return np.arange(len(ref)) * 10 * STEP_S, dict(zip((*WHEELS, *AXLES), ref.T, strict=True))


@lru_cache(maxsize=8)
def driven(seed: int, faults: tuple[FaultSpec, ...], duration: float) -> tuple[Array, ...]:
    """The mission per millisecond; see `drive`."""
    (made, parts), rng = build(seed), np.random.default_rng(184_000 + seed)
    loss, sat = courses(faults, duration, seed, made.top)
    speed, angle, full = commands(seed, duration)
    noise = rng.standard_normal((speed.size, 2)) * 6e-4 + rng.uniform(-0.004, 0.004, 2)
    return drive(speed, angle, full, loss, sat, noise, rng.uniform(0.0, 2 * np.pi, 5), parts, made)


def _rows(rng: np.random.Generator, n: int, rate: float, loses: float, batch: float) -> tuple[np.ndarray, np.ndarray]:
    """Milliseconds at which a message is made, and stamps [ns] of its arrival: delay, jitter, losses; in batches of some ms, or singly."""
    every = 1000.0 / rate * rng.uniform(0.9995, 1.0005)
    at = np.unique(np.arange(rng.uniform(0.0, every), n - 1, every).astype(int))
    at = at[rng.random(at.size) > loses]
    come = at + rng.uniform(0.5, 6.0) + rng.gamma(1.4, min(0.08 * every, 2.0), at.size)
    if batch:
        come = np.ceil(come / batch) * batch + rng.uniform(0.0, 1.0)
    stamps = np.maximum.accumulate(np.round(come * 1e6).astype(np.int64))
    return at, _START_NS + stamps + np.cumsum(rng.integers(3_000, 12_000, at.size) * (np.diff(stamps, prepend=-1) == 0))


def signals(seed: int, faults: Sequence[FaultSpec], duration: float, tier: str) -> Signals:
    """A mission as a recorder has it; with ``spool`` spools as well, with ``direct`` second speeds and angles too."""
    made, has = build(seed)[0], commands_of(seed)
    rng, noise = np.random.default_rng(185_000 + seed), np.random.default_rng(186_000 + seed)
    ref, true, read, given, done, body, _ = driven(seed, tuple(faults), duration)
    n, loses, batch = len(ref), float(rng.choice([0.0, 0.005, 0.02])), float(rng.choice([0.0, 0.0, 10.0, 40.0]))
    nodes, slow = 2000.0 / made.node, float(rng.choice([20.0, 50.0]))
    rates = {
        "v": float(rng.choice([nodes, 50.0])),
        "spool": float(rng.choice([50.0, 200.0])),
        "steer": slow,
        "second": 100.0,
    }
    rates |= {"u": 50.0, "cmd": float(rng.choice([20.0, 50.0])), "imu": 100.0}
    columns: dict[str, tuple[str, Array]] = {}
    gains, zeros = rng.uniform(0.985, 1.015, 6), rng.uniform(-0.006, 0.006, 6)
    spools = np.round((gains * done + zeros + 0.002 * noise.standard_normal((n, 6))) * 1000) / 1000
    for i, w in enumerate(WHEELS):
        columns[f"wheel.{w}.v"], columns[f"wheel.{w}.u"] = ("v", read[:, i]), ("u", given[:, i])
        if has != "body":
            columns[f"wheel.{w}.v_ref"] = "u", ref[:, i]
        second = true[:, i] * (1 + noise.uniform(-0.004, 0.004)) + 0.003 * made.top * noise.standard_normal(n)
        if tier != "base":
            columns[f"wheel.{w}.u_applied"] = "spool", spools[:, i]
        if tier == "direct":
            columns[f"wheel.{w}.v_true"] = "second", second
    for a, axle in enumerate(AXLES, 4):
        columns[f"steer.{axle}.phi"], columns[f"steer.{axle}.phi_ref"] = ("steer", read[:, a]), ("steer", ref[:, a])
        columns[f"steer.{axle}.u"] = "steer", given[:, a]
        if tier != "base":
            columns[f"steer.{axle}.u_applied"] = "spool", spools[:, a]
        if tier == "direct":
            columns[f"steer.{axle}.phi_true"] = "second", true[:, a] + 1e-3 * noise.standard_normal(n)
    if has != "wheels":
        columns["cmd.v"], columns["cmd.omega"] = ("cmd", body[:, 3]), ("cmd", body[:, 3] * body[:, 4])
    if rng.random() < 0.6:
        columns["imu.yaw_rate"] = "imu", body[:, 2] + noise.uniform(-0.008, 0.008) + 0.006 * noise.standard_normal(n)
    items = {}
    for name, (group, values) in columns.items():
        at, stamps = _rows(rng, n, rates[group], loses, batch)
        if (spread := spread_ticks(stamps, values[at])) is not None:  # as a reader does
            stamps = spread[0]
        origin = SignalSource(topic=f"/{group}/{name.split('.')[1]}", field=name)
        items[name] = Signal(name, stamps, np.ascontiguousarray(values[at]), origin, NAME, guessed=False)
    return Signals(items, {}, (), (), open_loop=False)
