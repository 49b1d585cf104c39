"""A shipyard's heavy transporter with hydraulic motors that grow with their pressure, in short moves: a machine of physics of its own.

Commands are flows for amplifiers with ramps and a dead band, and motors take more of it the more they pull: the same command turns a wheel at
half the speed uphill, and a capped integral makes up for it. A load-sensing pump with an accumulator hears the highest load late; a limit
takes flow from all wheels while the engine droops. Brakes spring close at every stop and open one after the other; some machines coast,
with wheels that turn freely. Up to three times its own mass is carried, on three hydraulic zones; axles counter-steer, crab, and turn where it
stands. Coils tell nothing of slow wheels. A bus carries every channel at a rate of its own, late, in bursts, with frames that are
lost and some that come twice. Each seed is another individual on another job. For measuring only.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np
from hydrostatic import AXLES, WHEELS, courses
from transporter_control import drive
from transporter_physics import Array, Build

from replay.faults import FaultSpec
from replay.log.source_options import SignalSource
from replay.machine.config import Machine
from replay.machine.toml_file import load_machine
from replay.signals.signal import Signal, Signals

NAME = "transporter"
STEP_S = 0.001
_START_NS = 1_815_000_000_000_000_000
_BEND = 0.45  # largest angle that a driver asks for [rad]


@lru_cache(maxsize=4)
def build(seed: int) -> tuple[Build, Array]:
    """The machine of a seed, and what differs between its wheels, shape (4, 9)."""
    rng = np.random.default_rng(260_000 + seed)
    u = rng.uniform
    top, mass, radius, most_load = u(1.0, 3.0), u(12000.0, 40000.0), u(0.36, 0.6), u(1.0, 3.0)
    most, small = u(280.0, 360.0) * 1e5, u(0.4, 0.7)
    motor = u(0.11, 0.16) * 9.81 * mass * (1 + most_load) / 4 * radius / most
    full = u(1.15, 1.4) * top
    flow, scale = motor * small * full / radius, u(0.985, 1.015)
    deaf = u(0.015, 0.04) * top
    parts = np.column_stack(
        [
            radius * (1 + u(-0.006, 0.006, 4)), u(0.96, 1.04, 4), u(0.95, 1.04, 4), u(0.7, 1.4, 4), u(0.75, 1.3, 4), u(0.15, 0.35, 4),
            u(0.1, 0.4, 4), scale * (1 + u(-0.004, 0.004, 4)), deaf * u(0.9, 1.1, 4),
        ]
    )  # fmt: skip
    pump = u(0.8, 1.15) * 4 * flow
    made = Build(
        top=top, cycle=int(rng.choice([20, 40])), mass=mass, most_load=most_load, height=u(0.8, 1.6), cg=u(-0.08, 0.08),
        zone=int(rng.integers(0, 2)), radius=radius, sink=u(0.002, 0.006), lateral=float(rng.choice([0.0, 0.0, 0.1])), base=u(3.0, 6.0),
        track=u(1.6, 2.6), inertia=u(0.008, 0.02) * mass * radius**2, motor=motor, small=small, begins=u(0.35, 0.55) * most,
        span=u(0.2, 0.4) * most, flow=flow, full=full, slope=u(0.0, 0.03), dead=u(0.03, 0.1), amplifier=u(1.5, 5.0), lag=u(0.03, 0.09),
        margin=u(15.0, 25.0) * 1e5, most=most, damper=u(0.3, 0.7), leakage=u(0.015, 0.04) * flow / most, friction=u(0.01, 0.03) * motor * most,
        stiction=u(0.3, 1.0), pump=pump, store=u(0.1, 0.5), heard_up=u(0.02, 0.08), heard_down=u(0.2, 0.8), power=u(0.5, 0.8) * pump * most,
        droop=u(0.05, 0.12), governor=u(0.5, 1.0), idle=u(0.5, 0.7), reserve=u(0.05, 0.1), pitch=u(0.004, 0.012),
        gate=int(rng.choice([40, 100, 200])), forward=u(0.92, 1.05), proportional=u(0.08, 0.3), integral=u(0.1, 0.4), slew=u(0.8, 2.5),
        lever=u(0.006, 0.015), ramp=u(0.2, 0.5) * top, coasts=bool(rng.random() < 0.5), coast_ramp=u(0.15, 0.3), grip=u(0.5, 0.75),
        stiffness=u(8.0, 14.0), relaxation=u(0.2, 0.4), roll=u(0.012, 0.025), slick=float(rng.choice([0.0, 0.0, 0.6])),
        hill=float(rng.choice([0.003, 0.01, 0.03])), hill_length=u(6.0, 16.0), ackermann=u(0.8, 1.0), steer_rate=u(0.15, 0.3),
        steer_gain=u(3.0, 6.0), steer_lag=u(0.04, 0.1), scrub=u(0.2, 0.6), asymmetry=u(0.0, 0.15), play=u(0.0005, 0.003), stop=u(0.5, 0.58),
        tolerance=u(0.006, 0.012), quantum=float(rng.choice([0.001, 0.004])), speed_quantum=float(rng.choice([0.001, 0.01 / 3.6, 0.01])),
        angle_quantum=float(rng.choice([0.05, 0.1])) * np.pi / 180,
    )  # fmt: skip
    return made, parts


def commands_of(seed: int) -> str:
    """Which commands the individual's recorder has: of the body and of its wheels, of its wheels alone, of the body alone."""
    return str(np.random.default_rng(261_000 + seed).choice(["both", "wheels", "body"], p=[0.5, 0.3, 0.2]))


