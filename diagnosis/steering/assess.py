"""Steering axles: sensor and valve of each by the best evidence there is, and the angles that the wheels may rely on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from diagnosis.evidence import Part
from diagnosis.results.assessment import CODE, Assessment, Lack, unassessed
from diagnosis.results.plain_numbers import plain
from diagnosis.results.sizes import amount
from diagnosis.results.vocabulary import Tier
from diagnosis.steering.acquittal import acquitted, moves_otherwise, scatter_of
from diagnosis.steering.agreed import without_agreed
from diagnosis.steering.alike_angles import not_scaled_together
from diagnosis.steering.blocks import SteeringBlocks, without_growth
from diagnosis.steering.denied import not_denied
from diagnosis.steering.driven import driven_by
from diagnosis.steering.evidence import evidence_columns, path_angle
from diagnosis.steering.filter_state import SteeringPath
from diagnosis.steering.findings import apart, findings_of
from diagnosis.steering.followed import assessed, stays
from diagnosis.steering.inputs import REPLAYED, AxleInputs, Counts, axle_inputs
from diagnosis.steering.measured_twice import of_one_cause
from diagnosis.steering.model_error import ModelError, model_error
from diagnosis.steering.models import model_of
from diagnosis.steering.news import with_news
from diagnosis.steering.pace import Speed, body_speed, identified
from diagnosis.steering.path import AxleFilter, allowed_models, most_probable
from diagnosis.steering.path_refinement import refine_path
from diagnosis.steering.plant import SteeringPlant
from diagnosis.steering.prior import plant_before
from diagnosis.steering.reliability import commanded, lost_by_model, paired, told_from_none, weighed
from diagnosis.steering.rests_together import not_resting_together
from diagnosis.steering.side_findings import SideFindings
from diagnosis.steering.states import reasons_of, states_of
from diagnosis.steering.together import less_sure_all_along, not_shaken_together, not_starved, not_together
from diagnosis.steering.unexplained_size import size_words
from diagnosis.steering.usual_noise import with_usual_noises
from replay.arrays.processors import each
from replay.control.loop import Replay
from replay.faults import Side, State
from replay.machine.config import Machine
from replay.progress import Progress, Stage, Subscriber
from replay.signals.timeline import Timeline

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_SIDES = (Side.SENSOR, Side.ACTUATOR)
_INSTEAD = " (what the replayed loop commands, for what the {valve} was told is not in the log)"
_OTHERWISE = (
    "No model of the axles fits their motion closely enough to accuse a part of them, as on many sound machines (valves creep, axles push each "
    "other, oil warms): only faults that a measurement of the same quantity shows are stated. The verdict does not rest on the model there: what "
    "clears an axle are second measurements, its rate per opening, and how the machine turns."
)


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

    assessments: dict[Part, Assessment]
    angle: Array
    doubtful: Flags


@dataclass(frozen=True, eq=False)
class _Found:
    """What the model of an axle finds."""

    axle: AxleFilter
    path: SteeringPath
    sides: dict[Side, SideFindings]
    valve_judged: bool


@dataclass(frozen=True)
class _Judged:
    """Both sides of an axle by its model, and the angle that the model gives [rad]."""

    sides: dict[Side, Assessment]
    angle: Array


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
    timeline = with_news(timeline, machine)
    axles = _evened([axle_inputs(timeline, replay, machine, j, counts) for j in range(len(machine.axles))])
    axles = with_usual_noises(axles, machine)
    axles, plants = _identified(axles, body_speed(timeline, machine, replay.v_ref), machine, progress)
    scatters = [
        scatter_of(a.blocks, plant) for a in axles if a.blocks is not None and (plant := plants.get(a.name)) is not None
    ]
    otherwise = moves_otherwise(scatters)
    filters = {
        a.name: partial(_filter, a, a.blocks, plant, machine)
        for a in axles
        if a.blocks is not None and (plant := plants.get(a.name)) is not None
    }
    error = model_error(list(filters.values()))

    def begun(inputs: AxleInputs) -> None:
        progress(Progress(Stage.JUDGING_STEERING, inputs.name))

    def found(inputs: AxleInputs) -> _Found | None:
        under = filters.get(inputs.name)
        return None if under is None else _found(inputs, under(error), machine, otherwise=otherwise)

    judged_axles = zip(axles, each(found, axles, timeline.size, begun), strict=True)
    told = {inputs.name: one for inputs, one in judged_axles if one is not None}
    once = {a.name: told[a.name] for a in axles if a.name in told and not a.redundant}
    length = max((one.axle.blocks.length for one in told.values()), default=1)
    alone = less_sure_all_along(
        not_together({name: one.sides for name, one in once.items()}, length, timeline.dt), timeline.size
    )
    single = {a.name for a in axles if a.redundant and not a.angle_redundant}  # their openings alone are measured
    alone |= not_shaken_together({n: one.sides for n, one in told.items() if n not in once}, length, timeline.dt)
    alone |= not_scaled_together({n: alone[n] for n in told if n not in once}, axles, length, machine.limits.clear_at)
    alone |= not_starved({n: alone[n] for n in told if n in single}, {n: one.axle for n, one in told.items()})
    alone = not_resting_together(
        {n: alone.get(n, one.sides) for n, one in told.items()}, axles, {n: one.axle for n, one in told.items()}
    )
    assessments: dict[Part, Assessment] = {}
    angles: list[Array] = []
    doubts: list[Flags] = []
    for inputs in axles:
        one, judged = told.get(inputs.name), None
        if one is not None:
            sides = alone.get(inputs.name, one.sides)
            judged = _judged(inputs, replace(one, sides=sides), otherwise=otherwise)
        found_still = stays(timeline, machine, inputs.name) if judged is None else None
        for side in _SIDES:
            assessments[inputs.name, side.value] = (
                _assessment(side, inputs, judged)
                if found_still is None
                else assessed(found_still, inputs.values("phi"), side)
            )
        angle, doubt = _best_angle(inputs, assessments[inputs.name, Side.SENSOR.value], judged)
        angles.append(angle)
        doubts.append(doubt)
    if not axles:
        return SteeringResult({}, np.empty((timeline.size, 0)), np.empty((timeline.size, 0), np.bool_))
    return SteeringResult(assessments, timeline.store.beside(angles), timeline.store.beside(doubts))


def _evened(axles: Sequence[AxleInputs]) -> list[AxleInputs]:
    """Axles with blocks whose noise does not grow with the rate."""
    told = [(a, a.blocks) for a in axles if a.blocks is not None]
    blocks = dict(zip([a.name for a, _ in told], without_growth([b for _, b in told]), strict=True))
    return [replace(a, blocks=blocks.get(a.name)) for a in axles]


def _identified(
    axles: Sequence[AxleInputs], speed: Speed, machine: Machine, progress: Subscriber
) -> tuple[list[AxleInputs], dict[str, SteeringPlant | None]]:
    """Axles with the pace that the speed of driving gives them, and valve and cylinder of every one that has blocks."""
    modelled = [(a, a.blocks) for a in axles if a.blocks is not None]
    if not modelled:
        return list(axles), {}
    progress(Progress(Stage.IDENTIFYING_STEERING))
    noises = [a.noise for a, _ in modelled]
    known = [None if (k := machine.steering.get(a.name)) is None else plant_before(k) for a, _ in modelled]
    blocks, plants = identified([b for _, b in modelled], noises, speed, machine, known)
    of = dict(zip([a.name for a, _ in modelled], blocks, strict=True))
    return [replace(a, blocks=of.get(a.name)) for a in axles], dict(zip(of, plants, strict=True))


def _filter(
    inputs: AxleInputs, blocks: SteeringBlocks, plant: SteeringPlant, machine: Machine, error: ModelError
) -> AxleFilter:
    """The filters of an axle whose model errs by so much."""
    model = model_of(blocks, plant, inputs.noise, machine.max_steer, error.lag)
    allowed = allowed_models(
        sensor=inputs.measured == "phi", actuator=_valve_judged(inputs, plant), redundant=inputs.redundant
    )
    return AxleFilter(blocks, driven_by(plant, blocks, error.share), model, allowed, inputs.names)


def _valve_judged(inputs: AxleInputs, plant: SteeringPlant) -> bool:
    """Whether an axle's valve can be judged."""
    return inputs.valve_redundant or (plant.reliable and not inputs.command_missing)


