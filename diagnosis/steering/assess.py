"""Steering axles: sensor and valve of each by the best evidence there is, and the angles that the wheels may rely on."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.liveness import alive
from diagnosis.results.assessment import CODE, Assessment, Finding, unassessed
from diagnosis.results.evidence_columns import Pictured, steps_of
from diagnosis.steering.blocks import SensorNoise, SteeringBlocks, blocks_of, sensor_noise
from diagnosis.steering.filter import SteeringPath, allowed_models, most_probable
from diagnosis.steering.findings import judge_side
from diagnosis.steering.identification import SteeringPlant, identify_plants
from diagnosis.steering.models import model_of
from diagnosis.steering.onset import refined, refined_valve
from diagnosis.steering.path_refinement import SteeringData, tidy
from diagnosis.steering.second_measurement import with_position, with_second_angle
from diagnosis.steering.states import BLIND_ROWS, REASONS, states_of
from replay.arrays.spill import Column, beside, in_blocks
from replay.arrays.spill import blocks as cut
from replay.control.loop import Replay
from replay.faults import Side, State
from replay.machine.config import Machine, Noise
from replay.progress import Progress, Stage, Subscriber
from replay.signals.timeline import Timeline

Array = NDArray[np.float64]
Key = tuple[str, str]
Counts = Mapping[str, NDArray[np.int16]]

_TOLERANCE = 0.15  # of the smallest saturation term: what two healthy angle sensors may differ by


@dataclass(frozen=True)
class SteeringResult:
    """What is known of the steering.

    Attributes
    ----------
    assessments : dict[tuple[str, str], Assessment]
        By (axle, ``sensor`` or ``actuator``).
    angle : Array, shape (n, axles)
        Best estimate of the true angle [rad]: the second measurement, else the sensor where it is healthy, else the
        model's; NaN where nothing is known.
    doubtful : NDArray[np.bool_], shape (n, axles)
        Where that estimate rests on a model or on a sensor that was not judged healthy.
    """

    assessments: dict[Key, Assessment]
    angle: Array
    doubtful: NDArray[np.bool_]


def assess_steering(
    timeline: Timeline, replay: Replay, machine: Machine, counts: Counts, progress: Subscriber
) -> SteeringResult:
    """Judge sensor and valve of every steering axle.

    Parameters
    ----------
    timeline, replay, machine
        The aligned mission, the replayed loop and the machine.
    counts : Mapping[str, NDArray[np.int16]]
        From `diagnosis.channels.liveness.alive_sources`.
    progress : Subscriber
        Called at the beginning of each stage.
    """
    axles = [_Axle.of(timeline, replay, machine, j, counts) for j in range(len(machine.axles))]
    modelled = [a for a in axles if a.blocks is not None]
    plants: dict[str, SteeringPlant | None] = {}
    if modelled:
        progress(Progress(Stage.IDENTIFYING_STEERING))
        found = identify_plants([a.blocks for a in modelled], [a.noise for a in modelled], machine.max_steer)
        plants = {a.name: plant for a, plant in zip(modelled, found, strict=True)}
    assessments: dict[Key, Assessment] = {}
    angles: list[Array] = []
    doubts: list[NDArray[np.bool_]] = []
    for axle in axles:
        progress(Progress(Stage.JUDGING_STEERING, axle.name))
        sensor, actuator, model_angle = _judge_axle(axle, plants.get(axle.name), machine)
        assessments[axle.name, "sensor"], assessments[axle.name, "actuator"] = sensor, actuator
        angle, doubt = _best_angle(axle, sensor, model_angle)
        angles.append(angle)
        doubts.append(doubt)
    if not axles:
        return SteeringResult({}, np.empty((timeline.size, 0)), np.empty((timeline.size, 0), np.bool_))
    return SteeringResult(assessments, beside(angles), beside(doubts))


@dataclass(frozen=True)
class _Axle:
    """One axle's channels and, where a model must judge a side, their blocks."""

    name: str
    timeline: Timeline
    counts: dict[str, NDArray[np.int16]]
    have: frozenset[str]
    command: Array
    blocks: SteeringBlocks | None
    noise: SensorNoise
    off: Array | None
    measured: str

    @property
    def twice(self) -> bool:
        """Whether something is measured twice."""
        return {"phi", "phi_true"} <= self.have or {"u", "u_applied"} <= self.have

    @classmethod
    def of(cls, timeline: Timeline, replay: Replay, machine: Machine, j: int, counts: Counts) -> _Axle:
        name = machine.axles[j]
        leaves = ("phi", "phi_true", "u", "u_applied")
        have = frozenset(
            leaf
            for leaf in leaves
            if (x := timeline.get(f"steer.{name}.{leaf}")) is not None and bool(np.isfinite(x).any())
        )
        u = timeline.get(f"steer.{name}.u") if "u" in have else timeline.get(f"steer.{name}.u_applied")
        if u is None or not np.isfinite(u).any():
            u = replay.steer_u[:, j]
        measured = "phi" if "phi" in have else "phi_true"
        blocks, noise, off = None, SensorNoise(1.0, 1.0, 0.0, 0.0), None
        if measured in have and np.isfinite(u).any():
            channel = f"steer.{name}.{measured}"
            y, fresh = timeline.signals[channel], timeline.fresh[channel]
            blocks = blocks_of(y, u, fresh, alive(timeline, dict(counts), channel), timeline.dt)
            known = machine.noise.get(channel, Noise())
            noise = sensor_noise(blocks, y[fresh & np.isfinite(y)], known, machine.max_steer)
            if {"phi", "phi_true"} <= have:
                true = f"steer.{name}.phi_true"
                # a coarse rounding is no disagreement
                tolerance = _TOLERANCE * machine.limits.min_sat + (0.0 if noise.resolved else noise.lsb)
                blocks = with_second_angle(
                    blocks, y, timeline.signals[true], timeline.fresh[true], timeline.dt, tolerance
                )
            if {"u", "u_applied"} <= have:
                spool = f"steer.{name}.u_applied"
                blocks, off = with_position(blocks, u, timeline.signals[spool], timeline.fresh[spool], timeline.dt)
        return cls(name, timeline, dict(counts), have, u, blocks, noise, off, measured)

    def channel(self, leaf: str) -> str:
        """Canonical name."""
        return f"steer.{self.name}.{leaf}"

    def values(self, leaf: str) -> Array:
        """Values on the timeline; NaN where it is not logged."""
        return (
            self.timeline.signals[self.channel(leaf)]
            if leaf in self.have
            else np.broadcast_to(np.nan, (self.timeline.size,))
        )


