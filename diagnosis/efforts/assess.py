"""Drives of several wheels by the effort that their motion takes: relation of healthy missions → shares → findings → what would have shown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.efforts.inputs import is_asked, wheels_with_efforts
from diagnosis.efforts.relation import Shares, shares_of
from diagnosis.efforts.windows import EffortSteps, steps_of
from diagnosis.evidence import ACTUATOR, SENSOR, MissionView, Part
from diagnosis.results.assessment import CODE, Assessment, Finding, Reason
from diagnosis.results.detectability import Deviation, Power, Powers
from diagnosis.results.result import Epsilon, Hypothesis
from diagnosis.results.sentence import About, Sentence
from diagnosis.results.vocabulary import Tier
from replay.arrays.runs import runs_of
from replay.faults import FaultMode, Side, State
from replay.machine.config import Machine
from replay.machine.effort_model import LENGTHS_S, EffortModel
from replay.signals.timeline import Timeline

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_BEYOND, _LEAST = (
    2.0,
    0.03,
)  # times what healthy missions showed, and the least share, from which on a drive is not called healthy
_FOUND, _FOUND_LEAST = 3.0, 0.2  # the same, from which on it is named
_FITS = 0.4  # of the usual effort: what most drives' efforts are off their motion at most, so that it tells of one
_RIVAL = 0.5  # of the share of a drive that is named, up to which another one's may be
_SURE = 0.95  # of the places
_HELD = 0.05  # from which on a loop with memory holds the speed: without one healthy simulated robots (tuning) had 0.011 at most
_FASTER = 1.15  # than healthy missions, from where on nothing is known
#: Of a finding: of the drive, of its row where it takes more, and of a sensor in its loop, whose factor has another effort as well. Set by hand.
_P, _MORE, _SENSOR = 0.75, 0.62, 0.15
_TRACED = 1  # of `LENGTHS_S`

HIDDEN_BY_LOOP = "its effort is the torque or current that it gives, and a loop around the speed makes up for what is lost before that; log its duty or voltage as well"
NO_LOOP = "no loop with memory is seen to hold its speed, so that the other {wheels} would carry what it loses"
WOULD_HIDE = "a loss of a quarter of its torque would not always have shown in its effort"
DIFFERS = "its effort is off what healthy missions took by more than they differed, and too little to be named"


class Efforts(NamedTuple):
    """A mission's efforts beside those of healthy missions.

    Attributes
    ----------
    wheels : tuple[str, ...]
        Wheels with an effort model.
    steps : EffortSteps
        Their means over a second.
    shares : Shares
        By how much they are off.
    models : tuple[EffortModel, ...]
        Of each wheel.
    """

    wheels: tuple[str, ...]
    steps: EffortSteps
    shares: Shares
    models: tuple[EffortModel, ...]


def efforts_of(timeline: Timeline, machine: Machine) -> Efforts | None:
    """A mission's efforts; None where fewer than two wheels have an effort and a model of it, or hardly anything is driven."""
    logged = wheels_with_efforts(timeline, machine)
    wheels = tuple(w for w in logged if w in machine.efforts)
    if len(wheels) < 2:
        return None
    models = tuple(machine.efforts[w] for w in wheels)
    steps = steps_of(timeline, machine, wheels)
    within = np.column_stack([np.abs(steps.speed[:, i]) <= _FASTER * m.fastest for i, m in enumerate(models)])
    steps = steps._replace(use=steps.use & within)
    if steps.use.sum(axis=0).min() < LENGTHS_S[0]:
        return None
    theta, usual = [np.array(m.terms) for m in models], [m.usual for m in models]
    shares = shares_of(steps, theta, usual, machine.limits.driving_speed)
    off = [np.median(np.abs(shares.rest[steps.use[:, i], i])) / x for i, x in enumerate(usual)]
    if np.median(off) > _FITS:
        return None  # another unit, load or ground, or no measurement at all: nothing that one drive does
    return Efforts(wheels, steps, shares, models)


def limit_of(model: EffortModel, length: int) -> float:
    """Share from which on a drive is not called healthy, over the length at a place of `LENGTHS_S` [1]."""
    return max(_LEAST, _BEYOND * model.off[length])


def judged_by_efforts(found: Mapping[Part, Assessment], mission: MissionView) -> dict[Part, Assessment]:
    """Drives that their answers do not judge, by their efforts; what is said of them already stays.

    Parameters
    ----------
    found : Mapping[Part, Assessment]
        Of all parts.
    mission : MissionView
        The mission.
    """
    efforts = efforts_of(mission.timeline, mission.machine)
    if efforts is None:
        return {}
    named = _named(efforts)
    wrong = [f for (_, side), a in found.items() if side == SENSOR for f in a.findings]
    out = {}
    for i, wheel in enumerate(efforts.wheels):
        drive = found.get((wheel, ACTUATOR))
        if drive is None or drive.tier is not Tier.RESPONSE:
            continue
        out[wheel, ACTUATOR] = _judged(drive, wrong, efforts, i, named.get(i, []), mission)
    return out


