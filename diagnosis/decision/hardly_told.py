"""Findings of wheels that hardly tell a fault from none: too brief for their row, or of a size that may be nothing.

Noise of a speed sensor that was over within 2 s was right 0 of 9 times on simulated machines of twenty kinds, whatever showed it; from 2.5 s on 397 of
403 times. A healthy valve that lagged for 2.5 s had lost 0.12 (95 %: none to 0.29).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace

from diagnosis.results.assessment import Assessment, Finding
from diagnosis.results.limited import not_worth_a_check
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side

_BRIEF_S = 2.0
_NOTHING, _SMALL = 0.05, 0.2  # a loss, or gain, that is none; a loss that is none to act on
_OVER = (
    "Noise of a speed that is over as soon as this has rarely been its sensor's fault, which makes it less probable."
)
_MAY_BE_NONE = "Its own bounds hardly tell this loss from none, which makes it less probable."
_GAIN = "By its bounds the gain may be 1, and it is over at once, which makes it less probable."
Part = tuple[str, str]


def with_hardly_told(
    assessments: Mapping[Part, Assessment], axles: Collection[str], dt: float
) -> dict[Part, Assessment]:
    """Assessments in which what hardly tells a fault from none is no longer worth a check.

    Parameters
    ----------
    assessments : Mapping[tuple[str, str], Assessment]
        By component and side.
    axles : Collection[str]
        Which components are axles: they stay.
    dt : float
        Step [s].
    """
    return {part: a if part[0] in axles else _told(a, dt) for part, a in assessments.items()}


def _told(a: Assessment, dt: float) -> Assessment:
    told = tuple(_less(f, (f.stop - f.start) * dt) for f in a.findings)
    return a if all(f is g for f, g in zip(told, a.findings, strict=True)) else replace(a, findings=told)


def _less(f: Finding, seconds: float) -> Finding:
    brief = seconds < _BRIEF_S
    if f.tier not in (Tier.DIRECT, Tier.MODEL):
        return f
    if brief and (f.side, f.mode) == (Side.SENSOR, FaultMode.NOISY):
        return not_worth_a_check(f, _OVER)
    e = f.epsilon
    if f.tier is not Tier.DIRECT or e is None or e.low >= _NOTHING or e.high <= -_NOTHING:
        return f
    if f.mode is FaultMode.INEFFICIENT:
        return not_worth_a_check(f, _MAY_BE_NONE) if e.value < _SMALL else f
    return not_worth_a_check(f, _GAIN) if brief and f.mode is FaultMode.OUTSIDE_TABLE else f
