"""Noise of a valve is its row only where it stands alone and lasts: what passes into another row, or is over at once, hardly is noise.

A valve that is off by a constant, loses a share that changes, or opens in steps is told as one row after another, each of which fits
for a while; the noisy one, which fits anything, fits longest. Of 17 such findings with p ≥ 0.9 on tuning logs of fifteen machines none was
right, and none of 7 that were brief; of 14 of wheels' valves that stood alone and lasted 11 were.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace

from diagnosis.results.assessment import Assessment, Finding
from diagnosis.results.limited import limited, not_worth_a_check
from diagnosis.results.result import Hypothesis
from replay.faults import FaultMode, Side

_TOUCHES_S = 0.7  # from one finding to the next
_BRIEF_S, _BRIEF_STEERING_S = 2.5, 4.0  # of noise: of steering valves none of 3 was right (tuning)
_HALF, _MOST_STEERING = 0.5, 0.6  # of what is claimed of it; set by hand
_PASSES = "It passes into another fault of this part with hardly a moment between: a fault that no row of the tables describes looks so, too."
_OVER = "Noise that is over as soon as this has rarely been a fault of such a part, which makes it less probable."
Part = tuple[str, str]


def with_doubted_noise(
    assessments: Mapping[Part, Assessment], axles: Collection[str], dt: float
) -> dict[Part, Assessment]:
    """Assessments in which noise of valves is less sure where it is brief, and may be in no row where another fault touches it.

    Parameters
    ----------
    assessments : Mapping[tuple[str, str], Assessment]
        By component and side.
    axles : Collection[str]
        Which components are axles: what a model leaves out of a motion lasts longer there.
    dt : float
        Step [s].
    """
    return {
        part: _doubted(a, dt, steering=part[0] in axles) if part[1] == Side.ACTUATOR else a
        for part, a in assessments.items()
    }


def _doubted(a: Assessment, dt: float, *, steering: bool) -> Assessment:
    told = tuple(_told(f, [g for g in a.findings if g is not f], dt, steering=steering) for f in a.findings)
    same = all(f is g for f, g in zip(told, a.findings, strict=True))
    return a if same else replace(a, findings=told)


def _told(f: Finding, others: list[Finding], dt: float, *, steering: bool) -> Finding:
    if (f.side, f.mode) != (Side.ACTUATOR, FaultMode.NOISY):
        return f
    if f.probability > _MOST_STEERING and any(g.mode is not f.mode and _gap(f, g) * dt < _TOUCHES_S for g in others):
        return _or_in_no_row(f)
    seconds = (f.stop - f.start) * dt
    if steering:
        return limited(f, _MOST_STEERING, _OVER) if seconds < _BRIEF_STEERING_S else f
    return not_worth_a_check(f, _OVER) if seconds < _BRIEF_S else f


def _gap(a: Finding, b: Finding) -> int:
    return max(a.start, b.start) - min(a.stop, b.stop)


def _or_in_no_row(f: Finding) -> Finding:
    """A noisy valve as one that is in no row as well, as probably."""
    own, none = (f.side.value, f.mode.value), (f.side.value, FaultMode.OUTSIDE_TABLE.value)
    p = {(h.side, h.mode): h.p for h in f.hypotheses}
    both = p.get(own, 0.0) + p.get(none, 0.0)
    p |= {own: _HALF * both, none: (1.0 - _HALF) * both}
    named = sorted((Hypothesis(*row, share) for row, share in p.items()), key=lambda h: -h.p)
    return replace(f, probability=p[own], hypotheses=tuple(named), evidence=(*f.evidence, _PASSES))