def _found(inputs: AxleInputs, axle: AxleFilter, machine: Machine, *, otherwise: bool) -> _Found:
    """Inputs → path → findings of both sides; `otherwise`: the models do not fit."""
    blocks = axle.blocks
    path = refine_path(axle, most_probable(axle))
    found = {side: findings_of(side, inputs, axle, path, machine.limits) for side in _SIDES}
    found[Side.ACTUATOR] = commanded(found[Side.ACTUATOR], inputs.command, axle)
    if not (inputs.redundant or inputs.valve_redundant):
        found[Side.ACTUATOR] = apart(found[Side.SENSOR], found[Side.ACTUATOR], blocks.length)
        found = weighed(found, blocks.length, inputs.timeline.dt)
    else:
        found = paired(found)
        if not inputs.angle_redundant:
            found = lost_by_model(found, blocks.length, inputs.timeline.dt)
    found = without_agreed(not_denied(found, inputs, blocks, machine.max_steer), inputs)
    found = {side: acquitted(side, found[side], inputs, blocks, believed=not otherwise) for side in _SIDES}
    found = {side: of_one_cause(side, found[side], inputs, machine.limits.min_opening) for side in _SIDES}
    found = told_from_none(found)
    return _Found(axle, path, found, _valve_judged(inputs, axle.model.plant))


