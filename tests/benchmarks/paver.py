"""A paver on four steered wheels that creeps for long at one command while its oil warms: a machine of physics of its own.

Its law has no feedback, or little, and trims by wheel; from 20 to 70 °C a valve's gain changes by some 15 %, of which the law knows a
part; counterbalance valves lock wheels that nothing feeds and brake those that are pushed; commands are slewed over their overlap; a
screed drags and turns it, trucks fill its hopper, grades last; steering valves are proportional, or on and off. Speeds are in tenths of
m/min, renewed every 1 to 100 ms, and recorded at 200 Hz beside topics of 20 Hz; second speeds come from radars that look at
treads, of a scale of their own, some 10 ms early or late, with dropouts, and those of angles have gains. Each seed is another individual
on another drive. For measuring only.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np
from hydrostatic import AXLES, WHEELS, courses
from paver_control import drive
from paver_physics import Array, Build

from replay.faults import FaultSpec
from replay.log.source_options import SignalSource
from replay.machine.config import Machine
from replay.machine.toml_file import load_machine
from replay.signals.signal import Signal, Signals

NAME = "paver"
STEP_S = 0.001
_START_NS = 1_807_000_000_000_000_000
_BEND = 0.3  # largest angle that a driver asks for [rad]


@lru_cache(maxsize=4)
def build(seed: int) -> tuple[Build, Array]:
    """The machine of a seed, and what differs between its wheels, shape (4, 11)."""
    rng = np.random.default_rng(200_000 + seed)
    u = rng.uniform
    top, empty, radius, pressure = u(0.7, 1.5), u(8000.0, 20000.0), u(0.45, 0.7), u(180.0, 280.0) * 1e5
    motor = u(0.6, 0.8) * 9.81 * empty * 1.25 / 4 * radius / pressure
    flow, dead, cold = u(1.2, 1.5) * motor * top / radius, u(0.04, 0.16), u(15.0, 30.0)
    gain = u(0.92, 1.08, 4)
    parts = np.column_stack(
        [
            radius * (1 + u(-0.008, 0.008, 4)), dead * u(0.94, 1.06, 4), gain * u(0.985, 1.015, 4), gain * u(0.975, 1.015, 4),
            u(-0.004, 0.004, 4), u(0.7, 1.4, 4), u(0.75, 1.3, 4), u(0.8, 1.2, 4), np.round(1 / gain * u(0.98, 1.02, 4), 2),
            u(0.002, 0.012, 4), u(0.985, 1.015) * (1 + u(-0.004, 0.004, 4)),
        ]
    )  # fmt: skip
    made = Build(
        top=top, mass=empty, height=u(0.8, 1.1), cg=u(-0.08, 0.06), radius=radius, lateral=float(rng.choice([0.0, 0.1])), base=u(2.2, 3.4),
        track=u(1.7, 2.3), inertia=u(0.01, 0.03) * empty * radius**2, motor=motor, flow=flow, pressure=pressure, sag=u(0.03, 0.15),
        margin=u(8.0, 16.0) * 1e5, lock=u(0.9, 1.3) * pressure, pilot=u(0.2, 0.4) * pressure, opens=u(0.1, 0.25), shuts=u(0.12, 0.3),
        leakage=u(0.004, 0.012) * flow / pressure, thin=u(0.015, 0.03), friction=u(0.01, 0.03) * motor * pressure, stiction=u(0.3, 0.9),
        cold=cold, hot=u(60.0, 72.0), warming=u(20.0, 50.0), drift=float(rng.choice([-1.0, 1.0])) * u(0.1, 0.18), knows=u(0.0, 0.6),
        spool=u(35.0, 80.0), damping=u(0.6, 0.95), dead=dead, known=u(0.85, 1.02), forward=u(0.95, 1.05),
        closed=float(rng.choice([0.0, u(0.05, 0.25), u(0.15, 0.5)])), slew=u(0.3, 1.2), ramp=u(0.12, 0.4) * top, filter=u(0.02, 0.1),
        renewed=int(rng.choice([2, 40, 100, 200])), teeth=float(rng.integers(9, 24)), grip=u(0.55, 0.8), stiffness=u(8.0, 16.0),
        relaxation=u(0.15, 0.4), roll=u(0.015, 0.03), soft=float(rng.choice([0.1, 0.5, 1.0])), grade=u(-0.05, 0.05), camber=u(-0.02, 0.02),
        ackermann=u(0.5, 1.0), steer_rate=u(0.14, 0.3), steer_gain=u(2.5, 5.0), steer_dead=u(0.03, 0.12), asymmetry=u(0.03, 0.15),
        bang=bool(rng.random() < 0.35), play=u(0.001, 0.004), stop=u(0.36, 0.44), tolerance=u(0.006, 0.012),
    )  # fmt: skip
    return made, parts


def commands_of(seed: int) -> str:
    """Which commands the individual's recorder has: of the body and of its wheels, of its wheels alone, of the body alone."""
    return str(np.random.default_rng(201_000 + seed).choice(["both", "wheels", "body"], p=[0.5, 0.3, 0.2]))


