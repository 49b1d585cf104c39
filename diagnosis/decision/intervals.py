"""From findings and states of single parts to the mission's faults and spans."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from diagnosis.decision.advice import check_of_all
from diagnosis.decision.company import in_company
from diagnosis.decision.lengths import with_lengths_told
from diagnosis.decision.severity import severity_of
from diagnosis.decision.size_notes import size_note
from diagnosis.results.assessment import LEAST_SHARE, STATES, Assessment, Finding
from diagnosis.results.machine_words import MachineWords
from diagnosis.results.plain_numbers import with_minus_signs
from diagnosis.results.result import Epsilon, FaultInterval, Sat, StateSpan
from diagnosis.results.sentence import About, about_of, is_about, mapped
from diagnosis.results.vocabulary import Kind, Tier
from replay.faults import FaultMode, Side, State
from replay.machine.config import Machine

#: 95 % of the errors of a wheel's ε̂ by its model, on tuning seeds: what a loop makes up for hides a sensor's size more than a valve's.
_MODEL_LOSS = {Side.SENSOR: 0.45, Side.ACTUATOR: 0.3, Side.SENSOR_OR_ACTUATOR: 0.45}
_WORTH = 0.1  # of the probability that is left for a healthy part: worth a sentence
#: A component and its side.
Part = tuple[str, str]


def intervals_of(
    assessments: Mapping[Part, Assessment], machine: Machine, words: MachineWords, start_ns: int, step_ns: int
) -> tuple[FaultInterval, ...]:
    """Number the findings of all components: worst first, then by time; a shared finding counts once."""
    found: dict[tuple[str, str, int, int], FaultInterval] = {}
    for (component, _), assessment in assessments.items():
        kind = Kind.STEER if component in machine.axles else Kind.WHEEL
        for own in assessment.findings:
            f = replace(own, epsilon=_bounded(own, kind))
            seconds = (f.stop - f.start) * step_ns * 1e-9
            told = (*with_lengths_told(f.evidence, seconds), *f.course)
            told = tuple(mapped(text, with_minus_signs) for text in told)
            severity, advice = severity_of(f, seconds, machine.limits, words, kind)
            found[component, f.side, f.start, f.stop] = FaultInterval(
                id="",
                component=component,
                kind=kind,
                side=f.side,
                mode=f.mode,
                start_s=f.start * step_ns * 1e-9,
                stop_s=f.stop * step_ns * 1e-9,
                start_ns=start_ns + f.start * step_ns,
                stop_ns=start_ns + f.stop * step_ns,
                epsilon=f.epsilon,
                sat=_of_any_share(f),
                probability=f.probability,
                hypotheses=f.hypotheses,
                severity=severity,
                advice=advice,
                size_note=size_note(f, f.epsilon, kind),
                check=check_of_all(kind, component, f.side, f.mode, f.hypotheses, words, machine.advice),
                evidence=told,
                about=tuple(about_of(told)),
                tier=f.tier,
                detected_s=None if f.detected is None else f.detected * step_ns * 1e-9,
            )
    ordered = sorted(found.values(), key=lambda x: (-x.severity.rank, x.start_s, x.component, x.side))
    numbered = [replace(f, id=f"F{i + 1}") for i, f in enumerate(ordered)]
    return tuple(map(_with_what_is_left, in_company(numbered)))


def _with_what_is_left(f: FaultInterval) -> FaultInterval:
    """The same saying why a healthy part is left so much, although the readings are so much more probable with the fault, where that is so."""
    health = sum(h.p for h in f.hypotheses if h.mode == State.HEALTHY.value)
    if health < _WORTH or not any(is_about(text, About.TIMES) for text in f.evidence):
        return f
    evidence = (
        *f.evidence,
        f"How many times as probable it is speaks of the readings alone; what else is said here of such findings leaves {100 * health:.1f} % "
        "for a healthy part.",
    )
    return replace(f, evidence=evidence, about=tuple(about_of(evidence)))


def _bounded(f: Finding, kind: Kind) -> Epsilon | None:
    """ε̂ with bounds that hold: those of a model's own covariance leave out how far the model itself is off."""
    e = f.epsilon
    if e is None or f.tier is not Tier.MODEL or kind is not Kind.WHEEL or f.mode is not FaultMode.INEFFICIENT:
        return e
    most = _MODEL_LOSS[f.side]
    return Epsilon(e.value, max(0.0, min(e.low, e.value - most)), min(1.0, max(e.high, e.value + most)))


def _of_any_share(f: Finding) -> Sat | None:
    """The saturation term with bounds that hold for every ε̂ within its own: of noise ε·sat is known, and sat is that by ε."""
    e, sat = f.epsilon, f.sat
    if e is None or sat is None or not f.mode.varying or e.value <= 0.0:
        return sat
    shares = (max(e.low, LEAST_SHARE), max(e.high, LEAST_SHARE))
    ends = [e.value * bound / share for bound in (sat.low, sat.high) for share in shares]
    return replace(sat, low=min(sat.low, *ends), high=max(sat.high, *ends)).as_possible()


def spans_of(assessments: Mapping[Part, Assessment], step_ns: int) -> tuple[StateSpan, ...]:
    """States of every component and side as spans without gaps."""
    out = []
    for (component, side), assessment in assessments.items():
        codes = assessment.states
        cut = np.flatnonzero(np.r_[True, codes[1:] != codes[:-1]])
        for a, b in zip(cut, np.r_[cut[1:], codes.size], strict=True):
            state = STATES[int(codes[a])]
            out.append(
                StateSpan(
                    component=component,
                    side="sensor" if side == "sensor" else "actuator",
                    state=state,
                    start_s=float(a) * step_ns * 1e-9,
                    stop_s=float(b) * step_ns * 1e-9,
                    reason=assessment.reasons.get(state, ""),
                )
            )
    return tuple(out)