def _named(efforts: Efforts) -> dict[int, list[tuple[int, int, float]]]:
    """Steps [first, last) in which a drive's effort is off, and by which share, by place of the wheel."""
    found: dict[int, list[tuple[int, int, float]]] = {}
    every = {k: [efforts.shares.over(i, n) for i in range(len(efforts.wheels))] for k, n in enumerate(LENGTHS_S[:-1])}
    for i, model in enumerate(efforts.models):
        off = np.zeros(len(efforts.steps.use))
        for k, runs in every.items():
            least = max(_FOUND_LEAST, _FOUND * model.off[k])
            for share, a, b in zip(*runs[i], strict=True):
                if abs(share) > least and all(
                    _beside(runs[j], int(a), int(b)) < _RIVAL * abs(share) for j in range(len(runs)) if j != i
                ):
                    part = off[a:b]
                    off[a:b] = np.where(np.abs(part) > abs(share), part, share)
        spans = [
            (*_trimmed(efforts.shares, i, a, b, float(np.median(off[a:b]))), float(np.median(off[a:b])))
            for a, b in runs_of(off != 0.0)
        ]
        found[i] = [(a, b, x) for a, b, x in spans if b > a and abs(x) > _FOUND_LEAST]
    return found


def _trimmed(shares: Shares, wheel: int, start: int, stop: int, share: float) -> tuple[int, int]:
    """A span from the first to the last of its steps that by itself is off the same way, by half as much."""
    way = np.sign(share) * np.sign(shares.expected[start:stop, wheel]) * shares.rest[start:stop, wheel]
    own = np.flatnonzero(
        way > 0.5 * abs(share) * np.maximum(np.abs(shares.expected[start:stop, wheel]), 0.5 * shares.usual[wheel])
    )
    return (start + int(own[0]), start + int(own[-1]) + 1) if own.size else (start, stop)


def _beside(runs: tuple[Array, NDArray[np.intp], NDArray[np.intp]], start: int, stop: int) -> float:
    """Largest share of another drive in steps [start, stop)."""
    shares, first, last = runs
    near = (first < stop) & (start < last)
    return float(np.max(np.abs(shares[near]), initial=0.0))


def _judged(
    drive: Assessment,
    wrong: Sequence[Finding],
    efforts: Efforts,
    i: int,
    spans: list[tuple[int, int, float]],
    mission: MissionView,
) -> Assessment:
    """A drive with what its effort shows; `wrong`: what is known of the speed sensors, beside which no effort tells."""
    length, size = efforts.steps.length, drive.states.size
    states = drive.states.copy()
    there = (*drive.findings, *wrong)
    more = []
    for a, b, share in spans:
        start, stop = a * length, min(b * length, size)
        if any(f.start < stop and start < f.stop for f in there):
            continue  # a drive that is known to fail, or a wrong speed, whose wheel pulls all others along
        more.append(_finding(efforts.wheels[i], start, stop, share, drive.tier, length * mission.timeline.dt))
        states[start:stop] = CODE[State(more[-1].mode.value)]
    powers = _powers(efforts, i, mission)
    why = _why_not(efforts, i, powers, mission, open_=bool(more))
    healthy = np.repeat(_seen(efforts, i, mission.machine), length)
    healthy = np.r_[healthy, np.zeros(size - healthy.size, bool)]
    told = replace(drive, findings=tuple(sorted((*drive.findings, *more), key=lambda f: f.start)), states=states)
    if why:
        reason = drive.reasons.get(State.NOT_ASSESSED, "")
        return replace(told, reasons={**told.reasons, State.NOT_ASSESSED: why if not reason or not more else reason})
    states[(states == CODE[State.NOT_ASSESSED]) & healthy] = CODE[State.HEALTHY]
    told = replace(told, states=states, powers=powers, notes=(*told.notes, _note(efforts, i)))
    return told.reasoned(State.NOT_ASSESSED, Reason(WOULD_HIDE))


def _why_not(efforts: Efforts, i: int, powers: Powers, mission: MissionView, *, open_: bool) -> str:
    """Why a drive is not called healthy where nothing is found; empty where it is."""
    model = efforts.models[i]
    if not is_asked(mission.machine, efforts.wheels[i]):
        return HIDDEN_BY_LOOP
    if model.held < _HELD:
        return NO_LOOP
    off = [np.max(np.abs(efforts.shares.over(i, n)[0]), initial=0.0) for n in (*LENGTHS_S[:-1], None)]
    if not open_ and any(x > limit_of(model, k) for k, x in enumerate(off)):
        return DIFFERS
    whole = powers.rows[-1].size
    return WOULD_HIDE if whole is None or whole > mission.machine.limits.clear_at else ""


