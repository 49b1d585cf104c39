"""From a mission to what the wheel models need: channels of all wheels, their plants, and the geometry in motion."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.habit import Habit
from diagnosis.channels.liveness import alive
from diagnosis.channels.sample_status import sample_status
from diagnosis.estimation.lag import low_passed_on
from diagnosis.results.wheel_model import WheelModelFit
from diagnosis.wheels.blocks import block_width
from diagnosis.wheels.identification import demand, identified, identify
from diagnosis.wheels.parity import slipping
from diagnosis.wheels.plant_identification import Drive
from diagnosis.wheels.readings import SpeedNoise, habits_of, news, speed_noises
from diagnosis.wheels.valve_map import effective
from replay.arrays.blocks import release
from replay.arrays.column_store import ColumnStore
from replay.arrays.numeric import without_nan
from replay.control.kinematics import low_pass, speed_ratios, wheel_angles
from replay.control.loop import Replay, any_finite, stack
from replay.machine.config import Machine, Noise, WheelPlant
from replay.signals.timeline import Timeline

Array = NDArray[np.float64]

_QUIET = 0.4
_STEER_HZ = 3.0


@dataclass(frozen=True)
class WheelChannels:
    """Speeds and openings of all wheels, shape (n, wheels), and which of them are measured by two instruments (wheels,)."""

    v: Array
    u: Array
    true: Array
    applied: Array
    store: ColumnStore = field(default_factory=ColumnStore, repr=False)

    def without_speed(self, wheels: Sequence[int]) -> WheelChannels:
        """The same with the measured speeds of some wheels left out."""
        v = np.array(self.v)
        v[:, wheels] = np.nan
        return replace(self, v=v)

    @cached_property
    def has_true(self) -> NDArray[np.bool_]:
        """Wheels with a second speed."""
        return any_finite(self.true)

    @cached_property
    def has_applied(self) -> NDArray[np.bool_]:
        """Wheels whose opening is measured."""
        return any_finite(self.applied)

    def names(self, wheels: Sequence[str]) -> list[tuple[str, str]]:
        """Names of the better speed and opening of each wheel."""
        return [
            (f"wheel.{w}.{'v_true' if true else 'v'}", f"wheel.{w}.{'u_applied' if applied else 'u'}")
            for w, true, applied in zip(wheels, self.has_true, self.has_applied, strict=True)
        ]

    @cached_property
    def speed(self) -> Array:
        """The better speed of each wheel [m/s]."""
        if not self.has_true.any():
            return self.v
        return self.store.map(lambda true, v: np.asarray(np.where(self.has_true, true, v)), self.true, self.v)

    @cached_property
    def opening(self) -> Array:
        """The better opening of each wheel [fraction]."""
        if not self.has_applied.any():
            return self.u
        return self.store.map(
            lambda applied, u: np.asarray(np.where(self.has_applied, applied, u)), self.applied, self.u
        )


@dataclass(frozen=True)
class WheelsData:
    """All wheels of a machine; arrays are (n, wheels).

    Attributes
    ----------
    y, u : Array
        Measured speed [m/s] and valve opening [fraction], the second measurement where there is one.
    residual : Sequence[Array], each of shape (n,)
        y − K·lowpass(u) of each wheel [m/s], NaN where the pump cannot feed it.
    status : NDArray[np.int8]
        As in `diagnosis.channels.sample_status`.
    quiet, slip : NDArray[np.bool_]
        Where a wheel is neither commanded nor moving, and where it breaks the parity of the body.
    ratio, turn : Array
        As in `WheelBlocks`; NaN without geometry.
    measured : Sequence[bool]
        Whether a wheel's opening is the measured one, so that its valve is judged elsewhere.
    plants : Sequence[WheelPlant | None]
        Wheel models; None where a wheel cannot be judged.
    noise : Sequence[Noise]
        Known noise of the speeds.
    names : Sequence[tuple[str, str]]
        Names of speed and opening.
    span, flow : float
        Largest plausible speed and what the pump feeds, as a sum of speeds [m/s].
    coupling : str
        ``auto``, ``free`` or ``ground``.
    habits : Sequence[Habit]
        How each speed sensor is updated.
    dt : float
        Step [s].
    misfit : float
        What the plants leave of the speed in the windows that agree best [1].
    doubtful : NDArray[np.bool_], shape (n, axles)
        Where a steering angle is in doubt.
    store : ColumnStore
        Where long columns stand.
    """

    y: Array
    u: Array
    residual: Sequence[Array]
    status: NDArray[np.int8]
    quiet: NDArray[np.bool_]
    slip: NDArray[np.bool_]
    ratio: Array
    turn: Array
    measured: Sequence[bool]
    plants: Sequence[WheelPlant | None]
    noise: Sequence[Noise]
    names: Sequence[tuple[str, str]]
    span: float
    flow: float
    coupling: str
    habits: Sequence[Habit]
    dt: float
    misfit: float
    doubtful: NDArray[np.bool_]
    store: ColumnStore = field(default_factory=ColumnStore, repr=False)

    @cached_property
    def speed_noises(self) -> list[SpeedNoise | None]:
        """Noise of each speed sensor where it depends on the speed."""
        return speed_noises(self.y, self.status, self.habits, self.dt)


def wheel_channels(timeline: Timeline, machine: Machine) -> WheelChannels:
    """Channels of all wheels; NaN where a wheel lacks one."""
    v, u, true, applied = (
        stack(timeline, [f"wheel.{w}.{x}" for w in machine.wheels]) for x in ("v", "u", "v_true", "u_applied")
    )
    return WheelChannels(v, u, true, applied, timeline.store)


def wheel_fit(
    channels: WheelChannels, replay: Replay, timeline: Timeline, machine: Machine, angle: Array
) -> WheelModelFit | None:
    """Wheel models of the machine file, or identified in this mission; None where nothing allows it.

    Parameters
    ----------
    channels, replay, timeline, machine
        The mission.
    angle : Array, shape (n, axles)
        Best estimate of the axles' angles [rad].
    """
    if not (any_finite(channels.opening).any() and any_finite(channels.speed).any()):
        return None
    given = {i: p for i, w in enumerate(machine.wheels) if (p := machine.plant.wheels.get(w)) is not None}
    if len(given) < len(machine.wheels):
        found = identified(wheel_drive(channels, replay, timeline, machine, angle), machine, given)
        if found is not None:
            return found
    width = min(block_width(timeline.dt), timeline.size)
    limit = machine.limits.driving_speed

    def mean(function: Callable[..., NDArray[Any]], *columns: Array) -> Array:
        out = []
        for part in timeline.store.blocks(timeline.size // width * width, width):
            x = np.asarray(function(*(c[part] for c in columns)), np.float64)
            out.append(x.reshape(-1, width, x.shape[1]).mean(axis=1))
            release(*columns)
        return np.concatenate(out)

    moving = mean(lambda ref, v: np.abs(np.where(np.isfinite(ref), ref, v)) > limit, replay.v_ref, channels.speed)
    return identify(
        mean(np.asarray, channels.speed),
        mean(np.asarray, channels.opening),
        np.asarray(moving > 0.5),
        timeline.dt * width,
        given,
        machine.plant.flow,
        mean(lambda u: np.abs(without_nan(u)), channels.opening),
    )


def wheel_drive(channels: WheelChannels, replay: Replay, timeline: Timeline, machine: Machine, angle: Array) -> Drive:
    """Block means of all wheels for `diagnosis.wheels.plant_identification`; parameters as in `wheel_fit`."""
    width = min(block_width(timeline.dt), timeline.size)
    limit = machine.limits.driving_speed
    ratio, turn = _in_motion(angle, machine, timeline)

    def mean(function: Callable[..., NDArray[Any]], *columns: Array) -> Array:
        out = []
        for part in timeline.store.blocks(timeline.size // width * width, width):
            x = np.asarray(function(*(c[part] for c in columns)), np.float64)
            out.append(x.reshape(-1, width, x.shape[1]).mean(axis=1))
            release(*columns)
        return np.concatenate(out)

    moving = mean(lambda ref, v: np.abs(np.where(np.isfinite(ref), ref, v)) > limit, replay.v_ref, channels.speed)
    y = mean(np.asarray, channels.speed)
    return Drive(
        y=y,
        u=mean(np.asarray, channels.opening),
        body=body_speeds(y, mean(np.asarray, ratio), mean(np.asarray, turn)),
        moving=np.asarray(moving > 0.5),
        dt=timeline.dt * width,
    )


def body_speeds(y: Array, ratio: Array, turn: Array) -> Array:
    """Speed at which each wheel would roll by the median of the other wheels [m/s], shape (n, wheels)."""
    with np.errstate(invalid="ignore", divide="ignore"):
        speed = (y + turn) / ratio
    out = np.full(y.shape, np.nan)
    for i in range(y.shape[1]):
        others = np.delete(speed, i, axis=1)
        known = np.isfinite(others).all(axis=1)
        if others.shape[1] and known.any():
            out[known, i] = np.median(others[known], axis=1) * ratio[known, i] - turn[known, i]
    return out


def slip_of(
    timeline: Timeline, replay: Replay, machine: Machine, v: Array, angle: Array, doubtful: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Where a wheel breaks the parity of the body; nowhere without geometry, or where an axle's angle is in doubt."""
    geometry = machine.geometry
    if geometry is None or v.shape[1] < 4 or not any_finite(v).all() or not any_finite(angle).all():
        return np.zeros(v.shape, dtype=np.bool_)
    least = 2.5 * machine.limits.min_sat
    turned = timeline.map(lambda a: wheel_angles(a, geometry), angle)
    slip = slipping(v, angle, replay.phi_ref, turned, geometry, timeline.dt, least, timeline.store)
    return timeline.map(lambda s, d: s & ~d.any(axis=1)[:, None], slip, doubtful)


