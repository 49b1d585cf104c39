"""A channel that stays where it is beside a reference that does: stuck, or off by a constant."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.assessment import Finding
from diagnosis.results.result import Hypothesis
from replay.arrays.quantiles import median_of, quantile_of
from replay.faults import FaultMode, State

Array = NDArray[np.float64]

_MOVES = 0.15  # of what it is off by: a reference that moves over less tells a constant channel from no shifted one
_SHIFTED = 0.4  # of such a channel that seems stuck: that it is off by a constant
_ENDS = 0.85  # of a sensor that stays at its largest reading while its reference goes beyond: that it can show no more
_FEW = 5
_MOVING = 0.1  # of the usual reference: from here on a channel that lives shows its own noise
_HELD, _LONGER = 0.9, 5.0  # of the time, and times as long as it ever stays elsewhere

#: Says so.
SHIFTED_SENTENCE = "In nine tenths of that time what it should show changed by less than 15 % of what it is off by: off by a constant it would read the same."


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
    low, high = quantile_of(x, (0.05, 0.95))
    off = abs(float(median_of(y - x)))
    return float(high - low) < _MOVES * off <= _MOVES * most


def is_held(y: Array, x: Array, span: tuple[int, int]) -> bool:
    """Whether a channel reads one value to the last digit while its reference moves on, as it does nowhere else.

    One that is off by a constant goes on to show its noise, wherever it is.

    Parameters
    ----------
    y, x : Array, shape (n,)
        The channel and its reference over the mission [unit]; NaN where not known.
    span : tuple[int, int]
        Samples [start, stop) in question.
    """
    known = np.isfinite(y) & np.isfinite(x)
    size = np.abs(x[known])
    if size.size < _FEW:
        return False
    moving = known & (np.abs(np.nan_to_num(x)) > _MOVING * quantile_of(size, 0.95))
    inside = np.zeros(y.size, np.bool_)
    inside[slice(*span)] = True
    if np.mean(moving[inside]) < _HELD:
        return False
    held, elsewhere = _longest(y, moving & inside), _longest(y, moving & ~inside)
    return held >= max(_FEW, _HELD * (span[1] - span[0])) and held >= _LONGER * elsewhere > 0


def _longest(y: Array, where: NDArray[np.bool_]) -> int:
    """Most samples one after another, in some places, that are alike."""
    new = np.ones(y.size, np.bool_)
    new[1:] = (y[1:] != y[:-1]) | ~(where[1:] & where[:-1])
    return int(np.max(np.bincount(np.cumsum(new)[where]), initial=0)) if where.any() else 0


def or_shifted(finding: Finding, why: str = SHIFTED_SENTENCE) -> Finding:
    """A stuck channel as one that is in no row as well, with the sentence that says why."""
    own, other = (finding.side.value, FaultMode.STUCK.value), (finding.side.value, FaultMode.OUTSIDE_TABLE.value)
    p = {(h.side, h.mode): h.p for h in finding.hypotheses}
    had = p.get(other, 0.0)
    moved = max(0.0, _SHIFTED * (p.get(own, 0.0) + had) - had)  # what says so already is not said twice
    least = max((q for row, q in p.items() if row not in (own, other) and row[1] != State.HEALTHY.value), default=0.0)
    moved = min(moved, max(0.0, p.get(own, 0.0) - least))  # it is called stuck: no other row may come before that
    p |= {own: p.get(own, 0.0) - moved, other: had + moved}
    named = sorted((Hypothesis(*row, share) for row, share in p.items()), key=lambda h: -h.p)
    return replace(finding, probability=p[own], hypotheses=tuple(named), evidence=(*finding.evidence, why))


def or_at_its_end(finding: Finding, why: str) -> Finding:
    """A stuck sensor as one that cannot show more than it does, with the sentence that says why: it is in no row, and hardly stuck."""
    own, other = (finding.side.value, FaultMode.STUCK.value), (finding.side.value, FaultMode.OUTSIDE_TABLE.value)
    p = {(h.side, h.mode): h.p for h in finding.hypotheses}
    share = (finding.side.value, FaultMode.INEFFICIENT.value)  # of a reference that stays: the same
    both = p.get(own, 0.0) + p.pop(share, 0.0) + p.get(other, 0.0)
    p |= {own: (1.0 - _ENDS) * both, other: _ENDS * both}
    named = sorted((Hypothesis(*row, share) for row, share in p.items()), key=lambda h: -h.p)
    return replace(
        finding,
        mode=FaultMode.OUTSIDE_TABLE,
        probability=p[other],
        hypotheses=tuple(named),
        epsilon=None,
        sat=None,
        evidence=(why, *finding.evidence),
    )