def _judge_axle(
    axle: _Axle, plant: SteeringPlant | None, machine: Machine
) -> tuple[Assessment, Assessment, Array | None]:
    """Both sides of an axle, and the model's angle where a model was used."""
    size = axle.timeline.size
    by_model: dict[Side, Assessment] = {}
    model_angle: Array | None = None
    if axle.blocks is not None and plant is not None:
        by_model, model_angle = _by_model(axle, axle.blocks, plant, machine)
    why = "the axle was steered too little to identify what its valve does"
    if axle.blocks is None:
        why = "neither a steering command nor the valve's position is in the log"
    fallback = unassessed(size, State.NOT_ASSESSED, why)
    if "phi" not in axle.have:
        sensor = unassessed(size, State.NO_DATA, "the steering angle is not in the log")
    else:
        sensor = by_model.get(Side.SENSOR, fallback)
    if "u" not in axle.have and "u_applied" not in axle.have and "phi" not in axle.have:
        actuator = unassessed(size, State.NO_DATA, "the steering valve's command is not in the log")
    elif "u_applied" in axle.have and "u" not in axle.have:
        actuator = unassessed(size, State.NOT_ASSESSED, "the valve's position is logged but not its command")
    else:
        actuator = by_model.get(Side.ACTUATOR, fallback)
    return sensor, actuator, model_angle


