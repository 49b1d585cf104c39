"""Model evidence: wheels judged by valve openings and speeds alone, or with one of them measured twice."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.sample_status import PAIR
from diagnosis.results.assessment import Assessment
from diagnosis.results.evidence_columns import Pictured, steps_of
from diagnosis.results.loss import Loss
from diagnosis.results.machine_event import MachineEvent, foreign, swinging
from diagnosis.results.plain_numbers import plain
from diagnosis.results.said import Said
from diagnosis.results.vocabulary import Tier
from diagnosis.wheels.blocks import WheelBlocks, blocks_of, per_sample
from diagnosis.wheels.claims import as_claimed, or_off
from diagnosis.wheels.effectiveness import relative_losses
from diagnosis.wheels.filter import JointPass
from diagnosis.wheels.filter_identification import joint_model
from diagnosis.wheels.findings import Weighed, WheelFindings, WheelPath, findings_of
from diagnosis.wheels.following import Following, follow
from diagnosis.wheels.frames.features import mission_features
from diagnosis.wheels.frozen import with_frozen
from diagnosis.wheels.goes_along import off_by_a_constant
from diagnosis.wheels.inputs import WheelsData
from diagnosis.wheels.looks import second_look
from diagnosis.wheels.machine_held import or_machine_held
from diagnosis.wheels.many_weak import without_many_weak
from diagnosis.wheels.models import ODD, JointModel, WheelFilterModel
from diagnosis.wheels.own_swings import with_open_side
from diagnosis.wheels.quick_noise import with_shaken
from diagnosis.wheels.readings import with_readings
from diagnosis.wheels.run_kernel import evidence_of_runs
from diagnosis.wheels.shared_swings import without_shared
from diagnosis.wheels.standing import or_standing
from diagnosis.wheels.states import states_of, unexplained_s, with_reasons
from diagnosis.wheels.tracks import Segment, Track, runs_between, segments_of, track_of
from replay.faults import Side, State
from replay.machine.config import Limits

Array = NDArray[np.float64]


@dataclass(frozen=True)
class WheelsJudged:
    """Sensor and actuator by wheel, and what is the machine's rather than any part's."""

    parts: dict[int, tuple[Assessment, Assessment]]
    events: tuple[MachineEvent, ...]


def assess_wheels(data: WheelsData, limits: Limits, *, gains: bool) -> WheelsJudged:
    """Judge sensor and actuator of every wheel that has a model.

    Parameters
    ----------
    data : WheelsData
        Channels.
    limits : Limits
        What counts.
    gains : bool
        Whether the wheel model is good enough to judge gains and valves by.

    Returns
    -------
    WheelsJudged
        Sensor and actuator by wheel.
    """
    blocks = blocks_of(data.y, data.u, data.status, data.quiet, data.ratio, data.turn, data.plants, data.dt, data.store)
    blocks = with_readings(blocks, data.y, data.habits, data.speed_noises, limits.driving_speed)
    model, blocks = joint_model(data, blocks)
    done, following = follow(data, blocks, model)
    features = mission_features(data, blocks, model, {i: f.described for i, f in following.items()}, gains=gains)
    said = second_look(features, [bool(m) for m in data.measured], blocks.dt)
    losses = _losses(data, limits)
    paths = {
        i: _path(data, i, wheel, blocks, model, done, following[i], track_of(said[i], features.hop, blocks.dt))
        for i, wheel in enumerate(model.wheels)
        if wheel is not None
    }
    found = {i: with_open_side(path, findings_of(path, limits)) for i, path in paths.items()}
    swings = without_shared(paths, with_shaken(paths, found))
    shifted = {i: or_off(one, paths[i].y, _expected(paths[i])) for i, one in swings.found.items()}
    doubted = without_many_weak(with_frozen(data, shifted))
    measured = {i: bool(data.measured[i]) for i in paths}
    told = or_standing(doubted.found, {i: path.y for i, path in paths.items()}, measured, data.dt)
    told = or_machine_held(data, told)
    out = {}
    for i, path in paths.items():
        follows = off_by_a_constant(told[i], path.y, _expected(path), data.dt, path.model.span, path.model.noise)
        claimed = as_claimed(follows, limits.clear_at, measured=measured[i], swings=bool(swings.spans))
        sensor, actuator = _assessments(data, i, path, claimed, gains=gains)
        out[i] = sensor, actuator if measured[i] else replace(actuator, loss=losses[i])
    events = ((Said(swings.sentence, swings.spans).event(swinging),) if swings.spans else ()) + (
        (foreign(doubted.sentence),) if doubted.wheels else ()
    )
    return WheelsJudged(out, events)


def _expected(path: WheelPath) -> Array:
    """What a healthy wheel would do [m/s], shape (n,)."""
    return np.asarray(per_sample(path.expected, path.width, path.y.size), dtype=np.float64)


def _losses(data: WheelsData, limits: Limits) -> list[Loss | None]:
    """Loss of each wheel's speed per opening against the others over the mission."""
    taus = [p.tau for p in data.plants if p is not None]
    usable = (data.status == PAIR).all(axis=1)
    tau = float(np.median(taus)) if taus else 0.0
    return relative_losses(data.y, data.u, data.ratio, usable, tau, limits.driving_speed, data.dt)


