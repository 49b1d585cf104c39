"""Wheels beside a steering sensor that fails: what each should do follows from the angles, so that models of wheels err with them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from diagnosis.results.assessment import Assessment, Finding
from diagnosis.results.limited import limited
from diagnosis.results.vocabulary import Tier
from replay.faults import Side

#: A component and its side.
Part = tuple[str, str]

_MOST = 0.65  # how often a partial fault beside one that explains it was right
_INSIDE = 0.5  # of its time
_WHY = "Meanwhile a steering sensor fails, or may, from whose angle follows what this part should do, which makes the fault less probable."


def less_sure_beside_wrong_angles(
    assessments: Mapping[Part, Assessment], wheels: Sequence[str], axles: Sequence[str]
) -> dict[Part, Assessment]:
    """Assessments in which partial faults of wheels that only a model shows are less sure while a steering angle is, or may be, wrong.

    Parameters
    ----------
    assessments : Mapping[tuple[str, str], Assessment]
        By component and side.
    wheels, axles : Sequence[str]
        Names of the machine's parts.
    """
    wrong = [f for a in axles for f in _findings(assessments, (a, Side.SENSOR.value))]
    if not wrong:
        return dict(assessments)
    out = dict(assessments)
    for wheel in wheels:
        for side in (Side.SENSOR.value, Side.ACTUATOR.value):
            if found := _findings(assessments, (wheel, side)):
                told = tuple(limited(f, _MOST, _WHY) if _doubtful(f, wrong) else f for f in found)
                out[wheel, side] = replace(assessments[wheel, side], findings=told)
    return out


def _findings(assessments: Mapping[Part, Assessment], part: Part) -> tuple[Finding, ...]:
    return assessments[part].findings if part in assessments else ()


def _doubtful(f: Finding, wrong: Sequence[Finding]) -> bool:
    if f.tier is not Tier.MODEL or f.mode.total or f.mode.varying:
        return False  # nothing dies or shakes by a wrong angle
    return any(min(f.stop, w.stop) - max(f.start, w.start) > _INSIDE * (f.stop - f.start) for w in wrong)