def _judged(inputs: AxleInputs, told: _Found, *, otherwise: bool) -> _Judged:
    """Findings → states and evidence columns of both sides; `otherwise`: the models do not fit."""
    axle, path, found, length = told.axle, told.path, told.sides, told.axle.blocks.length
    dead = [(f.start, f.stop) for f in found[Side.SENSOR].findings if f.mode.total]
    masked = [] if inputs.redundant else dead
    columns = evidence_columns(inputs, axle, path, [f for side in _SIDES for f in found[side].findings])
    sides, twice = {}, {Side.SENSOR: inputs.angle_redundant, Side.ACTUATOR: inputs.valve_redundant}
    for side in _SIDES:
        judged = told.valve_judged or side is Side.SENSOR
        unexplained = sum((b - a) * length for a, b in found[side].unexplained)
        sides[side] = Assessment(
            states=states_of(side, inputs, axle, path, found[side], masked, judged=judged),
            reasons=reasons_of(side, axle, judged=judged, missing=inputs.channel("u") if inputs.uncommanded else ""),
            lacks={} if twice[side] else {State.NOT_ASSESSED: _lack(side, inputs)},
            findings=found[side].findings,
            columns=columns[side].columns,
            closeups=columns[side].closeups,
            tier=Tier.MODEL,
            notes=(_note(axle), _OTHERWISE) if otherwise else (_note(axle),),
            unexplained_s=unexplained * inputs.timeline.dt,
            unexplained_size=size_words(side, found[side], inputs, axle, path),
        )
    return _Judged(sides, path_angle(axle, path, inputs.timeline))


def _lack(side: Side, inputs: AxleInputs) -> Lack:
    """What would have a side judged of which nothing is measured twice."""
    return Lack.COMMAND if side is Side.ACTUATOR and inputs.uncommanded else Lack.SECOND


def _note(axle: AxleFilter) -> str:
    """The figures that the judgement used."""
    plant, noise = axle.model.plant, axle.model.noise
    instead = _INSTEAD if axle.names[1].startswith(REPLAYED) else ""
    return (
        f"{axle.names[0]} by the steering model with {axle.names[1]}{instead}: {amount(plant.gain, 'rad')}/s at 100{{percent}}, at most "
        f"{amount(plant.rate, 'rad')}/s, lag {plain(plant.lag, 2)} s, noise {amount(noise.std, 'rad', 2)}, rounding step "
        f"{amount(noise.lsb, 'rad', 2)}, error of the rate {amount(axle.model.rate_error, 'rad', 2)}/s."
    )


def _assessment(side: Side, inputs: AxleInputs, judged: _Judged | None) -> Assessment:
    """One side by the model, or why it is not judged."""
    size = inputs.timeline.size
    if side is Side.SENSOR and "phi" not in inputs.logged:
        return unassessed(size, State.NO_DATA, "the steering angle is not in the log", Lack.SIGNALS)
    if side is Side.ACTUATOR:
        if not {"u", "u_applied", "phi"} & inputs.logged:
            return unassessed(size, State.NO_DATA, "the {steer.actuator}'s command is not in the log", Lack.SIGNALS)
        if inputs.command_missing:
            return unassessed(size, State.NOT_ASSESSED, "the {position} is logged but not its command", Lack.COMMAND)
    if judged is not None:
        return judged.sides[side]
    if inputs.blocks is None or not {"u", "u_applied"} & inputs.logged:
        why = "neither the command of its {valve} nor the {position} is in the log"
        return unassessed(size, State.NOT_ASSESSED, why, Lack.COMMAND)
    why = "the axle was steered too little to identify what its {valve} does"
    return unassessed(size, State.NOT_ASSESSED, why)


def _best_angle(inputs: AxleInputs, sensor: Assessment, judged: _Judged | None) -> tuple[Array, Flags]:
    """Best estimate of an axle's true angle, and where it is in doubt."""
    true, phi = inputs.values("phi_true"), inputs.values("phi")
    fine = (sensor.states == CODE[State.HEALTHY]) | (sensor.states == CODE[State.NOT_EXCITED])
    usable = fine if judged is not None else fine | (sensor.states == CODE[State.NOT_ASSESSED])
    model = np.broadcast_to(np.nan, phi.shape) if judged is None else judged.angle

    def chosen(usable: Flags, phi: Array, model: Array, true: Array) -> Array:
        angle = np.where(usable & np.isfinite(phi), phi, model)
        return np.where(np.isfinite(true), true, angle)

    def doubted(fine: Flags, usable: Flags, phi: Array, model: Array, true: Array) -> Flags:
        return (~fine | ~np.isfinite(np.where(usable, phi, model))) & ~np.isfinite(true)

    both = inputs.timeline.map
    return both(chosen, usable, phi, model, true), both(doubted, fine, usable, phi, model, true)