def _by_model(
    axle: _Axle, blocks: SteeringBlocks, plant: SteeringPlant, machine: Machine
) -> tuple[dict[Side, Assessment], Array]:
    """Both sides by the filters, and the angle that they give [rad]."""
    model = model_of(blocks, plant, axle.noise, machine.max_steer)
    driven = blocks.driven(plant.gain, plant.rate)
    position = {"u", "u_applied"} <= axle.have
    judged_valve = position or (plant.reliable and not ("u_applied" in axle.have and "u" not in axle.have))
    allowed = allowed_models(sensor=axle.measured == "phi", actuator=judged_valve, twice=axle.twice)
    names = (axle.channel(axle.measured), axle.channel("u" if "u" in axle.have else "u_applied"))
    data = SteeringData(blocks, driven, model, allowed, names)
    path = tidy(data, most_probable(blocks, driven, model, allowed))
    judged = {side: judge_side(side, data, path, machine.limits) for side in (Side.SENSOR, Side.ACTUATOR)}
    y = axle.values(axle.measured)
    fresh = axle.timeline.fresh[names[0]]
    findings: dict[Side, list[Finding]] = {
        side: [refined(j.finding, y, fresh, axle.noise, blocks.length) for j in found if j.finding is not None]
        for side, found in judged.items()
    }
    if axle.off is not None:
        findings[Side.ACTUATOR] = [refined_valve(f, axle.off, blocks.length) for f in findings[Side.ACTUATOR]]
    masked = (
        []
        if axle.twice
        else [(f.start, f.stop) for f in findings[Side.SENSOR] if CODE[State(f.mode.value)] in BLIND_ROWS]
    )
    step = steps_of([*findings[Side.SENSOR], *findings[Side.ACTUATOR]], y.size, axle.timeline.dt)
    series = _series(path, blocks, model.plant.gain, y, step)
    note = (
        f"{names[0]} by the steering model with {names[1]}: {plant.gain:.3g} rad/s per full opening, at most "
        f"{plant.rate:.3g} rad/s, lag {plant.lag:.2g} s, noise {axle.noise.std:.2g} rad, rounding step "
        f"{axle.noise.lsb:.2g} rad, error of the rate {model.load:.2g} rad/s."
    )
    out = {}
    for side in (Side.SENSOR, Side.ACTUATOR):
        open_runs = [(j.start, j.stop) for j in judged[side] if j.finding is None]
        states, doubt = states_of(side, data, path, findings[side], open_runs, masked, y, axle.command, judged_valve)
        out[side] = Assessment(
            states=states,
            reasons=REASONS[side],
            findings=tuple(findings[side]),
            columns=series[side].columns,
            closeups=series[side].closeups,
            tier="model",
            notes=(note,),
            unexplained_s=doubt * axle.timeline.dt,
        )
    middles = np.arange(path.model.size) * blocks.length + (blocks.length - 1) / 2
    angle = Column(np.float64)
    for part in cut(y.size):
        angle.append(np.interp(np.arange(part.start, part.stop), middles, path.mean[:, 0]))
    return out, angle.finish()


def _series(
    path: SteeringPath, blocks: SteeringBlocks, gain: float, y: Array, step: NDArray[np.int64]
) -> dict[Side, Pictured]:
    """Evidence columns of both sides, each value held over its block, and every sample of them at some steps."""
    mean, std = path.mean, np.sqrt(np.maximum(path.variance, 0.0))

    def held(x: Array) -> Array:
        return np.repeat(x, blocks.length)[: y.size]

    def shared() -> Iterator[tuple[str, Array]]:
        residual = held(mean[:, 0])
        np.subtract(y, residual, out=residual)
        yield "residual", residual
        del residual
        yield "threshold", held(3 * std[:, 0])
        yield "expected", held(mean[:, 0])

    def gains(i: int, scale: float) -> Iterator[tuple[str, Array]]:
        yield "delta", held(mean[:, i])
        yield "delta_std", held(std[:, i])
        yield "delta_bar", held(mean[:, i + 1] / scale)
        yield "delta_bar_std", held(std[:, i + 1] / scale)

    both = Pictured.of(step, shared())
    return {
        Side.SENSOR: both | Pictured.of(step, gains(4, 1.0)),
        Side.ACTUATOR: both | Pictured.of(step, gains(2, gain)),
    }


def _best_angle(axle: _Axle, sensor: Assessment, model_angle: Array | None) -> tuple[Array, NDArray[np.bool_]]:
    """Best estimate of an axle's true angle, and where it is in doubt."""
    true, phi = axle.values("phi_true"), axle.values("phi")
    fine = (sensor.states == CODE[State.HEALTHY]) | (sensor.states == CODE[State.NOT_EXCITED])
    usable = fine if model_angle is not None else fine | (sensor.states == CODE[State.NOT_ASSESSED])
    model = np.broadcast_to(np.nan, phi.shape) if model_angle is None else model_angle

    def chosen(usable: NDArray[np.bool_], phi: Array, model: Array, true: Array) -> Array:
        angle = np.where(usable & np.isfinite(phi), phi, model)
        return np.where(np.isfinite(true), true, angle)

    def doubted(fine: NDArray[np.bool_], usable: NDArray[np.bool_], phi: Array, model: Array, true: Array) -> Any:
        return (~fine | ~np.isfinite(np.where(usable, phi, model))) & ~np.isfinite(true)

    return in_blocks(chosen, usable, phi, model, true), in_blocks(doubted, fine, usable, phi, model, true)
