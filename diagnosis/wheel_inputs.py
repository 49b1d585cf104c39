"""From a mission to what the wheel models need: channels of all wheels, their plants, and the geometry in motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels import alive
from diagnosis.model_based import WheelsData
from diagnosis.pairs import sample_status
from diagnosis.parity import slipping
from diagnosis.wheel_blocks import block_width
from diagnosis.wheel_model import WheelModelFit, demand, identify, low_passed
from replay.kinematics import low_pass, speed_ratios, wheel_angles
from replay.loop import Replay, stack
from replay.machine import Machine, Noise, WheelPlant
from replay.timeline import Timeline

Array = NDArray[np.float64]

_QUIET = 0.4
_STEER_HZ = 3.0


@dataclass(frozen=True)
class WheelChannels:
    """Speeds and openings of all wheels, shape (n, wheels), and which of them are measured twice (wheels,)."""

    v: Array
    u: Array
    true: Array
    applied: Array

    @property
    def has_true(self) -> NDArray[np.bool_]:
        """Wheels with a second speed."""
        return np.asarray(np.isfinite(self.true).any(axis=0))

    @property
    def has_applied(self) -> NDArray[np.bool_]:
        """Wheels whose opening is measured."""
        return np.asarray(np.isfinite(self.applied).any(axis=0))

    @property
    def speed(self) -> Array:
        """The better speed of each wheel [m/s]."""
        return np.where(self.has_true, self.true, self.v)

    @property
    def opening(self) -> Array:
        """The better opening of each wheel [fraction]."""
        return np.where(self.has_applied, self.applied, self.u)


def wheel_channels(timeline: Timeline, machine: Machine) -> WheelChannels:
    """Channels of all wheels; NaN where a wheel lacks one."""
    return WheelChannels(
        *(stack(timeline, [f"wheel.{w}.{x}" for w in machine.wheels]) for x in ("v", "u", "v_true", "u_applied"))
    )


def wheel_fit(channels: WheelChannels, replay: Replay, timeline: Timeline, machine: Machine) -> WheelModelFit | None:
    """Wheel models of the machine file, or identified in this mission; None where nothing allows it."""
    if not (np.isfinite(channels.opening).any() and np.isfinite(channels.speed).any()):
        return None
    given = {i: p for i, w in enumerate(machine.wheels) if (p := machine.plant.wheels.get(w)) is not None}
    moving = np.abs(np.where(np.isfinite(replay.v_ref), replay.v_ref, channels.speed)) > machine.limits.driving_speed
    width = min(block_width(timeline.dt), timeline.size)
    n = timeline.size // width

    def mean(x: Array) -> Array:
        return np.asarray(x[: n * width].reshape(n, width, x.shape[1]).mean(axis=1))

    return identify(
        mean(channels.speed),
        mean(channels.opening),
        np.asarray(mean(moving.astype(np.float64)) > 0.5),
        timeline.dt * width,
        given,
        machine.plant.flow,
        mean(np.abs(np.nan_to_num(channels.opening))),
    )


def slip_of(
    timeline: Timeline, replay: Replay, machine: Machine, v: Array, angle: Array, doubtful: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Where a wheel breaks the parity of the body; nowhere without geometry, or where an axle's angle is in doubt."""
    geometry = machine.geometry
    if (
        geometry is None
        or v.shape[1] < 4
        or not np.isfinite(v).any(axis=0).all()
        or not np.isfinite(angle).any(axis=0).all()
    ):
        return np.zeros(v.shape, dtype=np.bool_)
    least = 2.5 * machine.limits.min_sat
    slip = slipping(v, angle, replay.phi_ref, wheel_angles(angle, geometry), geometry, timeline.dt, least)
    return np.asarray(slip & ~np.asarray(doubtful.any(axis=1))[:, None])