def _path(
    data: WheelsData,
    i: int,
    wheel: WheelFilterModel,
    blocks: WheelBlocks,
    model: JointModel,
    done: JointPass,
    following: Following,
    track: Track,
) -> WheelPath:
    """Wheel i with its segments, and all models' evidence over them."""
    n, runs = len(blocks.y), following.described.runs
    segments = {side: segments_of(track, side, n, runs, blocks.dt) for side in (Side.SENSOR, Side.ACTUATOR)}
    weighed: list[Weighed] = []
    expected = following.evidence
    for mine in segments.values():
        if mine:
            between, places = runs_between(mine, n)
            found = evidence_of_runs(blocks, model, done, i, between, places)
            weighed += [
                Weighed(s, found.evidence[r], found.mean[r], found.cov[r]) for s, r in zip(mine, places, strict=True)
            ]
            expected = found
    if all(segments.values()):  # what a healthy wheel would do is not to be learned from faults of either side
        either, _ = runs_between(_united([*segments[Side.SENSOR], *segments[Side.ACTUATOR]]), n)
        expected = evidence_of_runs(blocks, model, done, i, either, ())
    return WheelPath(
        y=data.y[:, i],
        reference=data.reference[:, i],
        stands=data.stands,
        names=data.names[i],
        model=wheel,
        dt=data.dt,
        width=blocks.width,
        runs=runs,
        segments=weighed,
        expected=expected.expected,
        spread=expected.spread,
        healthy={side: track.healthy(side, n) for side in segments},
        raised=done.best[:, i] > ODD,
        others=sum(w is not None for w in model.wheels) - 1,
    )


def _united(segments: Sequence[Segment]) -> list[Segment]:
    """Segments in order of time, without what an earlier one covers."""
    out: list[Segment] = []
    for s in sorted(segments, key=lambda s: s.start):
        start = max(s.start, out[-1].stop) if out else s.start
        if s.stop > start:
            out.append(replace(s, start=start))
    return out


def _assessments(
    data: WheelsData, i: int, path: WheelPath, found: WheelFindings, *, gains: bool
) -> tuple[Assessment, Assessment]:
    """Sensor and actuator of wheel i."""
    states = states_of(data, i, path, found)
    no_opening = ~np.isfinite(data.u[:, i])
    step = steps_of(found.findings, path.y.size, data.dt)
    shared = Pictured.of(step, _series(path, data.status[:, i]))
    out = []
    for side in (Side.SENSOR, Side.ACTUATOR):
        faults, codes = found.of(side), states.codes[side]
        doubted: Array = np.array(per_sample(1.0 - path.healthy[side], path.width, path.y.size), np.float64)
        for f in faults:  # what other evidence says counts in it, too
            doubts = 1.0 - sum(h.p for h in f.hypotheses if h.mode == State.HEALTHY)
            np.maximum(doubted[f.start : f.stop], doubts, out=doubted[f.start : f.stop])
        pictured = shared | Pictured.of(step, [("probability", doubted)])
        judged = Assessment(
            states=codes,
            findings=tuple(faults),
            columns=pictured.columns,
            tier=Tier.MODEL,
            notes=(_note(path),),
            unexplained_s=unexplained_s(states, side, found, data.dt),
            closeups=pictured.closeups,
        )
        out.append(with_reasons(judged, no_opening, data.dt, gains=gains))
    return out[0], out[1]


def _series(path: WheelPath, status: NDArray[np.int8]) -> Iterator[tuple[str, Array]]:
    """Evidence of one wheel sample by sample; each column is made when it is asked for."""

    def held(values: Array) -> Array:
        return np.asarray(per_sample(values, path.width, path.y.size))

    residual = held(path.expected)
    np.subtract(path.y, residual, out=residual)
    residual[status != PAIR] = np.nan
    yield "residual", residual
    del residual
    yield "threshold", held(3 * np.sqrt(path.spread + path.model.noise**2))
    yield "expected", held(path.expected)


def _note(path: WheelPath) -> str:
    """Figures that the judgement used."""
    model, (speed, opening) = path.model, path.names
    air = model.grip_most <= 0
    return (
        f"{speed} by the {{wheel}} model with {opening}: noise {plain(model.noise, 2)} {{speed_unit}}, load and model error "
        f"{plain(model.load, 2)} {{speed_unit}}, K {plain(model.K)} {{speed_unit}} at 100{{percent}}, τ {plain(model.tau, 2)} s, "
        + (
            "no coupling by the ground."
            if air
            else f"tyres that hold up to {plain(model.grip_most, 2)} {{speed_unit}} of load."
        )
    )
