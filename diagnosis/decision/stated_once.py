"""A fault of either side that a model shows is not stated again where a second measurement shows which side it is.

A model of a wheel that errs while the wheel's own valve is seen to be off its command, or its sensor off a second one, errs for that.
What it says of either side is that fault once more, without knowing the side.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from diagnosis.results.assessment import CODE, Assessment, Finding
from diagnosis.results.vocabulary import Tier
from replay.faults import Side, State

_SURE, _INSIDE = 0.9, 0.5  # of any fault that is measured; of the time of what is stated again
Part = tuple[str, str]


def without_restated(assessments: Mapping[Part, Assessment], dt: float) -> dict[Part, Assessment]:
    """Assessments without what a model states of either side while a fault of one of them is measured; there the other side is not assessed.

    Parameters
    ----------
    assessments : Mapping[tuple[str, str], Assessment]
        By component and side.
    dt : float
        Step [s].
    """
    measured: dict[str, dict[int, Finding]] = {}
    for (component, _), a in assessments.items():
        measured.setdefault(component, {}).update({id(f): f for f in a.findings if _is_measured(f)})
    return {part: _without(a, list(measured[part[0]].values()), dt) for part, a in assessments.items()}


def _is_measured(f: Finding) -> bool:
    faulty = 1.0 - sum(h.p for h in f.hypotheses if h.mode == State.HEALTHY.value)
    return f.tier is Tier.DIRECT and f.side is not Side.SENSOR_OR_ACTUATOR and faulty >= _SURE


def _without(a: Assessment, measured: Sequence[Finding], dt: float) -> Assessment:
    again = [f for f in a.findings if _is_again(f, measured, a.states.size)]
    if not again:
        return a
    states, hidden = a.states.copy(), 0
    for f in again:
        inside = states[f.start : f.stop]
        own = inside == CODE[State(f.mode.value)]
        inside[own] = CODE[State.NOT_ASSESSED]
        hidden += int(np.count_nonzero(own))
    kept = tuple(f for f in a.findings if not any(f is g for g in again))
    return replace(a, states=states, findings=kept, unexplained_s=a.unexplained_s + hidden * dt)


def _is_again(f: Finding, measured: Sequence[Finding], size: int) -> bool:
    """Whether a model states a fault of either side, for the most part of its time beside measured ones."""
    if f.side is not Side.SENSOR_OR_ACTUATOR or f.tier is not Tier.MODEL or not measured:
        return False
    covered = np.zeros(size, np.bool_)
    for g in measured:
        covered[g.start : g.stop] = True
    return bool(np.mean(covered[f.start : f.stop]) >= _INSIDE)
