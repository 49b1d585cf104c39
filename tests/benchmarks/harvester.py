"""A grape harvester whose wheel valves have open centres and stand in series, front before rear: a machine of physics of its own.

A gear pump of each side gives what the engine turns it; a wheel's share of it goes by opening, load and the engine's speed at once, and front
and rear wheel of a side share one pressure, so that a stuck wheel takes its neighbour's. Nothing moves below an opening that its load sets; a map
over the engine's speed, a proportional part and a capped integral make up for it; counterbalance valves hold what pushes. Motors of some have
two ranges, axles can be locked, the hopper fills in the rows; clods, side slopes on which it levels itself, rear axles that trim little and
turn at headlands alone. Speeds are teeth of the last windows of 10 ms with a bit of direction that comes late. Frames of four wheels come every
20 ms on a logger that stamps whole milliseconds. Each seed is another individual in another vineyard. For measuring only.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np
from harvester_control import drive
from harvester_physics import Array, Build
from hydrostatic import AXLES, WHEELS, courses

from replay.faults import FaultSpec
from replay.log.source_options import SignalSource
from replay.machine.config import Machine
from replay.machine.toml_file import load_machine
from replay.signals.signal import Signal, Signals

NAME = "harvester"
STEP_S = 0.001
_START_NS = 1_835_000_000_000_000_000
_BEND = 0.6  # largest angle that a driver asks for [rad]


@lru_cache(maxsize=4)
def build(seed: int) -> tuple[Build, Array]:
    """The machine of a seed, and what differs between its wheels, shape (4, 8)."""
    rng = np.random.default_rng(280_000 + seed)
    u = rng.uniform
    top, mass, radius, two = u(1.4, 3.2), u(6500.0, 11000.0), u(0.5, 0.75), bool(rng.random() < 0.5)
    most, overlap = u(220.0, 280.0) * 1e5, u(0.08, 0.16)
    motor = u(0.22, 0.3) * 9.81 * mass / 4 * radius / (0.45 * most)
    full = u(0.75, 0.9) * top if two else u(1.2, 1.4) * top
    rest_drop = u(3.0, 6.0) * 1e5
    parts = np.column_stack(
        [
            radius * (1 + u(-0.006, 0.006, 4)), overlap * (1 + u(-0.06, 0.06, 4)), overlap * (1 + u(-0.06, 0.06, 4)),
            1 + u(-0.025, 0.025, 4), u(0.7, 1.4, 4), u(0.75, 1.3, 4), u(0.985, 1.015) * (1 + u(-0.004, 0.004, 4)), u(0.1, 0.3, 4),
        ]
    )  # fmt: skip
    made = Build(
        top=top, cycle=int(rng.choice([20, 40])), mass=mass, hopper=u(0.15, 0.35), height=u(1.4, 2.0), cg=u(-0.06, 0.06), radius=radius,
        sink=u(0.004, 0.012), lateral=float(rng.choice([0.0, 0.0, 0.08])), base=u(2.4, 3.2), track=u(2.0, 2.6),
        inertia=u(0.008, 0.02) * mass * radius**2, motor=motor, full=full, road=u(0.52, 0.62) if two else 1.0, most=most,
        rest_drop=rest_drop, in_drop=u(8.0, 14.0) * 1e5, closes=u(0.85, 1.0), curve=u(1.0, 1.5), hysteresis=u(0.002, 0.008), lag=u(0.03, 0.07),
        pilot=u(8.0, 18.0) * 1e5, pilot_lag=u(0.03, 0.08), damper=u(0.3, 0.7), leakage=u(0.01, 0.03) * motor * full / radius / most,
        thin=u(0.0, 0.3), friction=u(0.01, 0.03) * motor * most, stiction=u(0.3, 1.0), lock=float(rng.choice([0.0, 0.15, 0.3])) * motor * most,
        lock_rear=bool(rng.random() < 0.5), power=u(1.6, 2.4) * motor * full / radius * most, droop=u(0.05, 0.12), governor=u(0.5, 1.0),
        idle=u(0.5, 0.65), known_drop=rest_drop * u(0.85, 1.15), known_load=u(15.0, 35.0) * 1e5, known_overlap=overlap * u(0.9, 1.1),
        proportional=u(0.05, 0.15), integral=u(0.15, 0.35), slew=u(1.2, 2.5), lever=u(0.006, 0.015), ramp=u(0.12, 0.3) * top,
        pitch=u(0.004, 0.010), windows=int(rng.choice([8, 12, 20])), grip=u(0.5, 0.75), stiffness=u(6.0, 11.0), relaxation=u(0.2, 0.45),
        roll=u(0.03, 0.06), slick=float(rng.choice([0.0, 0.0, 0.5])), rough=u(0.0, 0.15), hill=float(rng.choice([0.01, 0.03, 0.06])),
        hill_length=u(8.0, 20.0), ackermann=u(0.8, 1.0), steer_rate=u(0.25, 0.45), steer_gain=u(3.0, 6.0), steer_lag=u(0.04, 0.1),
        steer_dead=u(0.05, 0.15), scrub=u(0.2, 0.6), asymmetry=u(0.0, 0.15), play=u(0.0005, 0.003), stop=u(0.64, 0.72),
        tolerance=u(0.006, 0.012), quantum=float(rng.choice([0.001, 0.004])), speed_quantum=float(rng.choice([0.001, 0.01 / 3.6, 0.01])),
        angle_quantum=float(rng.choice([0.05, 0.1])) * np.pi / 180,
    )  # fmt: skip
    return made, parts


def commands_of(seed: int) -> str:
    """Which commands the individual's recorder has: of the body and of its wheels, of its wheels alone, of the body alone."""
    return str(np.random.default_rng(281_000 + seed).choice(["both", "wheels", "body"], p=[0.5, 0.3, 0.2]))


