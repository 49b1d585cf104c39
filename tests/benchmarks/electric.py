"""A battery-electric carrier with a motor at every wheel: a machine of physics that no other one of `all_clear.py` has.

Permanent-magnet motors whose torque the controller asks for (`wheel.W.u` is a torque, −1 … 1 of the greatest; `u_applied` the
measured current), gears with play, tyres with slip curves on slopes and on soft or slick ground, electric steering cylinders,
modes of driving, brakes at rest, encoders timed by their edges, a bus that rounds, a recorder that jitters and loses rows. Each
seed is another individual. Faults are those of L16 (4) and (8): a dead motor has no torque, a stuck one holds its own, an
inefficient one gives a share, a noisy one shakes. For measuring only.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np
from electric_control import drive
from electric_physics import Array, Build
from hydrostatic import AXLES, WHEELS, courses

from replay.faults import FaultSpec
from replay.log.source_options import SignalSource
from replay.machine.config import Machine
from replay.machine.toml_file import load_machine
from replay.signals.signal import Signal, Signals

NAME = "electric"
STEP_S = 0.001
_START_NS = 1_788_000_000_000_000_000
#: What an individual's recorder has of the commands: of the body and of its wheels, of its wheels alone, of the body alone.
COMMANDS = ("both", "wheels", "body")
#: Changes of every individual at once, for what a fleet sees: more load, a slower controller.
HEAVIER, SLOWER = "heavier", "slower"


@lru_cache(maxsize=4)
def build(seed: int, changed: str = "") -> tuple[Build, Array]:
    """The machine of a seed, and what differs between its wheels, shape (4, 6); `changed`: `HEAVIER`, `SLOWER` or nothing."""
    rng = np.random.default_rng(90_000 + seed)
    u = rng.uniform
    top, empty, radius, force = u(1.2, 3.0), u(7000.0, 16000.0), u(0.4, 0.62), u(0.45, 0.7)
    mass = empty * (1 + u(0.0, 0.5))
    torque = force * 9.81 * empty * 1.25 / 4 * radius
    rotor, stiff, gear = u(0.015, 0.035) * empty * radius**2, torque / u(0.03, 0.07), u(20.0, 45.0)
    cycle = int(rng.choice([20, 20, 40]))
    loop = (
        u(1.5, 2.8) * (0.75 if cycle == 40 else 1.0) * empty * 1.25 / 4 * radius / torque
    )  # tuned until nothing hunts
    parts = np.column_stack(
        [
            radius * u(0.965, 0.995) * (1 + u(-0.01, 0.01, 4)),
            u(0.96, 1.04, 4),
            u(0.8, 1.25, 4),
            u(0.005, 0.03, 4),
            u(0.98, 1.02, 4),
            u(-0.005, 0.005, 4),
        ]
    )
    made = Build(
        top=top,
        cycle=cycle,
        mass=mass,
        height=u(0.7, 1.4),
        cg=u(-0.08, 0.08),
        radius=radius,
        lateral=float(rng.choice([0.0, 0.06, 0.12])),
        base=u(2.4, 3.6),
        track=u(1.6, 2.2),
        torque=torque,
        knee=u(0.45, 0.75) * top / radius,
        fastest=u(1.15, 1.35) * top / radius,
        lag=u(0.003, 0.015),
        poles=gear * float(rng.choice([4, 5, 8])),
        heating=u(1.5, 4.0),
        sag=u(0.04, 0.15),
        rotor=rotor,
        wheel=u(0.008, 0.014) * empty * radius**2,
        shaft=stiff,
        damping=0.4 * np.sqrt(stiff * rotor),
        play=u(0.0008, 0.004),
        friction=u(0.01, 0.03) * torque,
        stiction=u(1.2, 1.8),
        stribeck=u(0.05, 0.2),
        viscous=u(0.005, 0.02) * torque / (top / radius),
        gear_loss=u(0.03, 0.09),
        relaxation=u(0.3, 0.55),
        grip=u(0.7, 0.95),
        slope=u(12.0, 22.0),
        roll=u(0.012, 0.03),
        hills=float(rng.choice([0.01, 0.04, 0.09])),
        waves=u(5.0, 12.0),
        ramp=u(0.3, 0.7) * top,
        brake_ramp=u(0.5, 0.9) * top,
        jerk=u(1.0, 2.5) * top,
        shared=bool(rng.random() < 0.5),
        proportional=loop,
        integral=u(0.8, 1.6) * loop,
        leak=u(8.0, 30.0),
        known_mass=empty * u(1.0, 1.3),
        tilt=float(rng.choice([0.0, 0.8, 1.0])),
        known_roll=u(0.6, 1.1) * 0.02 * mass * 9.81 / 4 * radius / torque,
        slew=u(4.0, 10.0),
        reading_lag=u(0.005, 0.02),
        quantum_v=float(rng.choice([1 / 256, 0.001, 2 * np.pi * radius / gear / 60])),
        quantum_u=float(rng.choice([0.001, 0.004])),
        pitch=2 * np.pi * radius / gear / float(rng.choice([48, 64, 128])),
        hub_pitch=2 * np.pi * radius / float(rng.choice([720, 1024, 2048])),
        tick=float(rng.choice([1e-6, 1e-5, 5e-5])),
        uneven=u(0.01, 0.06),
        ackermann=u(0.6, 1.0),
        steer_rate=u(0.2, 0.45),
        steer_gain=u(3.0, 6.0),
        steer_lag=u(0.03, 0.09),
        steer_droop=u(0.03, 0.15),
        steer_play=u(0.001, 0.004),
        tolerance=u(0.003, 0.008),
        inside=bool(rng.random() < 0.4),
        rear=float(rng.choice([0.5, 1.0])) if commands_of(seed) == "wheels" else 1.0,
    )
    if changed == HEAVIER:
        made = made._replace(mass=1.4 * made.mass)
    elif changed == SLOWER:
        made = made._replace(cycle=2 * made.cycle, proportional=0.6 * loop, integral=0.6 * made.integral, slew=3.0)
    return made, parts


def commands_of(seed: int) -> str:
    """Which commands the individual's recorder has, of `COMMANDS`."""
    return COMMANDS[int(np.random.default_rng(91_000 + seed).choice([0, 0, 1, 2]))]