def _note(efforts: Efforts, i: int) -> str:
    model, wheel = efforts.models[i], efforts.wheels[i]
    return (
        f"wheel.{wheel}.effort is what its motion took in {model.missions:.0f} healthy missions, within {100 * limit_of(model, _TRACED):.0f} % over "
        f"{LENGTHS_S[_TRACED]} s."
    )


def _pulls(efforts: Efforts, i: int, least_speed: float) -> Array:
    """The part of its effort that pulls in each step [unit of effort], shape (steps,)."""
    model, steps = efforts.models[i], efforts.steps
    terms = steps.terms(i, least_speed) @ np.array(model.terms)
    return np.asarray(np.nan_to_num(terms - model.viscous * steps.speed[:, i] - model.offset))


def _seen(efforts: Efforts, i: int, machine: Machine) -> Flags:
    """Steps within any stretch of driving over which a loss that counts would have shown, shape (steps,)."""
    loss = machine.limits.clear_at / (1.0 - machine.limits.clear_at)
    added = loss * _pulls(efforts, i, machine.limits.driving_speed)
    shares, first, last = efforts.shares.over(i, LENGTHS_S[_TRACED], added)
    seen = np.zeros(len(efforts.steps.use), bool)
    for a, b in zip(
        first[shares > limit_of(efforts.models[i], _TRACED)],
        last[shares > limit_of(efforts.models[i], _TRACED)],
        strict=True,
    ):
        seen[a:b] = True
    return seen


def _powers(efforts: Efforts, i: int, mission: MissionView) -> Powers:
    """Smallest loss of torque that its effort would have shown.

    A loss ε takes 1/(1 − ε) of the part of the effort that pulls: friction, acceleration and turning, not the part that grows with the speed, which for a
    duty or voltage is mostly the motor's own (e = R·i + K·ω, Krishnan, Electric Motor Drives, 2001, eq. 2.1).
    """
    model = efforts.models[i]
    pulls = _pulls(efforts, i, mission.machine.limits.driving_speed)
    rows = []
    for k, n in enumerate((*LENGTHS_S[:-1], None)):
        need = limit_of(model, k)
        smallest = np.array([])
        for loss in (0.6, 0.5, 0.4, 0.3, 0.25, 0.2, 0.15, 0.1):
            shares = efforts.shares.over(i, n, loss / (1.0 - loss) * pulls)[0]
            smallest = np.full(shares.size, np.inf) if not smallest.size else smallest
            smallest[shares > need] = loss
        size = float(np.quantile(smallest, _SURE, method="higher")) if smallest.size else np.inf
        share = float(np.mean(smallest <= mission.machine.limits.clear_at)) if smallest.size else None
        rows.append(
            Power(
                Deviation.INEFFICIENT,
                None if n is None else float(n),
                size if np.isfinite(size) else None,
                "1",
                share,
                int(smallest.size),
            )
        )
    return Powers(tuple(rows), Side.ACTUATOR)


def _finding(wheel: str, start: int, stop: int, share: float, tier: Tier, step_s: float) -> Finding:
    """A drive whose motion takes another effort than it took."""
    more = share > 0.0
    lost = share / (1.0 + share) if more else 1.0
    size = f"{100 * share:.0f} % more" if more else f"{-100 * share:.0f} % less"
    after = (
        "its motor makes less of it, or something holds the {wheel}, such as a brake or a bearing"
        if more
        else "others carry what it should, or its effort is read wrong"
    )
    text = f"wheel.{wheel}.effort is {size} than its motion took in healthy missions, and than the other {{wheels}}' efforts explain: {after}."
    mode = FaultMode.INEFFICIENT if more else FaultMode.OUTSIDE_TABLE
    shares = ((mode, _MORE), (FaultMode.OUTSIDE_TABLE, _P - _MORE)) if more else ((mode, _P),)
    hypotheses = (
        *(Hypothesis(Side.ACTUATOR.value, m.value, p) for m, p in shares),
        Hypothesis(Side.SENSOR.value, FaultMode.OUTSIDE_TABLE.value, _SENSOR),
        Hypothesis("none", State.HEALTHY.value, 1.0 - _P - _SENSOR),
    )
    return Finding(
        start=start, stop=stop, side=Side.ACTUATOR, mode=mode, probability=hypotheses[0].p, hypotheses=hypotheses,
        epsilon=Epsilon(lost, 0.5 * lost, min(1.0, 1.5 * lost)) if more else None, sat=None,
        evidence=(Sentence(About.EFFORT, text),), tier=tier,
    )  # fmt: skip