def machine_of(individual: tuple[Build, Array]) -> Machine:
    """The machine file as it is read: type plate and a tape measure."""
    made = individual[0]
    rng = np.random.default_rng(round(made.mass))
    base, track, wheel = (x * rng.uniform(0.98, 1.02) for x in (made.base, made.track, 2 * made.radius))
    text = (
        f'[machine]\nname = "{NAME}"\nwheels = ["FR", "FL", "RR", "RL"]\n\n[geometry]\nwheelbase = {base:.2f}\n'
        f"joint_spacing = {track:.2f}\nwheel_offset = {made.lateral:.2f}\nwheel_diameter = {wheel:.2f}\n"
        f'max_speed = {made.top * rng.uniform(0.95, 1.1):.1f}\nmax_steer = 0.55\n\n[control]\nlaw = "none"\n'
    )
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "machine.toml"
        path.write_text(text)
        return load_machine(path)


#: Jobs: legs, speeds [of the top], seconds of a leg, curve [of the largest], whether every leg turns back.
_JOBS = {
    "travel": (1, (0.4, 0.95), (8.0, 18.0), 0.7, False),
    "shunt": (3, (0.1, 0.35), (2.5, 6.0), 0.9, True),
    "crab": (2, (0.15, 0.45), (4.0, 9.0), 1.0, True),
    "place": (2, (0.05, 0.12), (2.0, 5.0), 0.4, True),
    "idle": (0, (0.0, 0.0), (5.0, 14.0), 0.0, False),
}


