"""A log loader with two frames that fold, whose motors are fed by banks of on/off valves, in short loading: a machine of physics of its own.

A bank opens in sixteenths, the last of which is modulated, and switches 15 to 40 ms late; a load-sensing pump has limits of pressure and
power and its engine labours; wheels spin or stand in front of a pile while they are told to drive; motors change their size; toothed wheels tell
no direction below 0.15 m/s, where it is taken from the command; tyres differ by up to 4 %; what is recorded has two clocks. Both frames are
coupled in what they are told: the front turns one way, the rear the other. Each seed is another individual on another job. For measuring only.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np
from hydrostatic import AXLES, WHEELS, courses
from loader_control import drive
from loader_physics import Array, Build

from replay.faults import FaultSpec
from replay.log.source_options import SignalSource
from replay.machine.config import Machine
from replay.machine.toml_file import load_machine
from replay.signals.signal import Signal, Signals

NAME = "loader"
STEP_S = 0.001
_START_NS = 1_812_000_000_000_000_000
_BEND = 0.34  # largest angle that a driver asks of a frame [rad]


@lru_cache(maxsize=4)
def build(seed: int) -> tuple[Build, Array]:
    """The machine of a seed, and what differs between its wheels, shape (4, 8)."""
    rng = np.random.default_rng(240_000 + seed)
    u = rng.uniform
    top, empty, radius, most = u(1.8, 4.5), u(5000.0, 18000.0), u(0.45, 0.75), u(280.0, 400.0) * 1e5
    motor = u(0.55, 0.8) * 9.81 * empty * 1.2 / 4 * radius / most
    small, scale, teeth = u(0.45, 0.65), u(0.985, 1.015), float(rng.choice([48, 60, 90, 120]))
    flow = u(1.15, 1.35) * motor * small * top / radius
    tyres = 1 + u(0.002, 0.02) * u(-1.0, 1.0, 4)
    parts = np.column_stack(
        [
            radius * tyres, u(0.96, 1.04, 4), u(0.95, 1.04, 4), u(0.7, 1.5, 4), u(0.75, 1.3, 4), u(0.1, 0.25, 4), u(0.0, 0.004, 4),
            scale * (1 + u(-0.003, 0.003, 4)),
        ]
    )  # fmt: skip
    pump = u(0.95, 1.25) * 3.5 * flow
    made = Build(
        top=top, cycle=int(rng.choice([20, 40])), mass=empty, height=u(0.8, 1.3), cg=u(-0.12, -0.02), radius=radius, sink=u(0.015, 0.045),
        half=u(0.75, 1.1), base=u(2.4, 3.4), inset=u(0.0, 0.35), inertia=u(0.006, 0.014) * empty * radius**2, motor=motor, small=small,
        flow=flow, compensated=bool(rng.random() < 0.6), pump=pump, margin=u(15.0, 28.0) * 1e5, most=most, heard_lag=u(0.01, 0.04),
        bleeds=u(0.8, 2.0),
        leakage=u(0.012, 0.03) * flow / most,
        damper=u(0.25, 0.6), friction=u(0.01, 0.03) * motor * most, stiction=u(0.3, 1.0), power=u(0.45, 0.8) * pump * most,
        droop=u(0.05, 0.14), governor=u(0.4, 0.9), idle=u(0.5, 0.7), limits=bool(rng.random() < 0.7), lift_flow=u(0.15, 0.35) * pump,
        cold=u(8.0, 55.0), warming=u(80.0, 240.0), delay=u(0.015, 0.022), off=u(0.9, 1.3), period=u(0.08, 0.16), turns_delay=u(1.0, 1.6),
        forward=u(0.9, 1.04), proportional=u(0.08, 0.25), integral=u(0.15, 0.5), ramp=u(0.3, 0.7) * top, teeth=teeth,
        tick=float(rng.choice([1e-5, 1e-4, 1e-3])), wait=max(u(0.3, 0.6), 2 * np.pi * radius / teeth / (0.05 * top)), grip=u(0.5, 0.8),
        stiffness=u(7.0, 13.0), relaxation=u(0.25, 0.5), roll=u(0.015, 0.035), mud=float(rng.choice([0.0, 0.4, 1.0])),
        hill=float(rng.choice([0.01, 0.03, 0.05])), hill_length=u(6.0, 14.0), dig=u(0.45, 1.1), pile=u(0.4, 1.0), coupled=u(0.85, 1.0),
        steer_rate=u(0.25, 0.45), steer_gain=u(2.5, 5.0), asymmetry=u(0.0, 0.15), play=u(0.001, 0.004), stop=u(0.4, 0.48),
        tolerance=u(0.008, 0.016),
    )  # fmt: skip
    return made, parts


def weights_of(seed: int) -> Array:
    """Flow of the valves of four wheels' and two frames' banks [sixteenths], shape (6, 5)."""
    rng = np.random.default_rng(241_000 + seed)
    return np.array([8.0, 4.0, 2.0, 1.0, 1.0]) * (1 + rng.uniform(0.01, 0.04) * rng.uniform(-1.0, 1.0, (6, 5)))


def commands_of(seed: int) -> str:
    """Which commands the individual's recorder has: of the body and of its wheels, of its wheels alone, of the body alone."""
    return str(np.random.default_rng(242_000 + seed).choice(["both", "wheels", "body"], p=[0.5, 0.3, 0.2]))