def wheels_data(
    timeline: Timeline,
    replay: Replay,
    machine: Machine,
    channels: WheelChannels,
    fit: WheelModelFit,
    counts: dict[str, NDArray[np.int16]],
    angle: Array,
    doubtful: NDArray[np.bool_],
    slip: NDArray[np.bool_],
) -> WheelsData:
    """Channels for the wheel models.

    Parameters
    ----------
    timeline, replay, machine
        The aligned mission, the replayed loop and the machine.
    channels, fit
        Speeds and openings of all wheels, and their models.
    counts : dict[str, NDArray[np.int16]]
        From `diagnosis.channels.liveness.alive_sources`.
    angle : Array, shape (n, axles)
        Best estimate of the axles' angles [rad].
    doubtful : NDArray[np.bool_], shape (n, axles)
        Where it rests on a model or on a sensor in doubt.
    slip : NDArray[np.bool_], shape (n, wheels)
        Where a wheel breaks the parity of the body.
    """
    y, u, dt = channels.speed, channels.opening, timeline.dt
    given = [machine.plant.wheels.get(w) is not None for w in machine.wheels]
    names = channels.names(machine.wheels)
    status = np.zeros(y.shape, dtype=np.int8)
    quiet = np.ones(y.shape, dtype=np.bool_)
    residual: list[Array] = [np.broadcast_to(np.nan, (timeline.size,))] * len(names)
    has = any_finite(y) & any_finite(u)
    plants = [plant if has[i] else None for i, plant in enumerate(fit.plants)]
    starved = _starved(fit, u, machine.plant.flow, timeline)
    limit = _QUIET * machine.limits.driving_speed
    for i, (plant, (speed, _)) in enumerate(zip(plants, names, strict=True)):
        if plant is None:
            continue
        status[:, i] = sample_status(y[:, i], u[:, i], timeline.fresh[speed], alive(timeline, counts, speed), dt)
        apart, quiet[:, i] = _apart(y[:, i], u[:, i], replay.v_ref[:, i], plant, limit, timeline)
        residual[i] = timeline.map(lambda s, r: np.where(s, np.nan, r), starved, apart)
    fresh = [timeline.fresh.get(speed, np.zeros(timeline.size, dtype=np.bool_)) for speed, _ in names]
    habits = habits_of(y, fresh, dt)
    status = news(status, y, habits, dt)
    ratio, turn = _in_motion(angle, machine, timeline)
    return WheelsData(
        y=y,
        u=u,
        residual=residual,
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
        habits=habits,
        dt=dt,
        misfit=fit.spread if not all(given) else max(_share(p, machine.max_speed) for p in fit.plants),
        doubtful=doubtful,
        store=timeline.store,
    )


