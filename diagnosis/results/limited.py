"""Findings that are no more probable than something beside their own evidence allows."""

from __future__ import annotations

from dataclasses import replace

from diagnosis.results.assessment import Assessment, Finding
from diagnosis.results.result import Hypothesis
from replay.faults import FaultMode, State

#: What a side and row may be claimed with, whatever the models said: of 705 surest findings on machines of eighteen kinds 98 of 100 were right (tuning), of
#: 1193 on the simulator's own and `foreign` 99; what was wrong was nearly always another row of the same part.
MOST_CLAIMED = 0.98
#: Any fault at most, where something else made it up, or none explains it as well: less than is worth a check; set by hand.
MADE_UP = 0.55


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


def not_worth_a_check(finding: Finding, why: str) -> Finding:
    """A finding of which any fault is less probable than what is worth a check, with a sentence that says why."""
    faulty = sum(h.p for h in finding.hypotheses if h.mode != State.HEALTHY.value)
    return limited(finding, finding.probability * MADE_UP / faulty, why) if faulty > MADE_UP else finding


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