def machine_of(individual: tuple[Build, Array]) -> Machine:
    """The machine file as it is read: type plate and a tape measure; frames that turn as a whole have their wheels' joint in the middle."""
    made = individual[0]
    rng = np.random.default_rng(round(made.mass))
    base, half, wheel = (x * rng.uniform(0.98, 1.02) for x in (made.base, made.half, 2 * made.radius))
    places = "".join(
        f"{w} = {{ x = {base / 2 * (1 if w[0] == 'F' else -1):.3f}, y = 0.0, offset = {half * (1 if w[1] == 'L' else -1):.3f}, "
        f'steer = "{"front" if w[0] == "F" else "rear"}" }}\n'
        for w in WHEELS
    )
    text = (
        f'[machine]\nname = "{NAME}"\nwheels = ["FR", "FL", "RR", "RL"]\n\n[geometry]\n{places}wheel_diameter = {wheel:.2f}\n'
        f'max_speed = {made.top * rng.uniform(0.95, 1.1):.1f}\nmax_steer = 0.45\n\n[control]\nlaw = "none"\n'
    )
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "machine.toml"
        path.write_text(text)
        return load_machine(path)


#: Legs of a cycle: direction, speed [of the top], seconds, bend, load at its end, flow of the lift, throttle, to a pile, carried fast.
_LEGS = (
    (1, (0.25, 0.5), (2.5, 4.5), 0.3, None, 0.0, 0.8, 0, 0),
    (1, (0.12, 0.3), (3.0, 5.5), 0.0, "fills", 0.6, 1.0, 1, 0),
    (-1, (0.25, 0.5), (3.0, 6.0), 1.0, None, 0.2, 0.9, 0, 0),
    (1, (0.2, 0.5), (3.0, 6.0), 0.8, None, 0.4, 0.9, 0, 0),
    (1, (0.06, 0.15), (1.5, 3.0), 0.2, None, 0.2, 0.85, 0, 0),
    (0, (0.0, 0.0), (1.5, 4.0), 0.0, "empties", 0.3, 0.8, 0, 0),
    (-1, (0.25, 0.5), (3.0, 6.0), 0.9, None, 0.0, 0.8, 0, 0),
)