def commands(seed: int, duration: float) -> tuple[Array, ...]:
    """What a driver asks for, per millisecond: speed [m/s], angles of both axles [rad], shape (n, 2), the mass carried [of the machine]
    and the throttle [of rated]."""
    made, rng, n = build(seed)[0], np.random.default_rng(262_000 + seed), round(duration / STEP_S)
    speed, front, rear, carried, throttle = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n), np.full(n, made.idle)
    at, sign, mode = round(rng.uniform(1.0, 8.0) / STEP_S), 1.0, float(rng.choice([0.0, -1.0, -1.0]))
    carried[:] = made.most_load * rng.uniform(0.3, 1.0) * float(rng.random() < 0.6)
    while at < n:
        job = str(rng.choice(list(_JOBS), p=[0.33, 0.25, 0.17, 0.1, 0.15]))
        legs, sizes, seconds, curve, back = _JOBS[job]
        if job == "idle":  # takes a load or sets it down, and may change the way it steers
            end = min(at + round(rng.uniform(*seconds) / STEP_S), n)
            carried[(at + end) // 2 + 1000 :] = made.most_load * rng.uniform(0.3, 1.0) * float(rng.random() < 0.6)
            mode, at = float(rng.choice([0.0, -1.0, -1.0])), end
            continue
        start, turned = at, at
        if job == "crab":  # axles are turned where it stands
            angle = rng.uniform(0.3, 1.0) * float(rng.choice([-1.0, 1.0]))
            at += round(rng.uniform(2.0, 3.5) / STEP_S)
        for _ in range(legs):
            end = min(at + round(rng.uniform(*seconds) / STEP_S), n)
            speed[at:end] = sign * rng.uniform(*sizes) * made.top
            if job == "crab":
                front[turned:end] = rear[turned:end] = angle * (1.0 if turned == start else rng.uniform(0.8, 1.0))
            else:
                for a, b in ((at, (at + end) // 2), ((at + end) // 2, end)):
                    front[a:b] = curve * rng.uniform(-1.0, 1.0) * float(rng.random() < 0.75)
                    rear[a:b] = mode * front[a:b]
            at = turned = end
            sign = -sign if back or rng.random() < 0.2 else sign
            at += round(rng.uniform(0.3, 2.0) / STEP_S) if back else 0
        throttle[max(start - 300, 0) : at] = rng.uniform(0.8, 1.0)
        at += round(rng.uniform(1.0, 6.0) / STEP_S) if rng.random() < 0.6 else 0
    angle_of = np.column_stack([_smooth(x, rng.uniform(1.2, 2.0)) for x in (front, rear)]) * _BEND
    turns = np.abs(np.tan(angle_of[:, 0]) - np.tan(angle_of[:, 1])) / made.base
    heavy = 1.0 - 0.4 * carried / (1.0 + made.most_load)
    limit = made.top * heavy * (1 - 0.3 * np.abs(angle_of).max(axis=1) / _BEND) / (1 + turns * made.track / 2)
    speed = _smooth(np.clip(speed, -limit, limit), rng.uniform(0.4, 1.0))
    speed[np.abs(speed) < made.lever * made.top] = 0.0
    carried = np.maximum(_smooth(carried, 2.0, float(carried[0])), 0.0)
    return speed, angle_of, carried, _smooth(throttle, 0.8, made.idle)


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
    (made, parts), rng = build(seed), np.random.default_rng(264_000 + seed)
    loss, sat = courses(faults, duration, seed, made.top)
    speed, angle, carried, throttle = commands(seed, duration)
    noise = rng.standard_normal((speed.size, 6)) * np.array([0.0] * 4 + [4e-4] * 2)
    noise[:, 4:] += rng.uniform(-0.004, 0.004, 2)
    return drive(speed, angle, carried, throttle, loss, sat, noise, rng.uniform(0.0, 2 * np.pi, 5), parts, made)


def _frames(rng: np.random.Generator, n: int, rate: float, busy: Array) -> tuple[np.ndarray, np.ndarray]:
    """Milliseconds at which a channel is sent, and stamps [ns] at which its frames come: in jitter, late while the bus is busy, some lost, some twice."""
    every = 1000.0 / rate * rng.uniform(0.9995, 1.0005)
    at = np.arange(rng.uniform(0.0, every), n - 60, every).astype(int)
    at = at[rng.random(at.size) > 0.003]
    late = rng.gamma(1.5, 0.2, at.size)
    for start, stop in busy:  # what was held back comes in a burst
        held = (at >= start) & (at < stop)
        late[held] = np.maximum(late[held], stop - at[held] + 0.15 * np.arange(np.count_nonzero(held)))
    twice = rng.random(at.size) < 0.002
    at, when = np.concatenate([at, at[twice]]), np.concatenate([at + late, at[twice] + late[twice] + 0.4])
    order = np.argsort(when, kind="stable")
    stamps = _START_NS + np.round(when[order] * 1e6).astype(np.int64)
    return at[order], np.maximum.accumulate(stamps - 1000 * np.arange(at.size)) + 1000 * np.arange(at.size)


def signals(seed: int, faults: Sequence[FaultSpec], duration: float, tier: str) -> Signals:
    """A mission as a recorder has it; with ``spool`` positions of the spools as well, with ``direct`` second speeds and angles too."""
    made, has = build(seed)[0], commands_of(seed)
    rng, noise = np.random.default_rng(265_000 + seed), np.random.default_rng(266_000 + seed)
    ref, true, read, given, done, body, _ = driven(seed, tuple(faults), duration)
    n, aged = len(ref), int(rng.integers(5, 40))  # ms from a sensor to the bus
    rates = {
        "drive": 50.0,
        "valve": 100.0,
        "spool": float(rng.choice([20.0, 50.0])),
        "steer": 20.0,
        "second": 50.0,
        "ref": 50.0,
    }
    rates |= {"cmd": float(rng.choice([10.0, 50.0])), "imu": 100.0, "gnss": 5.0}
    starts = rng.uniform(0, n, rng.integers(0, 6))
    busy = np.column_stack([starts, starts + rng.uniform(5.0, 60.0, starts.size)])
    columns: dict[str, tuple[str, Array]] = {}
    for i, w in enumerate(WHEELS):
        columns[f"wheel.{w}.v"], columns[f"wheel.{w}.u"] = ("drive", read[:, i]), ("valve", given[:, i])
        if has != "body":
            columns[f"wheel.{w}.v_ref"] = "ref", np.round(ref[:, i], 3)
        if tier != "base":
            seen = (
                done[:, i] * noise.uniform(0.99, 1.01) + noise.uniform(-0.004, 0.004) + 0.002 * noise.standard_normal(n)
            )
            columns[f"wheel.{w}.u_applied"] = "spool", np.round(seen * 250) / 250
        if tier == "direct":
            second = true[:, i] * noise.uniform(0.99, 1.01) + 0.003 * made.top * noise.standard_normal(n)
            columns[f"wheel.{w}.v_true"] = "second", np.round(second, 3)
    for a, axle in enumerate(AXLES, 4):
        columns[f"steer.{axle}.phi"], columns[f"steer.{axle}.phi_ref"] = ("steer", read[:, a]), ("steer", ref[:, a])
        columns[f"steer.{axle}.u"] = "steer", given[:, a]
        if tier != "base":
            seen = done[:, a] + noise.uniform(-0.004, 0.004) + 0.003 * noise.standard_normal(n)
            columns[f"steer.{axle}.u_applied"] = "steer", np.round(seen * 250) / 250
        if tier == "direct":
            second = true[:, a] + noise.uniform(-0.004, 0.004) + 1e-3 * noise.standard_normal(n)
            columns[f"steer.{axle}.phi_true"] = "steer", np.round(second, 3)
    if has != "wheels":
        columns["cmd.v"], columns["cmd.omega"] = ("cmd", body[:, 3]), ("cmd", body[:, 3] * body[:, 4])
        columns["cmd.lateral"] = "cmd", body[:, 3] * (np.tan(ref[:, 4]) + np.tan(ref[:, 5])) / 2
    if rng.random() < 0.5:
        columns["imu.yaw_rate"] = "imu", body[:, 2] + noise.uniform(-0.005, 0.005) + 0.004 * noise.standard_normal(n)
    if rng.random() < 0.3:
        columns["gnss.speed"] = "gnss", np.abs(np.hypot(body[:, 0], body[:, 1]) + 0.03 * noise.standard_normal(n))
    shared = {group: _frames(rng, n, rate, busy) for group, rate in rates.items()}
    items = {}
    for name, (group, values) in columns.items():
        at, stamps = (
            shared[group] if group != "drive" else _frames(rng, n, rates[group], busy)
        )  # each wheel sends its own
        at = np.maximum(at - aged, 0) if group in ("drive", "steer") else at
        origin = SignalSource(topic=f"/{group}", field=name)
        items[name] = Signal(name, stamps, np.ascontiguousarray(values[at]), origin, NAME, guessed=False)
    return Signals(items, {}, (), (), open_loop=False)
