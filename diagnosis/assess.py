"""For every component and side: which evidence the log offers, and the assessment by the best of it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.frozen import frozen_sensor, frozen_speeds
from diagnosis.channels.liveness import alive_sources
from diagnosis.direct.assess import assess_pair
from diagnosis.direct.inputs import Pair, make_pair
from diagnosis.drives.assess import assess_drive
from diagnosis.drives.inputs import drive_data
from diagnosis.drives.tracking import assess_tracking
from diagnosis.results.assessment import Assessment, unassessed
from diagnosis.steering.assess import assess_steering
from diagnosis.wheels.assess import assess_wheels
from diagnosis.wheels.identification import WheelModelFit, low_passed
from diagnosis.wheels.inputs import slip_of, wheel_channels, wheel_fit, wheels_data
from replay.arrays.numeric import without_nan
from replay.control.loop import Replay
from replay.faults import Side, State
from replay.machine.config import Machine
from replay.progress import Progress, Stage, Subscriber
from replay.signals.timeline import Timeline

Array = NDArray[np.float64]
Key = tuple[str, str]

_QUIET = 0.4


@dataclass(frozen=True)
class ComponentResult:
    """Assessments by (component, side), and the wheel model that stood behind them."""

    assessments: dict[Key, Assessment]
    wheel_model: WheelModelFit | None


def assess_components(
    timeline: Timeline, replay: Replay, machine: Machine, wheels: tuple[str, ...], progress: Subscriber
) -> ComponentResult:
    """Judge wheels and steering axles by the best evidence there is.

    Parameters
    ----------
    timeline, replay, machine
        The aligned mission, the replayed loop and the machine.
    wheels : tuple[str, ...]
        Wheels to judge; the others only help.
    progress : Subscriber
        Called at the beginning of each stage.
    """
    counts = alive_sources(timeline)
    steering = assess_steering(timeline, replay, machine, counts, progress)
    channels = wheel_channels(timeline, machine)
    frozen = frozen_speeds(channels.v, replay.v_ref, machine.limits.driving_speed, timeline.dt)
    frozen = {i: value for i, value in frozen.items() if not channels.has_true[i]}
    measured = channels.v
    if frozen:
        channels = channels.without_speed(list(frozen))
    fit: WheelModelFit | None = None
    models: dict[int, tuple[Assessment, Assessment]] = {}
    if len(machine.wheels) > 1 and not (channels.has_true & channels.has_applied).all():
        progress(Progress(Stage.IDENTIFYING_WHEELS))
        fit = wheel_fit(channels, replay, timeline, machine)
    if fit is not None:
        progress(Progress(Stage.JUDGING_WHEELS))
        slip = slip_of(timeline, replay, machine, channels.v, steering.angle, steering.doubtful)
        data = wheels_data(timeline, replay, machine, channels, fit, counts, steering.angle, slip)
        models = assess_wheels(data, machine.limits, gains=fit.reliable)
    out: dict[Key, Assessment] = {}
    for i, wheel in enumerate(machine.wheels):
        if wheel not in wheels:
            continue
        progress(Progress(Stage.JUDGING_WHEEL, wheel))
        one = _Wheel(timeline, replay, machine, i, counts)
        if i in frozen:
            alive_ones = np.delete(measured, list(frozen), axis=1)
            out[wheel, "sensor"] = frozen_sensor(measured[:, i], frozen[i], alive_ones, one.name("v"), timeline.dt)
            out[wheel, "actuator"] = one.behind_dead_sensor(bool(channels.has_applied[i]))
            continue
        model = models.get(i)
        has_true, has_applied = bool(channels.has_true[i]), bool(channels.has_applied[i])
        if model is None and not has_true and np.isfinite(channels.v[:, i]).any():
            model = one.alone()
        out[wheel, "sensor"] = one.sensor(has_true, model)
        out[wheel, "actuator"] = one.actuator(has_applied, model)
    for axle in machine.axles:
        for side in ("sensor", "actuator"):
            out[axle, side] = steering.assessments[axle, side]
    return ComponentResult(out, fit)


@dataclass(frozen=True)
class _Wheel:
    """One wheel's channels, ready for the assessors."""

    timeline: Timeline
    replay: Replay
    machine: Machine
    index: int
    counts: dict[str, NDArray[np.int16]]

    def name(self, leaf: str) -> str:
        return f"wheel.{self.machine.wheels[self.index]}.{leaf}"

    def values(self, leaf: str) -> Array:
        found = self.timeline.get(self.name(leaf))
        return np.broadcast_to(np.nan, (self.timeline.size,)) if found is None else found

    def quiet(self, expected: Array) -> NDArray[np.bool_]:
        """Neither commanded nor expected to move."""
        limit = _QUIET * self.machine.limits.driving_speed

        def low(command: Array, speed: Array) -> NDArray[np.bool_]:
            return np.asarray((np.abs(without_nan(command)) < limit) & (np.abs(without_nan(speed)) < limit))

        return self.timeline.map(low, self.replay.v_ref[:, self.index], expected)

    def span(self, leaf: str) -> float:
        if leaf in ("u", "u_applied"):
            return max(self.machine.control.u_max, 1e-6)
        return 2.2 * self.machine.max_speed

    def pair(self, side: Side, y: str, x: str, quiet: NDArray[np.bool_], unit: str) -> Pair:
        return make_pair(
            self.timeline, self.counts, side, self.name(y), self.name(x), quiet, unit, self.span(y), self.machine
        )

    def instruments(self) -> Array | None:
        """The commanded speed and two lags of it: what moves the wheel and knows nothing of its sensor."""
        command = self.replay.v_ref[:, self.index]
        if not np.isfinite(command).any():
            return None
        store, dt = self.timeline.store, self.timeline.dt
        return store.beside([command, *(store.keep(low_passed(command, lag, dt)) for lag in (0.1, 0.3))])

    def sensor(self, direct: bool, model: tuple[Assessment, Assessment] | None) -> Assessment:
        size = self.timeline.size
        if not np.isfinite(self.values("v")).any():
            return unassessed(size, State.NO_DATA, "the wheel's speed is not in the log")
        if direct:
            pair = self.pair(Side.SENSOR, "v", "v_true", self.quiet(self.values("v_true")), "m/s")
            return assess_pair(replace(pair, instruments=self.instruments()), self.machine.limits)
        if model is not None:
            return model[0]
        return unassessed(
            size, State.NOT_ASSESSED, "neither a valve command, a second speed nor a commanded speed is in the log"
        )

    def actuator(self, direct: bool, model: tuple[Assessment, Assessment] | None) -> Assessment:
        size = self.timeline.size
        if direct and np.isfinite(self.values("u")).any():
            least = 0.02 * self.span("u")
            idle = self.timeline.map(lambda u: np.abs(without_nan(u)) < least, self.values("u"))
            return assess_pair(self.pair(Side.ACTUATOR, "u_applied", "u", idle, "of full opening"), self.machine.limits)
        if direct:
            return unassessed(size, State.NOT_ASSESSED, "the valve's position is logged but not its command")
        if model is not None:
            return model[1]
        if np.isfinite(self.values("u")).any():
            return unassessed(size, State.NOT_ASSESSED, "the valve's command is logged, but no speed that answers it")
        return unassessed(size, State.NO_DATA, "the wheel's valve command is not in the log")

    def behind_dead_sensor(self, direct: bool) -> Assessment:
        """The valve of a wheel whose speed sensor is dead all the time."""
        if direct:
            return self.actuator(True, None)
        return unassessed(self.timeline.size, State.MASKED, "the speed sensor is dead for the whole mission")

    def alone(self) -> tuple[Assessment, Assessment] | None:
        """Judge a drive without a body: by its effort, or by whether it follows its command."""
        wheel, command = self.machine.wheels[self.index], self.replay.v_ref[:, self.index]
        if not np.isfinite(command).any():
            return None
        drive = drive_data(self.timeline, command, self.machine, wheel, self.counts)
        if drive is not None:
            if self.machine.geometry is not None and wheel not in self.machine.drives:
                # wheels of one body under one pump push each other: alone, none of them can be told from the others
                why = "no model of the wheels could be found in this mission"
                found = unassessed(self.timeline.size, State.NOT_ASSESSED, why)
                return found, found
            return assess_drive(drive, self.machine.limits)
        names = (self.name("v"), "its command")
        return assess_tracking(self.values("v"), command, self.timeline.dt, self.machine.limits, names)
