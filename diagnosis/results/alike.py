"""A channel that stays where it is beside a reference that does: stuck, or off by a constant."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.assessment import Finding
from diagnosis.results.result import Hypothesis
from replay.faults import FaultMode

Array = NDArray[np.float64]

_MOVES = 0.15  # of what it is off by: a reference that moves over less tells a constant channel from no shifted one
_SHIFTED = 0.4  # of such a channel that seems stuck: that it is off by a constant
_FEW = 5

#: Says so.
SHIFTED_SENTENCE = "What it should show hardly moved meanwhile: off by a constant it would read the same."


def hardly_moves(y: Array, x: Array, most: float = np.inf) -> bool:
    """Whether a reference moves over little beside what a channel is off by, which is no more than `most`.

    Parameters
    ----------
    y, x : Array, shape (n,)
        Known values of both [unit].
    most : float
        By how much a channel that lives may be off [unit].
    """
    if x.size < _FEW:
        return False
    low, high = np.quantile(x, (0.05, 0.95))
    off = abs(float(np.median(y - x)))
    return float(high - low) < _MOVES * off <= _MOVES * most


def or_shifted(finding: Finding, why: str = SHIFTED_SENTENCE) -> Finding:
    """A stuck channel as one that is in no row as well, with the sentence that says why."""
    own, other = (finding.side.value, FaultMode.STUCK.value), (finding.side.value, FaultMode.OUTSIDE_TABLE.value)
    p = {(h.side, h.mode): h.p for h in finding.hypotheses}
    moved = _SHIFTED * p.get(own, 0.0)
    p |= {own: p.get(own, 0.0) - moved, other: p.get(other, 0.0) + moved}
    named = sorted((Hypothesis(*row, share) for row, share in p.items()), key=lambda h: -h.p)
    return replace(finding, probability=p[own], hypotheses=tuple(named), evidence=(*finding.evidence, why))