def machine_of(individual: tuple[Build, Array]) -> Machine:
    """The machine file as it is read: type plate and a tape measure."""
    made = individual[0]
    rng = np.random.default_rng(round(made.mass))
    base, track, wheel = (x * rng.uniform(0.98, 1.02) for x in (made.base, made.track, 2 * made.radius))
    text = (
        f'[machine]\nname = "{NAME}"\nwheels = ["FR", "FL", "RR", "RL"]\n\n[geometry]\nwheelbase = {base:.2f}\n'
        f"joint_spacing = {track:.2f}\nwheel_offset = {made.lateral:.2f}\nwheel_diameter = {wheel:.2f}\n"
        f'max_speed = {made.top * rng.uniform(0.95, 1.1):.1f}\nmax_steer = 0.7\n\n[control]\nlaw = "none"\n'
    )
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "machine.toml"
        path.write_text(text)
        return load_machine(path)


def commands(seed: int, duration: float) -> tuple[Array, ...]:
    """What a driver asks for, per millisecond: speed [m/s], angles of both axles [rad], shape (n, 2), what is in the hopper [of the
    machine], throttle [of rated], range for roads and lock (0 or 1)."""
    made, rng, n = build(seed)[0], np.random.default_rng(282_000 + seed), round(duration / STEP_S)
    speed, front, rear, throttle = np.zeros(n), np.zeros(n), np.zeros(n), np.full(n, made.idle)
    hopper, on_road, locked = np.zeros(n), np.zeros(n), np.zeros(n)
    at, side, picked = round(rng.uniform(1.0, 7.0) / STEP_S), float(rng.choice([-1.0, 1.0])), rng.uniform(0.0, 0.7)
    steady, trims = rng.uniform(0.25, 0.6), rng.random() < 0.6
    hopper[:] = picked
    jobs = ("row", "headland", "road", "creep", "empty")
    job = str(rng.choice(jobs, p=[0.35, 0.1, 0.4, 0.1, 0.05]))
    while at < n:
        start = at
        if job == "row":  # at one speed, by small corrections, on a slope with the rear held a little aside
            end = min(at + round(rng.uniform(8.0, 20.0) / STEP_S), n)
            speed[at:end] = steady * made.top
            for a in range(at, end, round(rng.uniform(1.5, 3.0) / STEP_S)):
                front[a:end] = rng.uniform(-0.12, 0.12)
            rear[at:end] = trims * rng.uniform(-0.12, 0.12)
            locked[at:end] = float(made.lock > 0.0)
            hopper[at:] = np.minimum(picked + 0.01 * np.arange(n - at) * STEP_S, 1.0)
            hopper[end:] = picked = float(hopper[end - 1])
            job, at = str(rng.choice(["headland", "creep", "empty"], p=[0.75, 0.1, 0.15])), end
        elif job == "headland":
            for back in (False, True, False)[: 1 + 2 * int(rng.random() < 0.35)]:
                end = min(at + round(rng.uniform(2.5, 5.5) / STEP_S), n)
                speed[at:end] = (-1.0 if back else 1.0) * rng.uniform(0.2, 0.4) * made.top
                front[at:end] = (-side if back else side) * rng.uniform(0.6, 1.0)
                rear[at:end] = -0.5 * front[at:end]
                at = end + round(0.4 / STEP_S)
            side, job = -side, str(rng.choice(["row", "road"], p=[0.75, 0.25]))
        elif job == "road":
            end = min(at + round(rng.uniform(8.0, 18.0) / STEP_S), n)
            speed[at:end] = rng.uniform(0.6, 0.95) * made.top * float(rng.choice([1.0, 1.0, 1.0, -0.6]))
            for a in range(at, end, round(rng.uniform(2.5, 5.0) / STEP_S)):
                front[a:end] = 0.5 * rng.uniform(-1.0, 1.0) * float(rng.random() < 0.75)
            on_road[at:end], at = float(made.road < 1.0), end
            job = str(rng.choice(["headland", "creep", "empty", "road"], p=[0.4, 0.2, 0.2, 0.2]))
        elif job == "creep":
            end = min(at + round(rng.uniform(3.0, 8.0) / STEP_S), n)
            speed[at:end] = rng.uniform(0.06, 0.15) * made.top * float(rng.choice([1.0, -1.0]))
            front[at:end], at = 0.4 * rng.uniform(-1.0, 1.0), end
            job = str(rng.choice(["row", "road", "headland"]))
        else:
            end = min(at + round(rng.uniform(4.0, 10.0) / STEP_S), n)
            if rng.random() < 0.6:
                hopper[(at + end) // 2 :] = picked = 0.0
            job, at = str(rng.choice(["row", "road", "headland"])), end
            continue
        throttle[max(start - 500, 0) : at] = rng.uniform(0.85, 1.0)
        if on_road[min(start, n - 1)] or rng.random() < 0.35 or job == "road":  # it stands where it changes its range
            at += round(rng.uniform(1.5, 4.0) / STEP_S)
    angle = np.column_stack([_smooth(x, rng.uniform(1.2, 2.0)) for x in (front, rear)]) * _BEND
    bend = np.abs(np.tan(angle[:, 0]) - np.tan(angle[:, 1])) / made.base
    limit = np.where(on_road > 0.0, made.full / made.road, made.full) * 0.85
    limit = np.minimum(limit, made.top) * (1 - 0.3 * np.abs(angle).max(axis=1) / _BEND) / (1 + bend * made.track / 2)
    speed = _smooth(np.clip(speed, -limit, limit), rng.uniform(0.4, 1.0))
    speed[np.abs(speed) < made.lever * made.top] = 0.0
    hopper = made.hopper * np.maximum(_smooth(hopper, 2.0, float(hopper[0])), 0.0)
    return speed, angle, hopper, _smooth(throttle, 0.8, made.idle), on_road, locked


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
    (made, parts), rng = build(seed), np.random.default_rng(284_000 + seed)
    loss, sat = courses(faults, duration, seed, made.top)
    asks = commands(seed, duration)
    noise = rng.standard_normal((asks[0].size, 6)) * np.array([0.0] * 4 + [4e-4] * 2)
    noise[:, 4:] += rng.uniform(-0.004, 0.004, 2)
    return drive(*asks, loss, sat, noise, rng.uniform(0.0, 2 * np.pi, 5), parts, made)


def _frames(rng: np.random.Generator, n: int, rate: float, waits: Array) -> tuple[np.ndarray, np.ndarray]:
    """Milliseconds at which a frame is sent, and stamps [ns] of whole milliseconds at which its logger has it; some are lost, some wait."""
    every = 1000.0 / rate * rng.uniform(0.9997, 1.0003)
    at = np.arange(rng.uniform(0.0, every), n - 80, every).astype(int)
    at = at[rng.random(at.size) > 0.004]
    late = 1.0 + np.floor(rng.gamma(1.2, 0.8, at.size))
    for start, stop in waits:
        held = (at >= start) & (at < stop)
        late[held] = np.maximum(late[held], stop - at[held])
    when = np.maximum.accumulate((at + late).astype(np.int64) - np.arange(at.size)) + np.arange(at.size)
    return at, _START_NS + when * 1_000_000


def signals(seed: int, faults: Sequence[FaultSpec], duration: float, tier: str) -> Signals:
    """A mission as a recorder has it; with ``spool`` positions of the spools as well, with ``direct`` second speeds and angles too."""
    made, has = build(seed)[0], commands_of(seed)
    rng, noise = np.random.default_rng(285_000 + seed), np.random.default_rng(286_000 + seed)
    ref, true, read, given, done, body, _ = driven(seed, tuple(faults), duration)
    n, aged = len(ref), int(rng.integers(5, 30))  # ms from a sensor to the bus
    rates = {"drive": 50.0, "valve": float(rng.choice([25.0, 50.0])), "spool": 50.0, "steer": 25.0, "second": 20.0}
    rates |= {"cmd": float(rng.choice([10.0, 25.0])), "imu": 50.0, "gnss": 5.0}
    starts = rng.uniform(0, n, rng.integers(0, 8))
    waits = np.column_stack([starts, starts + rng.uniform(10.0, 80.0, starts.size)]).astype(int)
    columns: dict[str, tuple[str, Array]] = {}
    for i, w in enumerate(WHEELS):
        columns[f"wheel.{w}.v"], columns[f"wheel.{w}.u"] = ("drive", read[:, i]), ("valve", given[:, i])
        if has != "body":
            columns[f"wheel.{w}.v_ref"] = "valve", np.round(ref[:, i], 3)
        if tier != "base":
            seen = done[:, i] * noise.uniform(0.99, 1.01) + noise.uniform(-0.004, 0.004)
            columns[f"wheel.{w}.u_applied"] = "spool", np.round((seen + 0.002 * noise.standard_normal(n)) * 250) / 250
        if tier == "direct":
            second = true[:, i] * noise.uniform(0.99, 1.01) + 0.004 * made.top * noise.standard_normal(n)
            columns[f"wheel.{w}.v_true"] = "second", np.round(second, 3)
    for a, axle in enumerate(AXLES, 4):
        columns[f"steer.{axle}.phi"], columns[f"steer.{axle}.phi_ref"] = ("steer", read[:, a]), ("steer", ref[:, a])
        columns[f"steer.{axle}.u"] = "steer", given[:, a]
        if tier != "base":
            seen = done[:, a] + noise.uniform(-0.004, 0.004) + 0.003 * noise.standard_normal(n)
            columns[f"steer.{axle}.u_applied"] = "steer", np.round(seen * 250) / 250
        if tier == "direct":
            second = true[:, a] + noise.uniform(-0.004, 0.004) + 1e-3 * noise.standard_normal(n)
            columns[f"steer.{axle}.phi_true"] = "second", np.round(second, 3)
    if has != "wheels":
        columns["cmd.v"], columns["cmd.omega"] = ("cmd", body[:, 3]), ("cmd", body[:, 3] * body[:, 4])
        columns["cmd.lateral"] = "cmd", body[:, 3] * (np.tan(ref[:, 4]) + np.tan(ref[:, 5])) / 2
    if rng.random() < 0.5:
        columns["imu.yaw_rate"] = "imu", body[:, 2] + noise.uniform(-0.005, 0.005) + 0.004 * noise.standard_normal(n)
    if rng.random() < 0.3:
        columns["gnss.speed"] = "gnss", np.abs(np.hypot(body[:, 0], body[:, 1]) + 0.03 * noise.standard_normal(n))
    shared, items = {group: _frames(rng, n, rate, waits) for group, rate in rates.items()}, {}
    for name, (group, values) in columns.items():
        at, stamps = shared[group]
        at = np.maximum(at - aged, 0) if group in ("drive", "steer") else at
        origin = SignalSource(topic=f"/{group}", field=name)
        items[name] = Signal(name, stamps, np.ascontiguousarray(values[at]), origin, NAME, guessed=False)
    return Signals(items, {}, (), (), open_loop=False)
