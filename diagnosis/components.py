"""For every component and side: which evidence the log offers, and the assessment by the best of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.assessment import Assessment, unassessed
from diagnosis.channels import alive, alive_sources, make_pair
from diagnosis.direct import assess_pair
from diagnosis.model_based import assess_wheel
from diagnosis.noise import shifted
from diagnosis.pairs import Pair, sample_status
from diagnosis.parity import slipping
from diagnosis.tracking import assess_tracking
from diagnosis.wheel_findings import WheelData
from diagnosis.wheel_model import WheelModelFit, aliasing_slack, common_load, fed_openings, identify, low_passed
from replay.faults import Side, State
from replay.loop import Replay, stack
from replay.machine import Machine, Noise, WheelPlant
from replay.timeline import Timeline

Array = NDArray[np.float64]
Key = tuple[str, str]

_QUIET = 0.4


@dataclass(frozen=True)
class ComponentResult:
    """Assessments by (component, side), and the wheel model that stood behind them."""

    assessments: dict[Key, Assessment]
    wheel_model: WheelModelFit | None


def assess_components(
    timeline: Timeline, replay: Replay, machine: Machine, wheels: tuple[str, ...], progress: Callable[[str], None]
) -> ComponentResult:
    """Judge wheels and steering axles by the best evidence there is.

    Parameters
    ----------
    timeline, replay, machine
        The aligned mission, the replayed loop and the machine.
    wheels : tuple[str, ...]
        Wheels to judge; the others only help.
    progress : Callable[[str], None]
        Told what is being judged.
    """
    counts = alive_sources(timeline)
    v = stack(timeline, [f"wheel.{w}.v" for w in machine.wheels])
    u = stack(timeline, [f"wheel.{w}.u" for w in machine.wheels])
    applied = stack(timeline, [f"wheel.{w}.u_applied" for w in machine.wheels])
    true = stack(timeline, [f"wheel.{w}.v_true" for w in machine.wheels])
    has_true = np.asarray(np.isfinite(true).any(axis=0))
    has_applied = np.asarray(np.isfinite(applied).any(axis=0))
    speed = np.where(has_true, true, v)
    opening = np.where(has_applied, applied, u)
    fit: WheelModelFit | None = None
    common, residual, slack = np.zeros_like(v), np.full_like(v, np.nan), np.zeros_like(v)
    if np.isfinite(opening).any() and np.isfinite(speed).any() and not (has_true & has_applied).all():
        progress("identifying the wheels")
        moving = np.abs(np.where(np.isfinite(replay.v_ref), replay.v_ref, speed)) > machine.limits.driving_speed
        given = {i: p for i, w in enumerate(machine.wheels) if (p := machine.plant.wheels.get(w)) is not None}
        fit = identify(speed, opening, moving, timeline.dt, given, machine.plant.flow)
        opening, slack = fed_openings(speed, opening, fit, machine.plant.flow, timeline.dt)
        for i, plant in enumerate(fit.plants):
            if plant is not None:
                slack[:, i] = np.hypot(slack[:, i], aliasing_slack(opening[:, i], plant, timeline.dt))
                residual[:, i] = speed[:, i] - plant.K * low_passed(opening[:, i], plant.tau, timeline.dt)
        common = common_load(residual, timeline.dt)
    slip = _slip(timeline, replay, machine, v)
    out: dict[Key, Assessment] = {}
    for i, wheel in enumerate(machine.wheels):
        if wheel not in wheels:
            continue
        progress(f"judging wheel {wheel}")
        one = _Wheel(timeline, replay, machine, i, counts)
        model: tuple[Assessment, Assessment] | None = None
        plant = fit.plants[i] if fit is not None else None
        if plant is not None and not (has_true[i] and has_applied[i]) and np.isfinite(v[:, i]).any():
            source = "v_true" if has_true[i] else "v"
            command = "u_applied" if has_applied[i] else "u"
            data = one.model_data(source, command, opening[:, i], common[:, i], slack[:, i], plant)
            assert fit is not None
            model = assess_wheel(data, plant, residual[:, i], slip[:, i], machine.limits, gains=fit.reliable)
        elif fit is None and not has_true[i] and np.isfinite(v[:, i]).any() and np.isfinite(replay.v_ref[:, i]).any():
            model = assess_tracking(
                v[:, i], replay.v_ref[:, i], timeline.dt, machine.limits, (f"wheel.{wheel}.v", "its command")
            )
        out[wheel, "sensor"] = one.sensor(has_true[i], model)
        out[wheel, "actuator"] = one.actuator(has_applied[i], model)
    for j, axle in enumerate(machine.axles):
        progress(f"judging steering {axle}")
        out[axle, "sensor"], out[axle, "actuator"] = _steering(timeline, replay, machine, j, axle, counts)
    return ComponentResult(out, fit)


def _slip(timeline: Timeline, replay: Replay, machine: Machine, v: Array) -> NDArray[np.bool_]:
    """Where a wheel breaks the parity of the body; nowhere without geometry, or without measured steering angles."""
    geometry = machine.geometry
    phi = stack(timeline, [f"steer.{a}.phi" for a in machine.axles])
    if (
        geometry is None
        or v.shape[1] < 4
        or not np.isfinite(v).any(axis=0).all()
        or not np.isfinite(phi).any(axis=0).all()
    ):
        return np.zeros(v.shape, dtype=np.bool_)
    least = 1.5 * machine.limits.min_sat
    return slipping(v, phi, replay.phi_ref, replay.wheel_phi, geometry, timeline.dt, least)


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
        return np.full(self.timeline.size, np.nan) if found is None else found

    def quiet(self, expected: Array) -> NDArray[np.bool_]:
        """Neither commanded nor expected to move."""
        limit = _QUIET * self.machine.limits.driving_speed
        return (np.abs(np.nan_to_num(self.replay.v_ref[:, self.index])) < limit) & (
            np.abs(np.nan_to_num(expected)) < limit
        )

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
        return np.column_stack([command, *(low_passed(command, lag, self.timeline.dt) for lag in (0.1, 0.3))])

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
            idle = np.abs(np.nan_to_num(self.values("u"))) < 0.02 * self.span("u")
            return assess_pair(self.pair(Side.ACTUATOR, "u_applied", "u", idle, "of full opening"), self.machine.limits)
        if direct:
            return unassessed(size, State.NOT_ASSESSED, "the valve's position is logged but not its command")
        if model is not None:
            return model[1]
        return unassessed(size, State.NO_DATA, "the wheel's valve command is not in the log")

    def model_data(
        self, speed: str, command: str, u: Array, common: Array, slack: Array, plant: WheelPlant
    ) -> WheelData:
        y = self.values(speed)
        driven = plant.K * u  # without command and opening a wheel may coast or brake: nothing to judge
        name = self.name(speed)
        status = sample_status(
            y, u, self.timeline.fresh[name], alive(self.timeline, self.counts, name), self.timeline.dt
        )
        return WheelData(
            y=y,
            u=np.nan_to_num(shifted(u, 1)),
            common=common,
            slack=slack,
            status=status,
            quiet=self.quiet(driven),
            u_measured=command == "u_applied",
            dt=self.timeline.dt,
            span=self.span(speed),
            noise=self.machine.noise.get(name, Noise()),
            names=(name, self.name(command)),
        )


def _steering(
    timeline: Timeline, replay: Replay, machine: Machine, j: int, axle: str, counts: dict[str, NDArray[np.int16]]
) -> tuple[Assessment, Assessment]:
    """Steering: judged where it is measured twice, else said to be unjudged."""
    size = timeline.size
    names = {leaf: f"steer.{axle}.{leaf}" for leaf in ("phi", "phi_true", "u", "u_applied")}
    have = {
        leaf: name in timeline.signals and bool(np.isfinite(timeline.signals[name]).any())
        for leaf, name in names.items()
    }
    sensor = unassessed(
        size, State.NOT_ASSESSED, "steering is replayed and shown, but judged only where it is measured twice"
    )
    if not have["phi"]:
        sensor = unassessed(size, State.NO_DATA, "the steering angle is not in the log")
    elif have["phi_true"]:
        true = timeline.signals[names["phi_true"]]
        quiet = np.abs(np.nan_to_num(true)) < 0.02
        pair = make_pair(
            timeline,
            counts,
            Side.SENSOR,
            names["phi"],
            names["phi_true"],
            quiet,
            "rad",
            1.2 * machine.max_steer,
            machine,
        )
        sensor = assess_pair(pair, machine.limits)
    actuator = unassessed(
        size, State.NOT_ASSESSED, "steering is replayed and shown, but judged only where it is measured twice"
    )
    if not have["u"]:
        actuator = unassessed(size, State.NO_DATA, "the steering valve's command is not in the log")
    elif have["u_applied"]:
        idle = np.abs(np.nan_to_num(timeline.signals[names["u"]])) < 0.02 * machine.control.u_max
        pair = make_pair(
            timeline,
            counts,
            Side.ACTUATOR,
            names["u_applied"],
            names["u"],
            idle,
            "of full opening",
            machine.control.u_max,
            machine,
        )
        actuator = assess_pair(pair, machine.limits)
    return sensor, actuator
