"""Assessments with the faults that checks of the all-clear leave no doubt about, beside what was found before."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from diagnosis.clearing.backwards import without_findings
from diagnosis.results.assessment import CODE, Assessment, Finding
from diagnosis.results.limited import limited
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side, State

#: A component and its side.
Part = tuple[str, str]

_BESIDE = 0.65  # how often a partial fault beside one of the other side was right
_LESS_SURE = "The other side has a fault that no row explains, which makes this one less probable."
_MOSTLY = 0.5  # of the time of a fault
#: States that a fault takes the place of; that a wheel slips, or its sensor is faulty, says no more than not assessed does.
_OPEN = (CODE[State.HEALTHY], CODE[State.NOT_ASSESSED], CODE[State.SLIP])
_COMMANDED = (*_OPEN, CODE[State.NOT_EXCITED])  # an axle that stands still under its command is excited


def with_findings(
    assessments: Mapping[Part, Assessment], found: Mapping[str, Finding], dt: float
) -> dict[Part, Assessment]:
    """Assessments with one more fault of the sides that it may be of; what a model finds on the other side beside it is less sure. `dt` in s."""
    out = {}
    for (component, side), a in assessments.items():
        finding = found.get(component)
        if finding is None:
            out[component, side] = a
        elif Side(side) in finding.side.sides:
            out[component, side] = _with(a, finding, dt)
        else:
            own = (
                limited(f, _BESIDE, _LESS_SURE) if f.tier is Tier.MODEL and not f.mode.total else f for f in a.findings
            )
            out[component, side] = replace(a, findings=tuple(own))
    return out


def _says_it(f: Finding, other: Finding) -> bool:
    """Whether a finding is the same row as another one, less probable and mostly inside of its time."""
    common = min(f.stop, other.stop) - max(f.start, other.start)
    less = (f.side, f.mode) == (other.side, other.mode) and f.probability <= other.probability
    return less and common > _MOSTLY * (f.stop - f.start)


def _with(a: Assessment, finding: Finding, dt: float) -> Assessment:
    """An assessment with one more fault, which a less probable one of the same row says once more, mostly inside of it."""
    a = without_findings(a, [f for f in a.findings if _says_it(f, finding)], dt)
    states = a.states.copy()
    inside = states[finding.start : finding.stop]
    inside[np.isin(inside, _COMMANDED if finding.mode is FaultMode.NO_SIGNAL else _OPEN)] = CODE[
        State(finding.mode.value)
    ]
    return replace(a, states=states, findings=tuple(sorted((*a.findings, finding), key=lambda f: f.start)))
