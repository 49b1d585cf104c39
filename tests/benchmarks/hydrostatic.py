"""A machine of other physics: pressures, a shared pump, spools of second order, proportional-integral laws; none of it is the simulator's.

Every wheel's motor turns by the difference of two pressures that its spool lets in; the pump holds its pressure only up to
its flow. The law on the machine is a feed-forward with a proportional and an integral part, not the paper's. Rates, masses,
valves, laws and sensors are drawn from the seed; faults are those of L16 (4) and (8) on measured speed and angle and on the
opening of the valves. For measuring only.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from hydrostatic_physics import Build, asked_of, drive, slow
from numpy.typing import NDArray

from replay.faults import FaultMode, FaultSpec
from replay.log.source_options import SignalSource
from replay.machine.config import Machine, Plant, haulotte
from replay.machine.geometry import four_wheel_geometry
from replay.signals.signal import Signal, Signals

Array = NDArray[np.float64]
NAME = "hydrostatic"
WHEELS, AXLES = ("FR", "FL", "RR", "RL"), ("front", "rear")
STEP_S = 0.001
BASE, TRACK, DIAMETER, OFFSET = 2.6, 1.7, 1.02, 0.12
_RADIUS = DIAMETER / 2
_X = np.array([BASE / 2, BASE / 2, -BASE / 2, -BASE / 2])
_Y = np.array([-TRACK / 2, TRACK / 2, -TRACK / 2, TRACK / 2])
_LATERAL = np.array([-OFFSET, OFFSET, -OFFSET, OFFSET])
_START_NS = 1_781_000_000_000_000_000


def build(seed: int, hunting: bool = False) -> Build:
    """The machine of a seed; `hunting`: with gains at which its speed law swings."""
    rng = np.random.default_rng(70_000 + seed)
    u = rng.uniform
    return Build(
        top=u(0.8, 1.4),
        rate=float(rng.choice([100.0, 200.0, 500.0])),
        mass=u(0.8, 1.6),
        stiffness=u(60.0, 160.0),
        leak=u(0.2, 1.5),
        friction=u(0.01, 0.06),
        pump=u(0.75, 1.3),
        spool=u(40.0, 90.0),
        damping=u(0.6, 0.9),
        dead_time=int(rng.integers(4, 20)),
        dead_band=u(0.0, 0.04),
        curve=u(0.0, 0.35),
        forward=u(0.8, 1.1),
        proportional=u(2.5, 4.0) if hunting else u(0.2, 0.8),
        integral=u(6.0, 12.0) if hunting else u(0.3, 1.5),
        noise=u(0.001, 0.006),
        quantum=float(rng.choice([0.0, 0.001, 0.004])),
        grip=u(0.6, 1.0),
        slope=float(rng.choice([0.0, 0.04, 0.08])),
        steer_rate=u(0.3, 0.7),
        steer_gain=u(3.0, 6.0),
    )


def machine_of(made: Build) -> Machine:
    """Its machine file: geometry and greatest speed, no constants of the plant."""
    return replace(
        haulotte(),
        name=NAME,
        geometry=four_wheel_geometry(BASE, TRACK, DIAMETER, OFFSET),
        max_speed=made.top,
        plant=Plant(),
        assumed=(),
    )


def commands(seed: int, duration: float, top: float) -> tuple[Array, Array]:
    """Speed [m/s] and yaw rate [rad/s] asked for, at every step: spells of driving with rests, ramps of an operator."""
    rng = np.random.default_rng(71_000 + seed)
    n = round(duration / STEP_S)
    speed, bend = np.zeros(n), np.zeros(n)
    at, sign = round(rng.uniform(1.0, 3.0) / STEP_S), 1.0
    while at < n:
        length, rest = round(rng.uniform(6.0, 16.0) / STEP_S), round(rng.uniform(1.0, 3.0) / STEP_S)
        speed[at : at + length] = sign * rng.uniform(0.25, 0.85) * top
        at += length + rest
        sign = -sign if rng.random() < 0.35 else sign
    at = 0
    while at < n:
        length = round(rng.uniform(3.0, 9.0) / STEP_S)
        bend[at : at + length] = rng.uniform(-0.18, 0.18) if rng.random() < 0.7 else 0.0
        at += length
    speed, bend = _smooth(speed, 0.9), _smooth(bend, 1.4)
    return speed, speed * bend


def _smooth(x: Array, seconds: float) -> Array:
    """As an operator does it: ramps of some length."""
    weights = np.hanning(round(seconds / STEP_S))
    return np.asarray(np.convolve(x, weights / weights.sum())[: x.size])


def courses(faults: Sequence[FaultSpec], duration: float, seed: int, top: float) -> tuple[Array, Array]:
    """ε and saturation term of speeds, angles, wheel valves, steering valves, shape (n, 12)."""
    rng = np.random.default_rng(72_000 + seed)
    n = round(duration / STEP_S)
    loss, sat = np.zeros((n, 12)), np.zeros((n, 12))
    for f in faults:
        wheel = f.component in WHEELS
        k = WHEELS.index(f.component) if wheel else 4 + AXLES.index(f.component)
        k += 0 if f.side.value == "sensor" else 6
        first, last = round(f.start_s / STEP_S), min(n, round(f.stop_s / STEP_S))
        t = np.arange(last - first) * STEP_S
        loss[first:last, k] = f.epsilon * (np.minimum(1.0, t / f.ramp_s) if f.ramp_s > 0 else 1.0)
        term = np.full(t.size, f.sat if f.mode is not FaultMode.NO_SIGNAL else 0.0)
        if f.sat_std > 0:
            white = rng.standard_normal(t.size)
            a = math.exp(-STEP_S / f.sat_tau_s) if f.sat_tau_s > 0 else 0.0
            term = term + f.sat_std * slow(white, a)
        if wheel and f.side.value == "sensor":
            term = term * top / 0.36  # sizes are meant for the paper's machine
        sat[first:last, k] = term
    return loss, sat


def asked(seed: int, duration: float) -> tuple[Array, dict[str, Array]]:
    """Time [s] and what is asked of every wheel [m/s] and axle [rad]."""
    v_c, w_c = commands(seed, duration, build(seed).top)
    v_c, w_c = v_c[::10], w_c[::10]
    out, speeds, angles = np.zeros((v_c.size, 6)), np.zeros(4), np.zeros(2)
    for k in range(v_c.size):
        asked_of(v_c[k], w_c[k], speeds, angles, _X, _Y, _LATERAL)
        out[k] = (*speeds, *angles)
    return np.arange(v_c.size) * 10 * STEP_S, dict(zip((*WHEELS, *AXLES), out.T, strict=True))


def signals(seed: int, faults: Sequence[FaultSpec], duration: float, tier: str, hunting: bool = False) -> Signals:
    """A mission as a recorder has it: commands, speeds, angles; with ``spool`` openings, with ``direct`` second speeds as well."""
    made, rng = build(seed, hunting), np.random.default_rng(73_000 + seed)
    v_c, w_c = commands(seed, duration, made.top)
    loss, sat = courses(_held(seed, faults, duration, hunting), duration, seed, made.top)
    n = v_c.size
    noise = rng.standard_normal((n, 6)) * np.array([made.noise] * 4 + [0.0008] * 2)
    slip = np.ones((n, 4))
    for i in range(4):
        for at in rng.uniform(0, n, rng.integers(0, 4)).astype(int):
            slip[at : at + round(rng.uniform(0.2, 1.2) / STEP_S), i] = rng.uniform(0.1, 0.5)
    true, read, asked, opened, body = drive(v_c, w_c, loss, sat, noise, slip, made, _X, _Y, _LATERAL)
    every, slow = round(1.0 / made.rate / STEP_S), 100
    columns: dict[str, tuple[Array, int]] = {"cmd.v": (v_c, 10), "cmd.omega": (w_c, 10)}
    for i, w in enumerate(WHEELS):
        columns[f"wheel.{w}.v"], columns[f"wheel.{w}.u"] = (read[:, i], every), (asked[:, i], every)
        if tier != "base":
            columns[f"wheel.{w}.u_applied"] = opened[:, i] + 0.002 * rng.standard_normal(n), every
        if tier == "direct":
            columns[f"wheel.{w}.v_true"] = true[:, i] + 0.003 * rng.standard_normal(n), every
    for a, axle in enumerate(AXLES):
        columns[f"steer.{axle}.phi"], columns[f"steer.{axle}.u"] = (read[:, 4 + a], every), (asked[:, 4 + a], every)
        if tier == "direct":
            columns[f"steer.{axle}.u_applied"] = opened[:, 4 + a] + 0.002 * rng.standard_normal(n), every
    columns["gnss.speed"] = np.abs(body[:, 0] + 0.02 * rng.standard_normal(n)), slow
    columns["imu.yaw_rate"] = body[:, 1] + 0.004 * rng.standard_normal(n), 10
    items = {}
    for name, (values, step) in columns.items():
        stamps = _START_NS + np.arange(0, n, step, dtype=np.int64) * 1_000_000
        kind = name.split(".")
        origin = SignalSource(topic=f"/{kind[0]}/{kind[-1]}", field=name)
        items[name] = Signal(name, stamps, np.ascontiguousarray(values[::step]), origin, NAME, guessed=False)
    return Signals(items, {}, (), (), open_loop=False)


def _held(seed: int, faults: Sequence[FaultSpec], duration: float, hunting: bool) -> list[FaultSpec]:
    """Faults with their saturation terms known: a sensor that holds its value (NaN) holds what it showed at its onset."""
    if not any(math.isnan(f.sat) for f in faults):
        return list(faults)
    plain = [f for f in faults if not math.isnan(f.sat)]
    calm = signals(seed, plain, duration, "base", hunting)
    top, out = build(seed, hunting).top, list(plain)
    for f in faults:
        if not math.isnan(f.sat):
            continue
        wheel = f.component in WHEELS
        one = calm.items[f"wheel.{f.component}.v" if wheel else f"steer.{f.component}.phi"]
        at = float(np.interp(f.start_s, (one.stamps - _START_NS) * 1e-9, one.values))
        out.append(replace(f, sat=at * 0.36 / top if wheel else at))
    return out