def _share(plant: WheelPlant | None, top: float) -> float:
    """Load of a wheel as its tyre passes it on, as a share of the top speed."""
    return 0.0 if plant is None else (plant.load or 0.0) / (1.0 + (plant.grip or 0.0)) / top


def _apart(
    y: Array, u: Array, v_ref: Array, plant: WheelPlant, limit: float, timeline: Timeline
) -> tuple[Array, NDArray[np.bool_]]:
    """Speed beyond what the opening drives [m/s], and where the wheel is neither commanded nor driven."""

    def apart(
        state: tuple[float | None, float | None], y: Array, u: Array, v_ref: Array
    ) -> tuple[tuple[Array, NDArray[np.bool_]], tuple[float | None, float | None]]:
        """The state is the lagged opening [fraction], and where the spool stands."""
        lagged, held = state
        beyond, _, held = effective(u, plant, held)
        asked = np.abs(plant.K * beyond)
        quiet = (np.abs(without_nan(v_ref)) < limit) & (asked < limit)
        driven, lagged = low_passed_on(beyond, plant.tau, timeline.dt, lagged)
        return (y - plant.K * driven - plant.offset, quiet), (lagged, held)

    start: tuple[float | None, float | None] = (None, None)
    (residual, quiet), _ = timeline.scan(apart, start, y, u, v_ref)
    return residual, quiet


