"""A telehandler whose wheel motors have two sizes, steered by its front, by all wheels or as a crab: a machine of physics of its own.

A load-sensing pump that hears the highest load late, compensated valves whose overlap the controller jumps, dither, hysteresis that
cold oil widens; motors that shrink at speed, or those of the rear axle alone; steering and a boom take flow first, and the boom's load
moves most of the weight ahead while it drives; the engine labours, and dies in some missions; gravel lies in patches. Commands are
currents in thousandths, positions come from LVDTs behind filters, speeds from 40 to 80 poles a turn whose sense is late when a wheel
turns round; frames come on a bus on which those that matter least wait or are lost. Each seed is another individual on another drive.
For measuring only.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np
from hydrostatic import AXLES, WHEELS, courses
from telehandler_control import drive
from telehandler_physics import Array, Build, lagged

from replay.faults import FaultSpec
from replay.log.source_options import SignalSource
from replay.machine.config import Machine
from replay.machine.toml_file import load_machine
from replay.signals.signal import Signal, Signals

NAME = "telehandler"
STEP_S = 0.001
_START_NS = 1_806_000_000_000_000_000
_BEND = 0.36  # largest angle that a driver asks for [rad]


@lru_cache(maxsize=4)
def build(seed: int) -> tuple[Build, Array]:
    """The machine of a seed, and what differs between its wheels, shape (4, 11)."""
    rng = np.random.default_rng(190_000 + seed)
    u = rng.uniform
    top, empty, radius, most = u(2.0, 5.0), u(4500.0, 12000.0), u(0.45, 0.65), u(250.0, 380.0) * 1e5
    motor = u(0.55, 0.75) * 9.81 * empty * 1.2 / 4 * radius / most
    small, front_shifts, dead = u(0.45, 0.65), bool(rng.random() < 0.6), u(0.1, 0.26)
    flow = u(1.15, 1.35) * motor * (small if front_shifts else 1.0) * top / radius
    sink = u(0.02, 0.05)
    scale, teeth = u(0.985, 1.015), float(rng.choice([40, 60, 80, 80]))
    parts = np.column_stack(
        [
            radius * (1 + u(-0.005, 0.005, 4)), dead * u(0.92, 1.08, 4), u(0.96, 1.04, 4), u(0.95, 1.03, 4), u(-0.005, 0.005, 4),
            u(0.7, 1.5, 4), u(0.75, 1.3, 4), u(0.05, 0.2, 4), u(-0.008, 0.008, 4), u(0.0, 0.004, 4), scale * (1 + u(-0.003, 0.003, 4)),
        ]
    )  # fmt: skip
    pump = u(0.95, 1.25) * 3.5 * flow
    made = Build(
        top=top, mass=empty, height=u(0.8, 1.2), cg=u(-0.14, -0.03), radius=radius, sink=sink,
        lateral=float(rng.choice([0.0, 0.08])), base=u(2.3, 3.3), track=u(1.6, 2.1), inertia=u(0.006, 0.012) * empty * radius**2,
        motor=motor, small=small, front_shifts=front_shifts, flow=flow, curve=u(1.0, 1.4), pump=pump, margin=u(14.0, 25.0) * 1e5,
        most=most, comp_lag=u(0.01, 0.04), flow_force=u(-0.08, 0.15), heard_lag=u(0.01, 0.04), leakage=u(0.015, 0.03) * flow / most,
        friction=u(0.01, 0.03) * motor * most, stiction=u(0.4, 1.0), power=u(0.6, 0.9) * pump * most, droop=u(0.05, 0.14),
        governor=u(0.4, 0.9), idle=u(0.45, 0.65), spares=float(rng.choice([0.5, 1.0])), boom_flow=u(0.2, 0.45) * pump, cold=u(10.0, 50.0),
        warming=u(60.0, 200.0), coil=u(0.01, 0.04), spool=u(40.0, 90.0), damping=u(0.6, 0.95), hysteresis=u(0.003, 0.012),
        dither_hz=u(70.0, 160.0), dither=u(0.004, 0.015), dead=dead, known=u(0.78, 0.98), forward=u(0.88, 1.02), proportional=u(0.06, 0.16),
        integral=u(0.3, 0.8), unwind=u(0.3, 0.8), slew=u(1.5, 4.0), ramp=u(0.25, 0.6) * top, teeth=teeth,
        flips=int(rng.integers(0, 3)), wait=max(u(0.3, 0.6), 2 * np.pi * radius / teeth / (0.06 * top)), grip=u(0.55, 0.85), stiffness=u(7.0, 13.0), relaxation=u(0.25, 0.5),
        roll=u(0.015, 0.03), gravel=float(rng.choice([0.2, 0.6, 1.0])), hill=float(rng.choice([0.02, 0.04, 0.07])),
        hill_length=u(6.0, 14.0), ackermann=u(0.5, 1.0), steer_rate=u(0.3, 0.5), steer_gain=u(2.0, 4.0), steer_dead=u(0.08, 0.22),
        asymmetry=u(0.05, 0.2), creep=u(0.0, 0.02), play=u(0.001, 0.004), stop=u(0.44, 0.54), tolerance=u(0.006, 0.014),
    )  # fmt: skip
    return made, parts


def commands_of(seed: int) -> str:
    """Which commands the individual's recorder has: of the body and of its wheels, of its wheels alone, of the body alone."""
    return str(np.random.default_rng(191_000 + seed).choice(["both", "wheels", "body"], p=[0.5, 0.3, 0.2]))


