"""Findings that are no more probable than something beside their own evidence allows."""

from __future__ import annotations

from dataclasses import replace

from diagnosis.results.assessment import Assessment, Finding
from diagnosis.results.result import Hypothesis
from replay.faults import FaultMode, State

#: What a side and row may be claimed with, whatever the models said: of 1455 surest findings on machines of sixteen kinds all but 3 were right once
#: disturbed valves were told as such, of 2078 older ones, of all machines, all but 13 were on the right part; other users' machines may do worse.
MOST_CLAIMED = 0.98


def limited(finding: Finding, most: float, why: str) -> Finding:
    """A finding that is at most so probable, with a sentence that says why; what is missing goes to no fault."""
    if finding.probability <= most:
        return finding
    share = most / finding.probability
    named = [replace(h, p=h.p * share) for h in finding.hypotheses]
    faults = [h for h in named if h.mode != State.HEALTHY.value]
    none = Hypothesis("none", State.HEALTHY.value, 1.0 - sum(h.p for h in faults))
    hypotheses = tuple(sorted([*faults, none], key=lambda h: -h.p))
    return replace(finding, probability=most, hypotheses=hypotheses, evidence=(*finding.evidence, why))


def believed(found: Assessment) -> Assessment:
    """The same with no finding more probable than the surest ones turned out to be; what is missing goes to the part's other rows."""
    return replace(found, findings=tuple(map(_believed, found.findings)))


def _believed(finding: Finding) -> Finding:
    if finding.probability <= MOST_CLAIMED:
        return finding
    sides = [side.value for side in finding.side.sides]
    claimed = {(side, finding.mode.value) for side in (*sides, finding.side.value)}
    kept = {(h.side, h.mode): h.p for h in finding.hypotheses}
    others = [(side, mode.value) for side in sides for mode in FaultMode if (side, mode.value) not in claimed]
    missing = finding.probability - MOST_CLAIMED
    for row in claimed & set(kept):
        kept[row] *= MOST_CLAIMED / finding.probability
    for row in others:
        kept[row] = kept.get(row, 0.0) + missing / len(others)
    hypotheses = [Hypothesis(side, mode, p) for (side, mode), p in kept.items()]
    return replace(finding, probability=MOST_CLAIMED, hypotheses=tuple(sorted(hypotheses, key=lambda h: -h.p)))
