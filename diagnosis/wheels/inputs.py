"""From a mission to what the wheel models need: channels of all wheels, their plants, and the geometry in motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.habit import Habit
from diagnosis.channels.liveness import alive
from diagnosis.channels.sample_status import sample_status
from diagnosis.estimation.lag import low_passed_on
from diagnosis.estimation.valve_map import effective
from diagnosis.results.wheel_model import WheelModelFit
from diagnosis.wheels.body import MeasuredBody
from diagnosis.wheels.identification import demand
from diagnosis.wheels.motion import MOST_AGAINST, Motion, against_command
from diagnosis.wheels.readings import SpeedNoise, habits_of, news, speed_noises
from diagnosis.wheels.wheel_channels import WheelChannels
from replay.arrays.column_store import ColumnStore
from replay.arrays.numeric import without_nan
from replay.control.loop import Replay, any_finite
from replay.machine.config import Machine, Noise, WheelPlant
from replay.signals.timeline import Timeline

Array = NDArray[np.float64]

_QUIET = 0.4
_STANDS = 0.02  # of the span


@dataclass(frozen=True)
class WheelsData:
    """All wheels of a machine; arrays are (n, wheels).

    Attributes
    ----------
    y, u : Array
        Measured speed [m/s] and valve opening [fraction], the second measurement where there is one.
    reference : Array
        Commanded speed [m/s]; NaN where there is none.
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
    body : MeasuredBody or None
        The body by its own sensors; None without any.
    store : ColumnStore
        Where long columns stand.
    """

    y: Array
    u: Array
    reference: Array
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
    body: MeasuredBody | None = None
    store: ColumnStore = field(default_factory=ColumnStore, repr=False)

    @cached_property
    def stands(self) -> NDArray[np.bool_]:
        """Where every wheel reads as if the machine stood, shape (n,)."""
        return np.asarray((np.abs(without_nan(self.y)) <= _STANDS * self.span).all(axis=1))

    @cached_property
    def speed_noises(self) -> list[SpeedNoise | None]:
        """Noise of each speed sensor where it depends on the speed."""
        return speed_noises(self.y, self.status, self.habits, self.dt)


def wheels_data(
    timeline: Timeline,
    replay: Replay,
    machine: Machine,
    channels: WheelChannels,
    fit: WheelModelFit,
    counts: dict[str, NDArray[np.int16]],
    motion: Motion,
    doubtful: NDArray[np.bool_],
    slip: NDArray[np.bool_],
    body: MeasuredBody | None = None,
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
    motion : Motion
        How wheels and body move together, by the best estimate of the axles' angles.
    doubtful : NDArray[np.bool_], shape (n, axles)
        Where that rests on a model or on a sensor in doubt.
    slip : NDArray[np.bool_], shape (n, wheels)
        Where a wheel breaks the parity of the body.
    body : MeasuredBody or None
        The body by its own sensors.
    """
    y, u, dt = channels.speed, channels.opening, timeline.dt
    given = [w in machine.unpowered or machine.plant.wheels.get(w) is not None for w in machine.wheels]
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
    return WheelsData(
        y=y,
        u=u,
        reference=_reference(timeline, replay.v_ref, channels),
        residual=residual,
        status=status,
        quiet=quiet,
        slip=slip,
        ratio=motion.ratio,
        turn=motion.turn,
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
        body=body,
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


def _reference(timeline: Timeline, v_ref: Array, channels: WheelChannels) -> Array:
    """Commanded speeds that say something of the wheels, shape (n, wheels); NaN elsewhere.

    Beside a second speed sensor the command says nothing, for the controller follows its own; nor does it where no wheel
    follows it.
    """
    ignored = against_command(channels.speed, v_ref) > MOST_AGAINST
    if not (channels.has_true.any() or ignored):
        return v_ref
    return timeline.map(lambda r: np.asarray(np.where(channels.has_true | ignored, np.nan, r)), v_ref)


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
