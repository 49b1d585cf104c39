"""An airport tug whose four wheel motors hold the speeds that they are told by themselves: a machine of physics of its own.

Commands are speeds for inverters, which give what torque that takes and so hide what slows a wheel until they are at their limits: that
of field weakening, of a battery that sags, of heat, and of what the battery takes back; some have no resolver and droop with the slip of
an induction motor. Soft tyres, ice and wet paint; aircraft of up to three times its mass surge on a bar with play; steering spindles
stop where their controller has a tolerance. The controller trims by a capped sum, or not. Everything goes by a logger that writes the last
message that it has, at 20 or 25 Hz, older or newer by channel. Each seed is another individual on another drive. For measuring only.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np
from hydrostatic import AXLES, WHEELS, courses
from tug_control import drive
from tug_physics import Array, Build

from replay.faults import FaultSpec
from replay.log.source_options import SignalSource
from replay.machine.config import Machine
from replay.machine.toml_file import load_machine
from replay.signals.signal import Signal, Signals

NAME = "tug"
STEP_S = 0.001
_START_NS = 1_809_000_000_000_000_000
_BEND = 0.4  # largest angle that a driver asks for [rad]


@lru_cache(maxsize=4)
def build(seed: int) -> tuple[Build, Array]:
    """The machine of a seed, and what differs between its wheels, shape (4, 8)."""
    rng = np.random.default_rng(220_000 + seed)
    u = rng.uniform
    top, mass, radius = u(1.5, 4.5), u(8000.0, 30000.0), u(0.4, 0.6)
    torque, full = u(0.5, 0.7) * mass * 9.81 / 4 * radius, u(1.1, 1.3) * top / radius
    sink, slips = u(0.02, 0.06), bool(rng.random() < 0.4)
    scale = u(0.985, 1.015)
    parts = np.column_stack(
        [
            radius * (1 + u(-0.006, 0.006, 4)), u(0.95, 1.05, 4), u(0.7, 1.4, 4), 1 + (0.006 if slips else 0.001) * u(-1.0, 1.0, 4),
            u(0.002, 0.02, 4), u(0.0, 0.006, 4), scale * (1 + u(-0.004, 0.004, 4)), u(0.0, 2 * np.pi, 4),
        ]
    )  # fmt: skip
    made = Build(
        top=top, cycle=int(rng.choice([20, 40])), mass=mass, height=u(0.5, 0.9), cg=u(-0.04, 0.08), radius=radius, sink=sink,
        lateral=float(rng.choice([0.0, 0.08])), base=u(2.0, 3.6), track=u(1.6, 2.3), inertia=u(0.01, 0.025) * mass * radius**2,
        torque=torque, full=full, knee=u(0.4, 0.7), slips=slips, rated=u(0.025, 0.05), droop=u(0.008, 0.025), compensated=u(0.4, 0.85),
        stiff=u(6.0, 15.0), restore=u(8.0, 25.0), inner_slew=u(0.6, 2.5), lag=u(0.008, 0.025), heating=u(1.2, 2.5), charge=u(0.25, 0.98),
        sag=u(0.05, 0.18), regen=float(rng.choice([1.0, 0.7, 0.4])), friction=u(0.01, 0.03) * torque, stiction=u(0.3, 1.0),
        roll=u(0.015, 0.03), bar=u(2.0, 6.0) * 9.81 * mass, bar_damping=u(0.3, 0.8) * mass, bar_play=u(0.005, 0.03),
        towed_roll=u(0.008, 0.015), grip=u(0.6, 0.85), stiffness=u(5.0, 10.0), relaxation=u(0.4, 0.9),
        slick=float(rng.choice([0.0, 0.4, 1.0])), hill=float(rng.choice([0.004, 0.012, 0.03])), hill_length=u(8.0, 20.0),
        bandwidth=u(15.0, 45.0), quantum=float(rng.choice([0.002, 0.01 / 3.6, 0.1 / 3.6])), ramp=u(0.2, 0.5) * top,
        tow_ramp=u(0.06, 0.14) * top, forward=u(0.97, 1.03), integral=u(0.05, 0.2), cap=float(rng.choice([0.0, 0.06, 0.15])),
        ackermann=u(0.6, 1.0), steer_rate=u(0.2, 0.4), steer_gain=u(3.0, 6.0), steer_lag=u(0.04, 0.1), scrub=u(0.1, 0.6),
        play=u(0.001, 0.005), stop=u(0.46, 0.54), tolerance=u(0.006, 0.014), angle_quantum=float(rng.choice([0.1, 0.1, 0.25])) * np.pi / 180,
    )  # fmt: skip
    return made, parts


def commands_of(seed: int) -> str:
    """Which commands the individual's recorder has: of the body and of its wheels, of its wheels alone, of the body alone."""
    return str(np.random.default_rng(221_000 + seed).choice(["both", "wheels", "body"], p=[0.5, 0.3, 0.2]))