def _starved(fit: WheelModelFit, u: Array, flow: float | None, timeline: Timeline) -> NDArray[np.bool_]:
    """Where the pump cannot feed what the valves ask for, or could not within the last three lags; shape (n,)."""
    if flow is None or not any(fit.plants):
        return np.zeros(u.shape[0], dtype=np.bool_)
    longest = 3 * max(p.tau for p in fit.plants if p is not None) / timeline.dt

    def starved(last: int, u: Array) -> tuple[tuple[NDArray[np.bool_]], int]:
        """`last` is the last step that asked for too much, counted from the first of these."""
        steps = np.arange(len(u))
        asked = demand(np.abs(without_nan(u)), fit) > flow
        near = np.maximum.accumulate(np.where(asked, steps, last))
        return (steps - near <= longest,), int(near[-1]) - len(u)

    (out,), _ = timeline.scan(starved, -(10**9), u)
    return out


def _in_motion(angle: Array, machine: Machine, timeline: Timeline) -> tuple[Array, Array]:
    """Wheel speed per speed of the body [1], and what each wheel rolls less because it steers [m/s]."""
    wheels = len(machine.wheels)
    geometry = machine.geometry
    if geometry is None or not any_finite(angle).all():
        return np.broadcast_to(np.nan, (timeline.size, wheels)), np.broadcast_to(0.0, (timeline.size, wheels))
    offset, dt = np.array([w.offset for w in geometry.wheels.values()]), timeline.dt

    def turning(state: tuple[Array, list[float]], angle: Array) -> tuple[tuple[Array], tuple[Array, list[float]]]:
        """The state is the wheels' last angles [rad] and their low-passed rates [rad/s]."""
        before, rates = state
        turned = wheel_angles(angle, geometry)
        rate = np.diff(turned, axis=0, prepend=before) / dt
        smooth = np.stack([low_pass(rate[:, i], dt, _STEER_HZ, rates[i]) for i in range(wheels)], axis=1)
        return (smooth * offset,), (turned[-1:], [float(x) for x in smooth[-1]])

    (turn,), _ = timeline.scan(turning, (wheel_angles(angle[:1], geometry), [np.nan] * wheels), angle)
    return timeline.map(lambda a: speed_ratios(a, geometry), angle), turn