def commands(seed: int, duration: float) -> tuple[Array, ...]:
    """What a driver asks for, per millisecond: speed [m/s], angles of both frames [rad], shape (n, 2), gear, work, throttle; see `drive`."""
    made, rng, n = build(seed)[0], np.random.default_rng(243_000 + seed), round(duration / STEP_S)
    speed, bend, gear, throttle = np.zeros(n), np.zeros(n), np.zeros(n), np.full(n, made.idle)
    load, lift, pile = np.zeros(n), np.zeros(n), np.zeros(n)
    at, leg, side = round(rng.uniform(0.5, 5.0) / STEP_S), int(rng.integers(0, 7)), float(rng.choice([-1.0, 1.0]))
    while at < n:
        sign, sizes, seconds, curve, bucket, lifts, pedal, digs, fast = _LEGS[leg % 7]
        most = 0.85 * made.small
        if leg % 7 in (2, 6) and rng.random() < 0.4:  # it goes farther, with the smaller motors, or it rests
            if rng.random() < 0.65:
                sign, sizes, seconds, curve, fast, most = 1, (0.5, 0.9), (7.0, 14.0), 0.3, 1, 0.95
            else:
                sign, seconds, pedal = 0, (3.0, 9.0), made.idle
        end = min(at + round(rng.uniform(*seconds) / STEP_S), n)
        speed[at:end] = sign * min(rng.uniform(*sizes), most) * made.top
        bend[at:end] = curve * side * rng.uniform(0.4, 1.0) * float(rng.random() < 0.85)
        throttle[at:end], gear[at:end], lift[at:end] = (
            max(pedal * rng.uniform(0.9, 1.0), made.idle),
            fast,
            lifts * rng.uniform(0.5, 1.0),
        )
        if digs:
            pile[at:end], lift[at : (at + end) // 2] = rng.uniform(0.2, 1.2), 0.0
            load[(at + end) // 2 :] = rng.uniform(0.05, 0.3)
        if bucket == "empties":
            load[(at + end) // 2 :] = 0.0
        side = -side if leg % 7 in (2, 3, 6) else side
        at = end + (round(rng.uniform(0.2, 0.8) / STEP_S) if rng.random() < 0.5 else 0)
        leg += 1
    front = _BEND * _smooth(bend, rng.uniform(0.8, 1.6))
    angle = np.column_stack([front, -made.coupled * front])
    turns = np.abs(np.tan(angle[:, 0]) - np.tan(angle[:, 1])) / made.base
    limit = np.where(gear > 0, 0.95, 0.85 * made.small) * made.top / (1 + turns * made.half)
    speed = _smooth(np.clip(speed, -limit, limit), rng.uniform(0.3, 0.9))
    speed[np.abs(speed) < 0.01 * made.top] = 0.0
    work = np.column_stack([_smooth(load, 1.2), _smooth(lift, 0.5), pile])
    return speed, angle, gear, work, _smooth(throttle, 0.6, made.idle)


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
    (made, parts), rng = build(seed), np.random.default_rng(244_000 + seed)
    loss, sat = courses(faults, duration, seed, made.top)
    speed, angle, gear, work, throttle = commands(seed, duration)
    noise = rng.standard_normal((speed.size, 2)) * 6e-4 + rng.uniform(-0.005, 0.005, 2)
    field = rng.uniform(0.0, 2 * np.pi, 6)
    return drive(speed, angle, gear, work, throttle, loss, sat, noise, field, weights_of(seed), parts, made)


def _rows(rng: np.random.Generator, n: int, rate: float, clock: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
    """Milliseconds at which a group is read, and stamps [ns] by the clock that it has: its offset [ns] and rate [of true]."""
    at = np.unique(np.arange(rng.uniform(0.0, 1000.0 / rate), n - 1, 1000.0 / rate).astype(int))
    at = at[rng.random(at.size) > 0.001]
    return at, _START_NS + np.round(at * 1e6 * clock[1] + clock[0] + rng.uniform(0.0, 4e5, at.size)).astype(np.int64)


def signals(seed: int, faults: Sequence[FaultSpec], duration: float, tier: str) -> Signals:
    """A mission as a recorder has it; with ``spool`` openings of the banks as well, with ``direct`` second speeds and angles too."""
    made, has = build(seed)[0], commands_of(seed)
    rng, noise = np.random.default_rng(245_000 + seed), np.random.default_rng(246_000 + seed)
    ref, true, read, given, done, body, _ = driven(seed, tuple(faults), duration)
    n, rate, averaged = len(ref), float(rng.choice([100.0, 250.0])), rng.random() < 0.5
    main, other = (0.0, 1.0 + rng.uniform(-3e-5, 3e-5)), (rng.uniform(-2e7, 2e7), 1.0 + rng.uniform(-5e-5, 5e-5))
    groups = {
        "drive": (rate, main),
        "valve": (rate, main),
        "steer": (100.0, other),
        "second": (100.0, other),
        "cmd": (50.0, main),
    }
    groups |= {"imu": (100.0, other), "gnss": (5.0, other)}
    opened = _mean(done, round(made.period / STEP_S)) if averaged else done
    columns: dict[str, tuple[str, Array]] = {}
    for i, w in enumerate(WHEELS):
        columns[f"wheel.{w}.v"], columns[f"wheel.{w}.u"] = ("drive", read[:, i]), ("valve", given[:, i])
        if has != "body":
            columns[f"wheel.{w}.v_ref"] = "valve", np.round(ref[:, i], 3)
        if tier != "base":
            columns[f"wheel.{w}.u_applied"] = "valve", np.round(opened[:, i], 3)
        if tier == "direct":
            second = true[:, i] * (1 + noise.uniform(-0.006, 0.006)) + 0.003 * made.top * noise.standard_normal(n)
            columns[f"wheel.{w}.v_true"] = "second", second
    for a, axle in enumerate(AXLES, 4):
        columns[f"steer.{axle}.phi"], columns[f"steer.{axle}.phi_ref"] = ("steer", read[:, a]), ("steer", ref[:, a])
        columns[f"steer.{axle}.u"] = "steer", given[:, a]
        if tier != "base":
            columns[f"steer.{axle}.u_applied"] = "steer", np.round(opened[:, a], 3)
        if tier == "direct":
            columns[f"steer.{axle}.phi_true"] = (
                "second",
                true[:, a] + noise.uniform(-0.004, 0.004) + 1e-3 * noise.standard_normal(n),
            )
    if has != "wheels":
        columns["cmd.v"], columns["cmd.omega"] = ("cmd", body[:, 3]), ("cmd", body[:, 3] * body[:, 4])
        columns["cmd.lateral"] = "cmd", body[:, 3] * (np.tan(ref[:, 4]) + np.tan(ref[:, 5])) / 2
    if rng.random() < 0.6:
        columns["imu.yaw_rate"] = "imu", body[:, 2] + noise.uniform(-0.006, 0.006) + 0.006 * noise.standard_normal(n)
    if rng.random() < 0.4:
        columns["gnss.speed"] = "gnss", np.abs(np.hypot(body[:, 0], body[:, 1]) + 0.03 * noise.standard_normal(n))
    rows = {group: _rows(rng, n, *of) for group, of in groups.items()}
    items = {}
    for name, (group, values) in columns.items():
        at, stamps = rows[group]
        origin = SignalSource(topic=f"/{group}", field=name)
        items[name] = Signal(name, stamps, np.ascontiguousarray(values[at]), origin, NAME, guessed=False)
    return Signals(items, {}, (), (), open_loop=False)


def _mean(x: Array, count: int) -> Array:
    """Mean of so many values up to each, as a driver of valves reports its own period."""
    total = np.cumsum(np.vstack([np.zeros((count, x.shape[1])), x]), axis=0)
    return np.asarray((total[count:] - total[:-count]) / count)
