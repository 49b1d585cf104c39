"""Findings that are no more probable than something beside their own evidence allows."""

from __future__ import annotations

from dataclasses import replace

from diagnosis.results.assessment import Finding
from diagnosis.results.result import Hypothesis
from replay.faults import State


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
