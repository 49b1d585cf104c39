"""Parts whose channel counts backwards, or is another one's: no model says anything of them before the machine file is right."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Set
from dataclasses import replace

from diagnosis.results.assessment import CODE, Assessment, Finding
from diagnosis.results.vocabulary import Tier
from replay.faults import State

#: A component and its side.
Part = tuple[str, str]


def without_claims(
    assessments: Mapping[Part, Assessment], components: Set[str], exchanged: Set[str], dt: float
) -> dict[Part, Assessment]:
    """Assessments of which those of some components state what second measurements show, and nothing that a model claims; of others nothing.

    Parameters
    ----------
    assessments : Mapping[tuple[str, str], Assessment]
        By component and side.
    components : Set[str]
        Wheels and axles of which a channel runs against what it should follow.
    exchanged : Set[str]
        Those whose measured openings follow each other's commands.
    dt : float
        Sample [s].
    """
    return {
        part: without_findings(a, [f for f in a.findings if part[0] in exchanged or f.tier is not Tier.DIRECT], dt)
        if part[0] in components | exchanged
        else a
        for part, a in assessments.items()
    }


def shown_alone(assessments: Mapping[Part, Assessment], dt: float) -> dict[Part, Assessment]:
    """Assessments with what second measurements and channels show by themselves: of a machine that stands in for one with other wheels no model holds.

    Parameters
    ----------
    assessments : Mapping[tuple[str, str], Assessment]
        By component and side.
    dt : float
        Sample [s].
    """
    alone = (Tier.DIRECT, Tier.SIGNAL)
    return {
        part: without_findings(a, [f for f in a.findings if f.tier not in alone], dt) for part, a in assessments.items()
    }


def without_findings(a: Assessment, claimed: Collection[Finding], dt: float) -> Assessment:
    """The same without some of its findings: what they claim is not assessed. `dt` in s."""
    if not claimed:
        return a
    states, seconds = a.states.copy(), 0.0
    for f in claimed:
        states[f.start : f.stop] = CODE[State.NOT_ASSESSED]
        seconds += (f.stop - f.start) * dt
    kept = tuple(f for f in a.findings if f not in claimed)
    return replace(a, states=states, findings=kept, unexplained_s=a.unexplained_s + seconds)