def machine_of(individual: tuple[Build, Array]) -> Machine:
    """The machine file as it is read: type plate and a tape measure."""
    made = individual[0]
    rng = np.random.default_rng(round(made.mass))
    base, track, wheel = (x * rng.uniform(0.98, 1.02) for x in (made.base, made.track, 2 * made.radius))
    text = (
        f'[machine]\nname = "{NAME}"\nwheels = ["FR", "FL", "RR", "RL"]\n\n[geometry]\nwheelbase = {base:.2f}\n'
        f"joint_spacing = {track:.2f}\nwheel_offset = {made.lateral:.2f}\nwheel_diameter = {wheel:.2f}\n"
        f'max_speed = {made.top * rng.uniform(0.95, 1.1):.2f}\nmax_steer = 0.4\n\n[control]\nlaw = "none"\n'
    )
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "machine.toml"
        path.write_text(text)
        return load_machine(path)


def commands(seed: int, duration: float) -> tuple[Array, ...]:
    """What a driver asks for, per millisecond: speed [m/s], angles of both axles [rad], shape (n, 2), and what it works at, (n, 3); see `drive`."""
    made, rng, n = build(seed)[0], np.random.default_rng(202_000 + seed), round(duration / STEP_S)
    speed, bend, rear, drag, full = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n)
    at = round(rng.uniform(0.5, 5.0) / STEP_S)
    full[:] = rng.uniform(0.0, 0.3)
    while at < n:
        kind = str(rng.choice(["pave", "transit", "crab", "back", "stand"], p=[0.4, 0.2, 0.15, 0.13, 0.12]))
        least, largest, short, long, curve = {
            "pave": (0.12, 0.45, 14.0, 35.0, 0.3), "transit": (0.5, 0.95, 8.0, 15.0, 1.0), "crab": (0.2, 0.5, 8.0, 18.0, 0.9),
            "back": (-0.7, -0.3, 5.0, 9.0, 0.5), "stand": (0.0, 0.0, 3.0, 8.0, 0.0),
        }[kind]  # fmt: skip
        end = min(at + round(rng.uniform(short, long) / STEP_S), n)
        speed[at:end] = rng.uniform(least, largest) * made.top
        bend[at:end] = curve * rng.uniform(-1.0, 1.0)
        rear[max(at - 1500, 0) :] = 1.0 if kind == "crab" else float(rng.choice([-1.0, -1.0, 0.0]))
        if kind == "transit" and rng.random() < 0.6:
            bend[(at + end) // 2 : end] = curve * rng.uniform(-1.0, 1.0)
        if kind == "pave":
            head = np.repeat(rng.uniform(0.6, 1.2, (end - at) // 3000 + 1), 3000)[
                : end - at
            ]  # of asphalt before the screed
            drag[at:end] = rng.uniform(0.05, 0.18) * head
            if rng.random() < 0.5 and end - at > 10_000:  # a truck comes, fills the hopper and is pushed
                come = int(rng.integers(at + 2000, end - 6000))
                full[come:] = rng.uniform(0.1, 0.35)
                drag[come : come + 6000] += rng.uniform(0.02, 0.06)
        elif kind == "stand":
            full[at:] = rng.uniform(0.0, 0.3)
        at = end + (round(rng.uniform(0.5, 3.5) / STEP_S) if rng.random() < 0.6 else 0)
    front = _BEND * _smooth(bend, rng.uniform(1.5, 3.0))
    angle = np.column_stack([front, _smooth(rear, 2.5, float(rear[0])) * front])
    turns = np.abs(np.tan(angle[:, 0]) - np.tan(angle[:, 1])) / made.base
    limit = 0.95 * made.top / (1 + turns * (made.track + made.lateral) / 2)
    speed = _smooth(np.clip(speed, -limit, limit), rng.uniform(0.4, 1.5))
    speed[np.abs(speed) < 0.01 * made.top] = 0.0
    place = _smooth(np.repeat(rng.uniform(-0.5, 0.5, round(duration / 15.0) + 2), 15_000)[:n], 6.0)
    return speed, angle, np.column_stack([_smooth(drag, 1.0), place, _smooth(full, 4.0, float(full[0]))])


def _smooth(x: Array, seconds: float, start: float = 0.0) -> Array:
    """As a hand on a dial does it."""
    weights = np.hanning(round(seconds / STEP_S))
    return np.asarray(start + np.convolve(x - start, weights / weights.sum())[: x.size])


def asked(seed: int, duration: float) -> tuple[Array, dict[str, Array]]:
    """Time [s] and what is asked of every wheel [m/s] and axle [rad] where nothing fails."""
    ref = driven(seed, (), duration)[0][::10]
    return np.arange(len(ref)) * 10 * STEP_S, dict(zip((*WHEELS, *AXLES), ref.T, strict=True))


@lru_cache(maxsize=8)
def driven(seed: int, faults: tuple[FaultSpec, ...], duration: float) -> tuple[Array, ...]:
    """The mission per millisecond; see `drive`."""
    (made, parts), rng = build(seed), np.random.default_rng(204_000 + seed)
    loss, sat = courses(faults, duration, seed, made.top)
    speed, angle, work = commands(seed, duration)
    noise = rng.standard_normal((speed.size, 6)) * np.array([0.001] * 4 + [7e-4] * 2)
    noise[:, 4:] += rng.uniform(-0.006, 0.006, 2)
    return drive(speed, angle, work, loss, sat, noise, rng.uniform(0.0, 2 * np.pi, 4), parts, made)


def _rows(rng: np.random.Generator, n: int, rate: float) -> tuple[np.ndarray, np.ndarray]:
    """Milliseconds at which messages are made, and stamps [ns] of their arrival, late by some ms and by a share of the period."""
    every = 1000.0 / rate * rng.uniform(0.9997, 1.0003)
    at = np.unique(np.arange(rng.uniform(0.0, every), n - 1, every).astype(int))
    come = at + rng.uniform(0.3, 5.0) + rng.gamma(1.3, min(0.03 * every, 1.5), at.size)
    return at, _START_NS + np.maximum.accumulate(np.round(come * 1e6).astype(np.int64)) + 1000 * np.arange(at.size)


def radar(rng: np.random.Generator, speed: Array, top: float) -> tuple[np.ndarray, np.ndarray, Array]:
    """Rows, stamps [ns] and speeds [m/s] of a tread, or of the ground, as a radar has it that corrects for a latency it does not quite know."""
    at, stamps = _rows(rng, speed.size, 20.0)
    seen = speed[np.maximum(at - 60, 0)] * rng.uniform(0.98, 1.02)
    seen = seen + rng.standard_normal(at.size) * (0.004 * top + 0.015 * np.abs(seen))
    seen = np.where(np.abs(seen) < 0.02, 0.0, np.round(seen, 3))
    keep = np.ones(at.size, dtype=bool)
    for start in rng.integers(0, at.size, rng.integers(0, 6)):
        keep[start : start + int(rng.integers(4, 60))] = False
    stamps = stamps - 60_000_000 + round(rng.normal(0.0, 25e6))
    return at[keep], stamps[keep], seen[keep]


def signals(seed: int, faults: Sequence[FaultSpec], duration: float, tier: str, ground: bool = False) -> Signals:
    """A mission as a recorder has it; with ``spool`` spools as well, with ``direct`` second speeds and angles too.

    `ground`: with radars that look at the ground beside the wheels, which is no second speed of a wheel that slips or is dragged.
    """
    made, has = build(seed)[0], commands_of(seed)
    rng, noise = np.random.default_rng(205_000 + seed), np.random.default_rng(206_000 + seed)
    ref, true, read, given, done, body, source, under = driven(seed, tuple(faults), duration)
    n, pick = len(ref), lambda *of: float(rng.choice(of))
    rates = {
        "speed": pick(200.0, 200.0, 50.0),
        "valve": pick(20.0, 50.0, 200.0),
        "spool": pick(20.0, 200.0),
        "steer": pick(20.0, 50.0),
    }
    rates |= {"cmd": pick(10.0, 20.0), "imu": 100.0}
    warm = (source[:, 1] - 40.0) / 50.0  # which the zero of a spool's sensor feels
    gains, zeros, creeps = rng.uniform(0.98, 1.02, 6), rng.uniform(-0.006, 0.006, 6), rng.uniform(-0.012, 0.012, 6)
    spools = (
        np.round((gains * done + zeros + np.outer(warm, creeps) + 0.002 * noise.standard_normal((n, 6))) * 1000) / 1000
    )
    columns: dict[str, tuple[str, Array]] = {}
    for i, w in enumerate(WHEELS):
        columns[f"wheel.{w}.v"], columns[f"wheel.{w}.u"] = ("speed", read[:, i]), ("valve", np.round(given[:, i], 3))
        if has != "body":
            columns[f"wheel.{w}.v_ref"] = "valve", ref[:, i]
        if tier != "base":
            columns[f"wheel.{w}.u_applied"] = "spool", spools[:, i]
    for a, axle in enumerate(AXLES, 4):
        columns[f"steer.{axle}.phi"], columns[f"steer.{axle}.phi_ref"] = ("steer", read[:, a]), ("steer", ref[:, a])
        columns[f"steer.{axle}.u"] = "steer", given[:, a]
        if tier != "base":
            columns[f"steer.{axle}.u_applied"] = "spool", spools[:, a]
        if tier == "direct":
            second = true[:, a] * noise.uniform(0.98, 1.02) + noise.uniform(-0.004, 0.004)
            columns[f"steer.{axle}.phi_true"] = "steer", second + 8e-4 * noise.standard_normal(n)
    if has != "wheels":
        columns["cmd.v"], columns["cmd.omega"] = ("cmd", body[:, 3]), ("cmd", body[:, 3] * body[:, 4])
        columns["cmd.lateral"] = "cmd", body[:, 3] * (np.tan(ref[:, 4]) + np.tan(ref[:, 5])) / 2
    if rng.random() < 0.6:
        columns["imu.yaw_rate"] = "imu", body[:, 2] + noise.uniform(-0.004, 0.004) + 0.004 * noise.standard_normal(n)
    rows = {group: _rows(rng, n, rate) for group, rate in rates.items()}
    series = {name: (group, *rows[group], values[rows[group][0]]) for name, (group, values) in columns.items()}
    if tier == "direct":
        for i, w in enumerate(WHEELS):
            series[f"wheel.{w}.v_true"] = f"radar_{w}", *radar(noise, (under if ground else true)[:, i], made.top)
    items = {}
    for name, (group, _, stamps, values) in series.items():
        origin = SignalSource(topic=f"/{group}", field=name)
        items[name] = Signal(name, stamps, np.ascontiguousarray(values), origin, NAME, guessed=False)
    return Signals(items, {}, (), (), open_loop=False)