def recorder_of(seed: int) -> str:
    """What records the rows: its ``controller``, one a cycle, or a ``logger`` at a rate of its own that may repeat values."""
    return str(np.random.default_rng(96_000 + seed).choice(["controller", "logger"]))


def machine_text(individual: tuple[Build, Array]) -> str:
    """Its machine file: type plate, a tape measure, and what its users believe of its speed; nothing of motors and gears."""
    made = individual[0]
    rng = np.random.default_rng(round(1000 * made.torque))  # as wrong as this individual's users are, load or not
    base, track, wheel = (x * rng.uniform(0.97, 1.03) for x in (made.base, made.track, 2 * made.radius))
    return (
        f'[machine]\nname = "{NAME}"\nwheels = ["FR", "FL", "RR", "RL"]\ndrive = "motor"\n\n[geometry]\n'
        f"wheelbase = {base:.2f}\njoint_spacing = {track:.2f}\nwheel_offset = {made.lateral:.2f}\nwheel_diameter = {wheel:.2f}\n"
        f"max_speed = {made.top * rng.uniform(0.9, 1.1):.1f}\nmax_steer = 0.5\n\n"
        '[control]\nlaw = "none"\n'
    )


def machine_of(individual: tuple[Build, Array]) -> Machine:
    """The machine file as it is read."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "machine.toml"
        path.write_text(machine_text(individual))
        return load_machine(path)


def commands(seed: int, duration: float) -> tuple[Array, Array, Array, Array]:
    """Speed of the body [m/s], its curvature [1/m], angles of both axles [rad], shape (n, 2), and emergencies, per millisecond."""
    made, rng, n = build(seed)[0], np.random.default_rng(92_000 + seed), round(duration / STEP_S)
    speed, bend, hurry = np.zeros(n), np.zeros(n), np.zeros(n)
    at, sign = round(rng.uniform(1.0, 2.5) / STEP_S), 1.0
    while at < n:
        mode = rng.choice([0.15, 0.5, 0.95], p=[0.2, 0.45, 0.35])  # creep, work, transit
        for _ in range(rng.integers(1, 4)):
            length = round(rng.uniform(2.5, 7.0) / STEP_S)
            speed[at : at + length] = sign * mode * rng.uniform(0.55, 1.0) * made.top
            at += length
        at += round(rng.choice([0.4, 1.5, 3.5]) / STEP_S)
        sign = -sign if rng.random() < 0.35 else sign
    for start in rng.integers(0, n, rng.integers(0, 3)):  # something comes too near: the scanners slow the machine down
        span = slice(start, start + round(rng.uniform(0.8, 2.5) / STEP_S))
        speed[span], hurry[span] = speed[span] * rng.choice([0.0, 0.3]), 1.0
    at = round(rng.uniform(0.0, 3.0) / STEP_S)
    while at < n:
        length = round(rng.uniform(2.5, 8.0) / STEP_S)
        bend[at : at + length] = rng.uniform(-1.0, 1.0) if rng.random() < 0.7 else 0.0
        at += length
    front = 0.45 * _smooth(bend, rng.uniform(0.8, 1.6))
    angle = np.column_stack([front, -made.rear * front])
    curve = (np.tan(angle[:, 0]) - np.tan(angle[:, 1])) / made.base
    limit = made.top * (1 - 0.6 * np.abs(front) / 0.45) / (1 + np.abs(curve) * made.track / 2)  # slower in turns
    speed = np.clip(speed, -limit, limit)
    speed[np.abs(speed) < 0.01 * made.top] = 0.0
    return speed, curve, angle, hurry


def _smooth(x: Array, seconds: float) -> Array:
    """As a hand turns a wheel."""
    weights = np.hanning(round(seconds / STEP_S))
    return np.asarray(np.convolve(x, weights / weights.sum())[: x.size])


def asked(seed: int, duration: float) -> tuple[Array, dict[str, Array]]:
    """Time [s] and what is asked of every wheel [m/s] and axle [rad] where nothing fails."""
    ref = driven(seed, (), duration)[0][::10]
    return np.arange(len(ref)) * 10 * STEP_S, dict(zip((*WHEELS, *AXLES), ref.T, strict=True))


@lru_cache(maxsize=8)
def driven(seed: int, faults: tuple[FaultSpec, ...], duration: float, changed: str = "") -> tuple[Array, ...]:
    """The mission per millisecond; see `drive`."""
    (made, parts), rng = build(seed, changed), np.random.default_rng(93_000 + seed)
    speed, _, angle, hurry = commands(seed, duration)
    loss, sat = courses(faults, duration, seed, made.top)
    noise = rng.standard_normal((speed.size, 6)) * 3e-4
    noise[:, 4:] += rng.uniform(-0.004, 0.004, 2)  # how well the angles were set to zero
    teeth = rng.uniform(-0.5, 0.5, (4, 64))
    count = rng.integers(0, 60)
    slick = rng.random(count) < 0.3
    soft = rng.uniform(0.2, 0.8, count)
    patches = np.column_stack(
        [rng.uniform(-45.0, 45.0, (count, 2)), rng.uniform(0.8, 4.0, count), soft * ~slick, soft * slick]
    )
    warps = np.convolve(rng.standard_normal(400), np.hanning(60) / np.sqrt(22.0), "same") * rng.uniform(0.0, 0.12)
    heat = rng.uniform(0.25, 0.85) + rng.uniform(-0.05, 0.05, 4)
    return drive(speed, angle, hurry, loss, sat, noise, teeth, patches, warps, parts, heat, made)


def _rows(rng: np.random.Generator, n: int, rate: float, loses: float, shake: float) -> tuple[np.ndarray, np.ndarray]:
    """Milliseconds at which a recorder takes its rows, and their stamps [ns]: jitter, rows and whole spells that are lost."""
    every = 1000.0 / rate
    at = np.arange(0.0, n - 1, every)
    late = rng.exponential(0.4 * shake, at.size) + rng.uniform(-shake, shake, at.size)
    at = np.clip(at + 1 + late * every, 0, n - 1).astype(int)
    keep = rng.random(at.size) > loses
    for start in rng.integers(0, at.size, rng.integers(0, 4)):
        keep[start : start + int(rng.integers(3, 0.08 * rate + 5))] = False
    at = np.unique(at[keep])
    return at, _START_NS + at * 1_000_000 + rng.integers(0, 300_000, at.size)


def signals(seed: int, faults: Sequence[FaultSpec], duration: float, tier: str, changed: str = "") -> Signals:
    """A mission as a recorder has it; with ``spool`` currents and steering motors as well, with ``direct`` second speeds and angles too."""
    (made, parts), has = build(seed, changed), commands_of(seed)
    rng, noise = np.random.default_rng(94_000 + seed), np.random.default_rng(95_000 + seed)
    demand, curve, _, _ = commands(seed, duration)
    ref, _, read, second, given, done, body = driven(seed, tuple(faults), duration, changed)
    n, own = demand.size, 1000.0 / made.cycle / 0.5
    logger = recorder_of(seed) == "logger"
    rate, slow = (
        (float(rng.choice([100.0, 200.0, 250.0, 500.0])), float(rng.choice([50.0, 100.0]))) if logger else (own, own)
    )
    loses, shake = float(rng.choice([0.0, 0.002, 0.01])), 0.12 if logger else 0.0
    rates = {"drive": rate, "steer": slow, "cmd": 50.0, "imu": 100.0, "gnss": 5.0}
    rows = {group: _rows(rng, n, r, loses, shake) for group, r in rates.items()}
    columns: dict[str, tuple[str, Array]] = {}
    for i, w in enumerate(WHEELS):
        columns[f"wheel.{w}.v"], columns[f"wheel.{w}.u"] = ("drive", read[:, i]), ("drive", given[:, i])
        if has != "body":
            columns[f"wheel.{w}.v_ref"] = "drive", _bus(ref[:, i], made.quantum_v)
        current = done[:, i] * parts[i, 4] + parts[i, 5] + 0.004 * noise.standard_normal(n)
        if tier != "base":
            columns[f"wheel.{w}.u_applied"] = "drive", _bus(current, made.quantum_u)
        if tier == "direct":
            columns[f"wheel.{w}.v_true"] = "drive", _bus(second[:, i], 0.001)
    for a, axle in enumerate(AXLES, 4):
        columns[f"steer.{axle}.phi"], columns[f"steer.{axle}.phi_ref"] = ("steer", read[:, a]), ("steer", ref[:, a])
        columns[f"steer.{axle}.u"] = "steer", _bus(given[:, a], made.quantum_u)
        if tier != "base":
            columns[f"steer.{axle}.u_applied"] = "steer", _bus(done[:, a] + 0.003 * noise.standard_normal(n), 0.002)
        if tier == "direct":
            columns[f"steer.{axle}.phi_true"] = "steer", _bus(second[:, a] + 5e-4 * noise.standard_normal(n), 5e-4)
    if has != "wheels":
        after = rng.random() < 0.5  # the demand, or what the ramps make of it
        v = body[:, 3] if after else demand
        columns["cmd.v"], columns["cmd.omega"] = ("cmd", v), ("cmd", v * (body[:, 4] if after else curve))
    if rng.random() < 0.6:
        columns["imu.yaw_rate"] = "imu", body[:, 2] + noise.uniform(-0.002, 0.002) + 0.004 * noise.standard_normal(n)
    if rng.random() < 0.4:
        columns["gnss.speed"] = "gnss", np.abs(np.hypot(body[:, 0], body[:, 1]) + 0.02 * noise.standard_normal(n))
    items = {}
    for name, (group, values) in columns.items():
        at, stamps = rows[group]
        origin = SignalSource(topic=f"/{group}", field=name)
        items[name] = Signal(name, stamps, np.ascontiguousarray(values[at]), origin, NAME, guessed=False)
    return Signals(items, {}, (), (), open_loop=False)


def _bus(x: Array, quantum: float) -> Array:
    """As the bus rounds it."""
    return np.asarray(np.floor(x / quantum + 0.5) * quantum)
