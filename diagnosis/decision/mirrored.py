"""Steering angles of which all read −1 times what they should: a sign in the machine file, or exchanged plugs, and no part's fault."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence, Set

from diagnosis.clearing.backwards import without_findings
from diagnosis.results.assessment import Assessment, Finding
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side

#: A component and its side.
Part = tuple[str, str]

_MIRRORED = 1.7, 2.3  # size of what reads −1 times what it should: 1 − (−1), with room
_THROUGHOUT = 0.85  # of the mission, from the first steering on


def mirrored(f: Finding) -> bool:
    """Whether a finding says that a channel reads about −1 times what it should."""
    return f.mode is FaultMode.OUTSIDE_TABLE and f.epsilon is not None and _MIRRORED[0] < f.epsilon.value < _MIRRORED[1]


def all_mirrored(assessments: Mapping[Part, Assessment], axles: Sequence[str]) -> str:
    """What is wrong with the settings where every one of several steering angles reads −1 times what it should; else empty.

    One mirrored sensor may be wired the wrong way round; all of them are a sign in the machine file, or plugs that were exchanged.

    Parameters
    ----------
    assessments : Mapping[tuple[str, str], Assessment]
        By component and side.
    axles : Sequence[str]
        Steering axles.
    """
    sensors = [a for axle in axles if (a := assessments.get((axle, Side.SENSOR.value))) is not None]
    if len(axles) < 2 or len(sensors) < len(axles):
        return ""
    for a in sensors:
        if sum(f.stop - f.start for f in a.findings if mirrored(f)) < _THROUGHOUT * a.states.size:
            return ""
    *names, last = (f"steer.{axle}.phi" for axle in axles)
    every = "both" if len(axles) == 2 else "all"
    return f"{', '.join(names)} and {last} have the wrong sign, or their plugs are exchanged: {every} read −1 times what they should"


def axles_in_doubt(doubts: Sequence[str], axles: Sequence[str]) -> set[str]:
    """All steering axles where some doubts name the angle of every one: of signs, of axles that are exchanged; else none.

    One of several that is in doubt may be a sensor that is mounted the other way round.
    """
    named = {m for doubt in doubts for m in re.findall(r"\bsteer\.(\w+)", doubt)}
    return {*axles} if named >= {*axles} else set()


def without_mirrored(assessments: Mapping[Part, Assessment], axles: Set[str], dt: float) -> dict[Part, Assessment]:
    """Assessments without what models claim of axles whose angles the settings have wrong, and without that these are mirrored.

    Parameters
    ----------
    assessments : Mapping[tuple[str, str], Assessment]
        By component and side.
    axles : Set[str]
        Axles in doubt.
    dt : float
        Sample [s].
    """
    return {
        part: without_findings(a, [f for f in a.findings if mirrored(f) or f.tier is not Tier.DIRECT], dt)
        if part[0] in axles
        else a
        for part, a in assessments.items()
    }
