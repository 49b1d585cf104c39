"""Why the size of a fault is not known, or open to a side, in a sentence."""

from __future__ import annotations

import re

from diagnosis.results.assessment import Finding
from diagnosis.results.open_sizes import WHOLE, open_bounds
from diagnosis.results.result import Epsilon
from diagnosis.results.vocabulary import Kind, Tier
from replay.faults import FaultMode

_GROWS = 0.1  # from first to last
#: What `diagnosis.estimation.simple_causes` says of a loss that changes.
_COURSE = re.compile(r" is (\d\.\d+) at first and (\d\.\d+) at last of ")


def size_note(finding: Finding, epsilon: Epsilon | None, kind: Kind) -> str:
    """How a size changed, and why ε̂ of a fault is missing, or bounded to one side at most; empty where both bounds say something.

    Parameters
    ----------
    finding : Finding
        The fault.
    epsilon : Epsilon or None
        Its ε̂ as it is stated, with its 95 % bounds.
    kind : Kind
        Of its part.
    """
    if epsilon is None:
        return _missing(finding.mode)
    if finding.mode is FaultMode.OUTSIDE_TABLE:
        return ""
    if finding.mode.total:
        if epsilon.low >= WHOLE:
            return ""
        return "By its row all is lost (ε̂ = 1); the lower bound is less, for other rows come into question, too."
    course = _course(finding)
    low, high = open_bounds(epsilon.low, epsilon.high)
    if course or not (low or high):
        return course
    open_ = (
        "Neither bound of ε̂ says anything: the size may be anything, whatever the probability that something is wrong"
        if low and high
        else "The lower bound of ε̂ is open, which speaks of the size alone: that something is wrong is as sure as its probability says"
        if low
        else "The upper bound of ε̂ is open, so that all may be lost"
    )
    why = _why(finding, kind)
    return f"{open_}. {why[:1].upper()}{why[1:]}."


def _course(finding: Finding) -> str:
    """What is lost at first and at last of a loss that grows, of which ε̂ is the mean; empty of any other."""
    found = next((m for m in map(_COURSE.search, finding.evidence) if m), None)
    if found is None or finding.mode is not FaultMode.INEFFICIENT:
        return ""
    first, last = (1.0 - float(x) for x in found.groups())
    if last - first < _GROWS:
        return ""
    return f"It grows: {100 * max(first, 0.0):.0f} % are lost at first, {100 * last:.0f} % at last; ε̂ and its bounds are of all that time."


def _missing(mode: FaultMode) -> str:
    """Why there is no ε̂ at all."""
    if mode.varying:
        return "No ε̂ is stated: what varies does not tell how much of the signal itself is lost."
    if mode is FaultMode.OUTSIDE_TABLE:
        return "No ε̂ is stated: what deviates is no share of the signal."
    return "No ε̂ is stated: the readings do not tell how much is lost."


def _why(finding: Finding, kind: Kind) -> str:
    """What keeps a bound of ε̂ open."""
    if finding.mode.varying:
        return "noise hides how much of the signal itself is left"
    if finding.tier is Tier.MODEL and kind is Kind.WHEEL:
        return "the bounds hold how far a model of the wheel may itself be off; a second measurement narrows them"
    return "in the time of the fault the part was moved too little, or deviates too unevenly, to say more"