def wheels_data(
    timeline: Timeline,
    replay: Replay,
    machine: Machine,
    channels: WheelChannels,
    fit: WheelModelFit,
    counts: dict[str, NDArray[np.int16]],
    angle: Array,
    slip: NDArray[np.bool_],
) -> tuple[WheelsData, Array]:
    """Channels for the wheel models, and y − K·lowpass(u) [m/s] where the pump feeds it, shape (n, wheels).

    Parameters
    ----------
    angle : Array, shape (n, axles)
        Best estimate of the axles' angles [rad].
    slip : NDArray[np.bool_], shape (n, wheels)
        Where a wheel breaks the parity of the body.
    """
    size, wheels, dt = timeline.size, len(machine.wheels), timeline.dt
    y, u = channels.speed, channels.opening
    status = np.zeros((size, wheels), dtype=np.int8)
    quiet = np.ones((size, wheels), dtype=np.bool_)
    residual = np.full((size, wheels), np.nan)
    names: list[tuple[str, str]] = []
    plants: list[WheelPlant | None] = []
    limit = _QUIET * machine.limits.driving_speed
    for i, wheel in enumerate(machine.wheels):
        speed = f"wheel.{wheel}.{'v_true' if channels.has_true[i] else 'v'}"
        opening = f"wheel.{wheel}.{'u_applied' if channels.has_applied[i] else 'u'}"
        names.append((speed, opening))
        plant = fit.plants[i]
        if plant is None or not np.isfinite(y[:, i]).any() or not np.isfinite(u[:, i]).any():
            plants.append(None)
            continue
        plants.append(plant)
        status[:, i] = sample_status(y[:, i], u[:, i], timeline.fresh[speed], alive(timeline, counts, speed), dt)
        beyond = np.sign(u[:, i]) * np.maximum(np.abs(u[:, i]) - plant.dead, 0.0)
        asked = np.abs(plant.K * np.nan_to_num(beyond))
        quiet[:, i] = (np.abs(np.nan_to_num(replay.v_ref[:, i])) < limit) & (asked < limit)
        residual[:, i] = y[:, i] - plant.K * low_passed(beyond, plant.tau, dt) - plant.offset
    residual[_starved(fit, u, machine.plant.flow, dt)] = np.nan
    ratio, turn = _in_motion(angle, machine, size, dt)
    return (
        WheelsData(
            y=y,
            u=u,
            status=status,
            quiet=quiet,
            slip=slip,
            ratio=ratio,
            turn=turn,
            measured=[bool(x) for x in channels.has_applied],
            plants=plants,
            noise=[machine.noise.get(speed, Noise()) for speed, _ in names],
            names=names,
            span=2.2 * machine.max_speed,
            flow=machine.plant.flow or 1e9,
            coupling=machine.plant.coupling,
            dt=dt,
        ),
        residual,
    )


def _starved(fit: WheelModelFit, u: Array, flow: float | None, dt: float) -> NDArray[np.bool_]:
    """Where the pump cannot feed what the valves ask for, or could not within the last three lags; shape (n,)."""
    if flow is None or not any(fit.plants):
        return np.zeros(u.shape[0], dtype=np.bool_)
    asked = demand(np.abs(np.nan_to_num(u)), fit) > flow
    last = np.maximum.accumulate(np.where(asked, np.arange(asked.size), -(10**9)))
    lag = max(p.tau for p in fit.plants if p is not None)
    return np.asarray(np.arange(asked.size) - last <= 3 * lag / dt)


def _in_motion(angle: Array, machine: Machine, size: int, dt: float) -> tuple[Array, Array]:
    """Wheel speed per speed of the body [1], and what each wheel rolls less because it steers [m/s]."""
    wheels = len(machine.wheels)
    geometry = machine.geometry
    if geometry is None or not np.isfinite(angle).any(axis=0).all():
        return np.full((size, wheels), np.nan), np.zeros((size, wheels))
    ratio = speed_ratios(angle, geometry)
    turned = wheel_angles(angle, geometry)
    turn = np.zeros((size, wheels))
    for i, wheel in enumerate(geometry.wheels.values()):
        rate = np.diff(turned[:, i], prepend=turned[:1, i]) / dt
        turn[:, i] = low_pass(rate, dt, _STEER_HZ) * wheel.offset
    return ratio, turn
