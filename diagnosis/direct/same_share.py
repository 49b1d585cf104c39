"""A part of a fault in which nothing moves, as what it is where the channel moved: the same gain.

A part that sticks does not stick at just the share of its command that it loses, or adds, elsewhere.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.sample_status import PAIR
from diagnosis.direct.identification import IdentifiedPair
from diagnosis.direct.sentences import bounds_words
from diagnosis.results.assessment import Finding
from diagnosis.results.result import Epsilon, Hypothesis
from diagnosis.results.sentence import About, is_about, stated_anew
from replay.faults import FaultMode

Array = NDArray[np.float64]

_LOST = 0.03  # of the span: a saturation term that is hardly one
_ALIKE_P = 0.3  # probability of each of two rows that a constant cannot tell
_ONE_GAIN, _SAME_P = 0.05, 0.95  # of a gain; that a share which is lost elsewhere too is one
_SLOW = 0.1  # of its mean, by which a reference changes that hardly moves
_END, _SELDOM = 0.95, 0.05  # of the largest value that a channel ever has; of the time
_CONSTANT_OR_GAIN = {FaultMode.STUCK.value, FaultMode.INEFFICIENT.value, FaultMode.OUTSIDE_TABLE.value}
_SAME_SHARE = "The same share is lost in another fault of this part that shows it better; the bounds are of both."
_SAME_EXCESS = "The same excess shows in another fault of this part, where its reference moved."
_AT_ITS_END = "It stands at its end: by the excess that another fault of this part shows, it is told to go beyond."


def as_beside(finding: Finding, all_of_them: Sequence[Finding], found: IdentifiedPair) -> Finding:
    """A share of a constant, or one of which little else is left, as what it is where the channel moved: the same loss of gain.

    A part that sticks does not stick at just that share of its command, and noise does not leave it.
    """
    p = {h.mode: h.p for h in finding.hypotheses}
    size, likely = finding.epsilon, p.get(FaultMode.INEFFICIENT, 0.0)
    if size is None:
        return finding
    lost = size.low if finding.mode is FaultMode.STUCK else size.value
    still = (
        finding.mode in (FaultMode.STUCK, FaultMode.INEFFICIENT)
        and likely == p.get(FaultMode.STUCK, 0.0)
        and likely >= _ALIKE_P
    )
    calm = finding.mode.varying and finding.sat is not None and finding.sat.rms * lost <= _LOST * found.pair.span
    share = _share_of_slow(finding, found) if finding.mode is FaultMode.STUCK and not still else None
    lost = lost if share is None else 1.0 - share
    beside = (f.epsilon for f in all_of_them if f.mode is FaultMode.INEFFICIENT and f.probability > 2 * _ALIKE_P)
    if not (still or calm or share is not None) or not any(
        e is not None and abs(e.value - lost) <= _ONE_GAIN for e in beside
    ):
        return finding
    both = 2 * likely if still else likely + p[finding.mode]
    p |= {FaultMode.STUCK if still else finding.mode: (1.0 - _SAME_P) * both, FaultMode.INEFFICIENT: _SAME_P * both}
    bounds = bounds_words(1 - lost - _ONE_GAIN, 1 - lost + _ONE_GAIN)
    said = (e for e in finding.evidence if not is_about(e, About.SAT))
    return replace(
        finding,
        mode=FaultMode.INEFFICIENT,
        probability=p[FaultMode.INEFFICIENT],
        hypotheses=tuple(sorted((replace(h, p=p[h.mode]) for h in finding.hypotheses), key=lambda h: -h.p)),
        epsilon=Epsilon(lost, lost - _ONE_GAIN, lost + _ONE_GAIN),
        sat=None,
        evidence=(*(stated_anew(e, About.SHARE, bounds) for e in said), _SAME_SHARE),
    )


def as_excess_beside(finding: Finding, all_of_them: Sequence[Finding], found: IdentifiedPair) -> Finding:
    """A constant that is more than its reference as the gain above 1 that another fault of this part shows, or as its end.

    Parameters
    ----------
    finding : Finding
        Of one part.
    all_of_them : Sequence[Finding]
        All of it.
    found : IdentifiedPair
        Its channel and reference.
    """
    beside = [f.epsilon for f in all_of_them if f.mode is FaultMode.OUTSIDE_TABLE and f.epsilon and f.epsilon.value < 0]
    if finding.mode not in (FaultMode.STUCK, FaultMode.INEFFICIENT) or not beside:
        return finding
    y, x = _both(finding, found)
    at, told = (float(np.median(z)) if z.size else 0.0 for z in (y, x))
    if at * told <= 0.0 or abs(at) <= abs(told):
        return finding
    gain = at / told
    slow = float(np.std(x)) <= _SLOW * abs(told)
    same = slow and any(1.0 - e.high <= gain <= 1.0 - e.low for e in beside)
    most = max(1.0 - e.value for e in beside)
    end = _END * float(np.nanmax(np.abs(found.pair.y)))  # what it is told there is more than that
    ends = abs(at) >= end and most * float(np.quantile(np.abs(x), _SELDOM)) >= _END * end
    if not (same or ends):
        return finding
    gain = gain if same else most
    told_p = sum(h.p for h in finding.hypotheses if h.mode in _CONSTANT_OR_GAIN)
    rest = [h for h in finding.hypotheses if h.mode not in _CONSTANT_OR_GAIN]
    parts = ((FaultMode.OUTSIDE_TABLE, _SAME_P * told_p), (FaultMode.STUCK, (1.0 - _SAME_P) * told_p))
    named = [Hypothesis(finding.side.value, mode.value, p) for mode, p in parts]
    return replace(
        finding,
        mode=FaultMode.OUTSIDE_TABLE,
        probability=named[0].p,
        hypotheses=tuple(sorted([*named, *rest], key=lambda h: -h.p)),
        epsilon=Epsilon(1.0 - gain, 1.0 - gain - _ONE_GAIN, 1.0 - gain + _ONE_GAIN),
        sat=None,
        evidence=(*finding.evidence, _SAME_EXCESS if same else _AT_ITS_END),
    )


def _share_of_slow(finding: Finding, found: IdentifiedPair) -> float | None:
    """What a value is of a reference that moves by little meanwhile [1]; None where it is no share of it."""
    y, x = _both(finding, found)
    middle = float(np.mean(x)) if x.size else 0.0
    if middle == 0.0 or float(np.std(x)) > _SLOW * abs(middle):
        return None
    share = float(np.mean(y)) / middle
    return share if 0.0 < share < 1.0 else None


def _both(finding: Finding, found: IdentifiedPair) -> tuple[Array, Array]:
    """Values of a finding's channel and reference, shape (n,) each [unit]."""
    y, x, status, *_ = found.samples.part(finding.start, finding.stop)
    return y[status == PAIR], x[status == PAIR]