def machine_of(individual: tuple[Build, Array]) -> Machine:
    """The machine file as it is read: type plate and a tape measure."""
    made = individual[0]
    rng = np.random.default_rng(round(made.mass))
    base, track, wheel = (x * rng.uniform(0.98, 1.02) for x in (made.base, made.track, 2 * made.radius))
    text = (
        f'[machine]\nname = "{NAME}"\nwheels = ["FR", "FL", "RR", "RL"]\n\n[geometry]\nwheelbase = {base:.2f}\n'
        f"joint_spacing = {track:.2f}\nwheel_offset = {made.lateral:.2f}\nwheel_diameter = {wheel:.2f}\n"
        f'max_speed = {made.top * rng.uniform(0.95, 1.1):.1f}\nmax_steer = 0.46\n\n[control]\nlaw = "none"\n'
    )
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "machine.toml"
        path.write_text(text)
        return load_machine(path)


def commands(seed: int, duration: float) -> tuple[Array, ...]:
    """What a driver asks for, per millisecond: speed [m/s], angles of both axles [rad], shape (n, 2), gear, boom (n, 3), throttle; see `drive`."""
    made, rng, n = build(seed)[0], np.random.default_rng(192_000 + seed), round(duration / STEP_S)
    speed, bend, rear, by_hand = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n)
    load, reach, lifts = np.zeros(n), np.full(n, 0.8), np.zeros(n)
    hand, at, sign = rng.random() < 0.5, round(rng.uniform(0.5, 5.0) / STEP_S), 1.0
    rear[:] = float(rng.choice([0.0, 0.0, -1.0]))
    low = made.small * made.top if made.front_shifts else 0.65 * made.top
    load[:] = rng.choice([0.0, 0.15, 0.3])
    while at < n:
        kind = str(rng.choice(["road", "yard", "place", "shunt", "stand"], p=[0.25, 0.25, 0.2, 0.15, 0.15]))
        legs, least, largest, short, long, curve = {
            "road": (1, 0.5, 0.95, 7.0, 15.0, 0.25), "yard": (1, 0.25, 0.6, 5.0, 10.0, 1.0), "place": (2, 0.07, 0.2, 4.0, 8.0, 0.6),
            "shunt": (3, 0.2, 0.5, 2.5, 5.0, 0.8), "stand": (0, 0.0, 0.0, 0.0, 0.0, 0.0),
        }[kind]  # fmt: skip
        if kind == "stand":  # takes a load or sets one down, and changes the way it steers
            end = min(at + round(rng.uniform(3.0, 9.0) / STEP_S), n)
            load[end - min(2000, end - at) :] = rng.choice([0.0, 0.1, 0.2, 0.3])
            lifts[at : min(at + 2500, n)] = rng.uniform(0.3, 1.0)
            rear[end:] = float(rng.choice([0.0, 0.0, -1.0, 1.0]))
            at = end
        for _ in range(legs):
            end = min(at + round(rng.uniform(short, long) / STEP_S), n)
            speed[at:end] = sign * rng.uniform(least, largest) * made.top
            by_hand[at:] = float(kind == "road")
            bend[at:end] = curve * rng.uniform(-1.0, 1.0) * float(rng.random() < 0.8)
            if rng.random() < 0.5:
                bend[(at + end) // 2 : end] = curve * rng.uniform(-1.0, 1.0)
            if rng.random() < (0.25 if kind == "road" else 0.6):  # the boom moves while it drives
                goes = round(rng.uniform(at, end))
                reach[goes:] = rng.uniform(0.5, 1.2)
                lifts[goes : goes + round(rng.uniform(1.5, 4.0) / STEP_S)] = rng.uniform(0.2, 0.8)
            at, sign = end, -sign if kind in ("shunt", "place") else sign
        if rng.random() < 0.45:
            at += round(rng.uniform(0.5, 3.5) / STEP_S)
    front = _BEND * _smooth(bend, rng.uniform(0.6, 1.4))
    angle = np.column_stack([front, _smooth(rear, 2.0, float(rear[0])) * front])
    turns = np.abs(np.tan(angle[:, 0]) - np.tan(angle[:, 1])) / made.base
    limit = made.top * (1 - 0.45 * np.abs(front) / _BEND) / (1 + turns * made.track / 2)
    most = np.where((by_hand > 0) | (not hand), limit, np.minimum(limit, 0.85 * low))
    dies = rng.uniform(0.2, 0.8) * duration if rng.random() < 0.15 else np.inf
    off, back = round(min(dies, duration) / STEP_S), round(min(dies + rng.uniform(2.0, 4.0), duration) / STEP_S)
    speed[off + round(rng.uniform(0.5, 1.8) / STEP_S) : back + 1500] = 0.0
    speed = _smooth(np.clip(speed, -most, most), rng.uniform(0.3, 1.2))
    speed[np.abs(speed) < 0.01 * made.top] = 0.0
    gear = by_hand if hand else _shifts(np.abs(speed) / low, rng.uniform(0.7, 0.85), rng.uniform(0.4, 0.6))
    flow = np.abs(speed) * made.motor / made.radius * np.where(gear > 0, made.small, 1.0) * 4 / made.pump
    throttle = _smooth(np.clip(np.maximum(1.35 * flow, 0.85 * (lifts > 0)), made.idle, 1.0), 0.8, made.idle)
    throttle[off:back] = 0.0
    boom = np.column_stack([_smooth(load, 1.5, float(load[0])), _smooth(reach, 4.0, 0.8), _smooth(lifts, 0.5)])
    return speed, angle, gear, boom, throttle


def _shifts(speed: Array, up: float, down: float) -> Array:
    """Gear of a box that shifts by itself: up above a speed, down below a lower one, not twice within a second."""
    out, gear, since = np.zeros(speed.size), 0.0, 0
    for k, v in enumerate(speed.tolist()):
        if k - since > 1000 and (v > up if gear == 0.0 else v < down):
            gear, since = 1.0 - gear, k
        out[k] = gear
    return out


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
    (made, parts), rng = build(seed), np.random.default_rng(194_000 + seed)
    loss, sat = courses(faults, duration, seed, made.top)
    speed, angle, gear, boom, throttle = commands(seed, duration)
    noise = rng.standard_normal((speed.size, 2)) * 6e-4 + rng.uniform(-0.005, 0.005, 2)
    return drive(speed, angle, gear, boom, throttle, loss, sat, noise, rng.uniform(0.0, 2 * np.pi, 6), parts, made)


def _frames(rng: np.random.Generator, n: int, rate: float, rank: float, busy: Array) -> tuple[np.ndarray, np.ndarray]:
    """Milliseconds at which frames are made, and stamps [ns] of their arrival; where the bus is busy, those of a high rank wait or are lost."""
    every = 1000.0 / rate * rng.uniform(0.9995, 1.0005)
    at = np.unique(np.arange(rng.uniform(0.0, every), n - 1, every).astype(int))
    at = at[rng.random(at.size) > 0.3 * rank * busy[at]]
    load = busy[at] * rank
    come = at + rng.uniform(0.3, 3.0) + rng.gamma(1.2, 0.4, at.size) + load * rng.gamma(1.5, 0.15 * every, at.size)
    stamps = np.maximum.accumulate(np.round(come * 1e6).astype(np.int64))
    return at, _START_NS + stamps + np.cumsum(
        rng.integers(100_000, 250_000, at.size) * (np.diff(stamps, prepend=-1) == 0)
    )


def signals(seed: int, faults: Sequence[FaultSpec], duration: float, tier: str) -> Signals:
    """A mission as a recorder has it; with ``spool`` spools as well, with ``direct`` second speeds and angles too."""
    made, has = build(seed)[0], commands_of(seed)
    rng, noise = np.random.default_rng(195_000 + seed), np.random.default_rng(196_000 + seed)
    ref, true, read, given, done, body, _ = driven(seed, tuple(faults), duration)
    n, time = len(ref), np.arange(len(ref)) * STEP_S
    busy = (rng.random(round(duration) + 2) < rng.choice([0.05, 0.2])).astype(float).repeat(1000)[:n]
    slow = float(rng.choice([20.0, 50.0]))
    ranks = {
        "drive": (50.0, 0.2),
        "valve": (50.0, 0.5),
        "steer": (50.0, 0.3),
        "spool": (50.0, 0.8),
        "second": (50.0, 0.6),
    }
    ranks |= {"cmd": (slow, 0.9), "imu": (50.0, 1.0), "gnss": (5.0, 0.0)}
    gains, zeros, measured = rng.uniform(0.98, 1.02, 6), rng.uniform(-0.008, 0.008, 6), rng.random() < 0.5
    lvdt = lagged(gains * done + zeros + 0.001 * noise.standard_normal((n, 6)), rng.uniform(0.008, 0.03, 6))
    spools = np.round(np.clip(lvdt, -1.25, 1.25) / 1.25 * 2047) / 2047 * 1.25
    shaken = made.dither * np.sin(2 * np.pi * made.dither_hz * time[:, None] + rng.uniform(0.0, 6.0, 6)) * measured
    currents = np.round((given + shaken * (given != 0)) * 1000) / 1000
    columns: dict[str, tuple[str, Array]] = {}
    for i, w in enumerate(WHEELS):
        columns[f"wheel.{w}.v"], columns[f"wheel.{w}.u"] = ("drive", read[:, i]), ("valve", currents[:, i])
        if has != "body":
            columns[f"wheel.{w}.v_ref"] = "valve", ref[:, i]
        if tier != "base":
            columns[f"wheel.{w}.u_applied"] = "spool", spools[:, i]
        if tier == "direct":
            second = true[:, i] * (1 + noise.uniform(-0.005, 0.005)) + 0.003 * made.top * noise.standard_normal(n)
            columns[f"wheel.{w}.v_true"] = "second", second
    for a, axle in enumerate(AXLES, 4):
        columns[f"steer.{axle}.phi"], columns[f"steer.{axle}.phi_ref"] = ("steer", read[:, a]), ("steer", ref[:, a])
        columns[f"steer.{axle}.u"] = "steer", currents[:, a]
        if tier != "base":
            columns[f"steer.{axle}.u_applied"] = "spool", spools[:, a]
        if tier == "direct":
            columns[f"steer.{axle}.phi_true"] = "second", true[:, a] + 1e-3 * noise.standard_normal(n)
    if has != "wheels":
        columns["cmd.v"], columns["cmd.omega"] = ("cmd", body[:, 3]), ("cmd", body[:, 3] * body[:, 4])
        columns["cmd.lateral"] = "cmd", body[:, 3] * (np.tan(ref[:, 4]) + np.tan(ref[:, 5])) / 2
    if rng.random() < 0.6:
        columns["imu.yaw_rate"] = "imu", body[:, 2] + noise.uniform(-0.006, 0.006) + 0.006 * noise.standard_normal(n)
    if rng.random() < 0.4:
        columns["gnss.speed"] = "gnss", np.abs(np.hypot(body[:, 0], body[:, 1]) + 0.03 * noise.standard_normal(n))
    rows = {group: _frames(rng, n, *of, busy) for group, of in ranks.items()}
    items = {}
    for name, (group, values) in columns.items():
        at, stamps = rows[group]
        origin = SignalSource(topic=f"/{group}", field=name)
        items[name] = Signal(name, stamps, np.ascontiguousarray(values[at]), origin, NAME, guessed=False)
    return Signals(items, {}, (), (), open_loop=False)