def machine_of(individual: tuple[Build, Array]) -> Machine:
    """The machine file as it is read: type plate and a tape measure."""
    made = individual[0]
    rng = np.random.default_rng(round(made.mass))
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
    """What a driver asks for, per millisecond: speed [m/s], angles of both axles [rad], shape (n, 2), and the mass towed [of the machine]."""
    made, rng, n = build(seed)[0], np.random.default_rng(222_000 + seed), round(duration / STEP_S)
    speed, bend, rear, towed = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n)
    at, sign = round(rng.uniform(0.5, 6.0) / STEP_S), 1.0
    mode, hangs = float(rng.choice([0.0, -1.0, -1.0, 1.0])), float(rng.random() < 0.4) * rng.uniform(0.5, 3.0)
    rear[:], towed[:] = mode, hangs
    while at < n:
        kind = str(rng.choice(["tow", "free", "row", "align", "stand"], p=[0.3, 0.25, 0.15, 0.15, 0.15]))
        if kind == "tow" and hangs == 0.0:
            kind = "free"
        legs, least, largest, short, long, curve = {
            "tow": (1, 0.2, 0.5, 9.0, 22.0, 0.5), "free": (1, 0.4, 0.95, 5.0, 12.0, 1.0), "row": (1, 0.3, 0.8, 12.0, 25.0, 0.05),
            "align": (3, 0.06, 0.2, 3.0, 6.0, 0.9), "stand": (0, 0.0, 0.0, 0.0, 0.0, 0.0),
        }[kind]  # fmt: skip
        if hangs > 0.0:
            least, largest, curve = min(least, 0.3), min(largest, 0.55), 0.6 * curve
        if kind == "stand":  # takes an aircraft or lets go of it, and changes the way it steers
            end = min(at + round(rng.uniform(4.0, 12.0) / STEP_S), n)
            hangs = float(rng.random() < 0.5) * rng.uniform(0.5, 3.0)
            mode = float(rng.choice([0.0, -1.0, -1.0, 1.0]))
            towed[(at + end) // 2 + 1500 :], rear[end:], at = hangs, mode, end
        for _ in range(legs):
            end = min(at + round(rng.uniform(short, long) / STEP_S), n)
            speed[at:end] = sign * rng.uniform(least, largest) * made.top
            bend[at:end] = curve * rng.uniform(-1.0, 1.0) * float(rng.random() < 0.8)
            if rng.random() < 0.5:
                bend[(at + end) // 2 : end] = curve * rng.uniform(-1.0, 1.0)
            at, sign = end, -sign if kind == "align" or rng.random() < 0.25 else sign
        at += round(rng.uniform(0.5, 6.0) / STEP_S) if rng.random() < 0.6 else 0
    front = _BEND * _smooth(bend, rng.uniform(1.0, 2.0))
    angle = np.column_stack([front, _smooth(rear, 2.5, float(rear[0])) * front])
    turns = np.abs(np.tan(angle[:, 0]) - np.tan(angle[:, 1])) / made.base
    limit = made.top * (1 - 0.4 * np.abs(front) / _BEND) / (1 + turns * made.track / 2)
    speed = _smooth(np.clip(speed, -limit, limit), rng.uniform(0.4, 1.0))
    speed[np.abs(speed) < 0.01 * made.top] = 0.0
    return speed, angle, _when_it_stands(towed, speed)


def _when_it_stands(towed: Array, speed: Array) -> Array:
    """A bar is put in, or taken out, where the machine stands; else what hung on it stays."""
    out = towed.copy()
    for k in np.flatnonzero(np.diff(towed)) + 1:
        if speed[max(k - 1500, 0) : k + 500].any():
            out[k:] = out[k - 1]
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
    (made, parts), rng = build(seed), np.random.default_rng(224_000 + seed)
    loss, sat = courses(faults, duration, seed, made.top)
    speed, angle, towed = commands(seed, duration)
    noise = rng.standard_normal((speed.size, 6)) * np.array([0.001 * made.top] * 4 + [4e-4] * 2)
    noise[:, 4:] += rng.uniform(-0.004, 0.004, 2)
    return drive(speed, angle, towed, loss, sat, noise, rng.uniform(0.0, 2 * np.pi, 5), parts, made)


def _sampled(rng: np.random.Generator, x: Array, stamps: Array, sent_hz: float) -> Array:
    """What a logger has of a value that is sent now and then, at its own times [ms]: the last one that came, some of which are lost."""
    every = 1000.0 / sent_hz * rng.uniform(0.998, 1.002)
    sent = np.arange(rng.uniform(0.0, every), x.size - 1, every)
    sent = sent[rng.random(sent.size) > 0.004]
    last = np.clip(np.searchsorted(sent + rng.uniform(0.5, 4.0), stamps) - 1, 0, sent.size - 1)
    return np.asarray(x[sent[last].astype(int)])


def signals(seed: int, faults: Sequence[FaultSpec], duration: float, tier: str) -> Signals:
    """A mission as a recorder has it; with ``spool`` what inverters and steering motors do, with ``direct`` second speeds and angles too."""
    (made, parts), has = build(seed), commands_of(seed)
    rng, noise = np.random.default_rng(225_000 + seed), np.random.default_rng(226_000 + seed)
    ref, true, read, given, done, body, _ = driven(seed, tuple(faults), duration)
    n, rate = len(ref), float(rng.choice([20.0, 25.0]))
    sends = {
        "drive": float(rng.choice([20.0, 25.0, 50.0, 100.0])),
        "spool": float(rng.choice([20.0, 50.0])),
        "steer": 50.0,
    }
    sends |= {"cmd": float(rng.choice([10.0, 20.0, 50.0])), "second": 50.0, "imu": 100.0}
    columns: dict[str, tuple[str, Array]] = {}
    turns = 60.0 / (2 * np.pi * made.radius) * rng.uniform(18.0, 40.0)  # of a motor per minute and m/s
    gains, zeros = rng.uniform(0.99, 1.01, 6), rng.uniform(-0.003, 0.003, 6)
    for i, w in enumerate(WHEELS):
        columns[f"wheel.{w}.v"], columns[f"wheel.{w}.u"] = ("drive", read[:, i]), ("drive", given[:, i])
        if has != "body":
            columns[f"wheel.{w}.v_ref"] = "drive", np.round(ref[:, i], 3)
        if tier != "base":
            columns[f"wheel.{w}.u_applied"] = "spool", np.round(done[:, i] * 1000) / 1000
        if tier == "direct":
            second = true[:, i] * parts[i, 3] * noise.uniform(0.99, 1.01) + 0.002 * made.top * noise.standard_normal(n)
            columns[f"wheel.{w}.v_true"] = "second", np.round(second * turns) / turns
    for a, axle in enumerate(AXLES, 4):
        columns[f"steer.{axle}.phi"], columns[f"steer.{axle}.phi_ref"] = ("steer", read[:, a]), ("steer", ref[:, a])
        columns[f"steer.{axle}.u"] = "steer", given[:, a]
        if tier != "base":
            seen = gains[a] * done[:, a] + zeros[a] + 0.003 * noise.standard_normal(n)
            columns[f"steer.{axle}.u_applied"] = "spool", np.round(seen * 500) / 500
        if tier == "direct":
            second = true[:, a] * gains[a - 2] + noise.uniform(-0.003, 0.003) + 8e-4 * noise.standard_normal(n)
            columns[f"steer.{axle}.phi_true"] = "second", np.round(second, 3)
    if has != "wheels":
        columns["cmd.v"], columns["cmd.omega"] = ("cmd", body[:, 3]), ("cmd", body[:, 3] * body[:, 4])
        columns["cmd.lateral"] = "cmd", body[:, 3] * (np.tan(ref[:, 4]) + np.tan(ref[:, 5])) / 2
    if rng.random() < 0.6:
        drift = noise.uniform(-0.004, 0.004) + noise.uniform(-0.006, 0.006) * np.linspace(0.0, 1.0, n)
        columns["imu.yaw_rate"] = "imu", body[:, 2] + drift + 0.003 * noise.standard_normal(n)
    at = np.arange(rng.uniform(1.0, 40.0), n - 60, 1000.0 / rate)
    at = np.unique((at + rng.gamma(1.2, 1.5, at.size)).astype(int))
    for start in rng.integers(0, at.size, rng.integers(0, 3)):  # the logger writes its file
        at = np.delete(at, np.s_[start : start + int(rng.integers(2, 12))])
    stamps = _START_NS + at * 1_000_000 + rng.integers(0, 900_000, at.size)
    series = {name: (group, stamps, _sampled(rng, x, at, sends[group])) for name, (group, x) in columns.items()}
    if rng.random() < 0.5:  # a receiver that is lost under wings and roofs
        where = np.arange(200, n, 200)
        keep = np.interp(where, np.arange(0, n + 5000, 5000), rng.uniform(0.0, 1.0, n // 5000 + 1)) > 0.3
        size = np.abs(np.hypot(body[where, 0], body[where, 1]) + 0.03 * noise.standard_normal(where.size))
        series["gnss.speed"] = "gnss", _START_NS + where[keep] * 1_000_000 + 120_000_000, size[keep]
    items = {}
    for name, (group, when, values) in series.items():
        origin = SignalSource(topic=f"/{group}", field=name)
        items[name] = Signal(name, when, np.ascontiguousarray(values), origin, NAME, guessed=False)
    return Signals(items, {}, (), (), open_loop=False)
