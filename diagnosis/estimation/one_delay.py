"""What one delay explains in a mission in which a channel comes late elsewhere: a valve that answers late everywhere is not stuck once.

Where a command moves for once after a rest, a channel that comes late by half a second stays where it was for as long, and is off by all of the
move. Beside other moves that one delay alone explains, it is late there as well, if that delay explains it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from diagnosis.estimation.simple_causes import Measured, every_power
from diagnosis.results.assessment import Finding
from diagnosis.results.result import Hypothesis
from diagnosis.results.sentence import About, Sentence, is_about
from replay.faults import FaultMode

_AS_LATE = 0.25  # of a delay, by which two of one channel may differ
_LEAST_S = 2.0  # of what is late by one delay, in two findings or more, or in one that is longer than the rest together
_LEFT = 0.2  # of the power of a piece, that the delay may leave: all of it, for a move is but the end of a rest
_P = 0.95
_AROUND = 0.15, 5  # of the delay, and trials: pieces begin and end at readings


def late_s(f: Finding) -> float:
    """Delay of which a finding is [s], 0 of any other."""
    told = (float(text.parts[1]) for text in f.evidence if isinstance(text, Sentence) and is_about(text, About.LATE))
    return 1e-3 * next(told, 0.0)


def with_one_delay(findings: Sequence[Finding], measured: Measured) -> list[Finding]:
    """Findings of one channel, those as late as well that its delay elsewhere explains.

    Parameters
    ----------
    findings : Sequence[Finding]
        Of one side, in order of time.
    measured : Measured
        Its channel and reference.
    """
    late = [(late_s(f), f) for f in findings if late_s(f) > 0.0]
    rest = [f for f in findings if late_s(f) == 0.0]
    if not late or not rest:
        return [*findings]
    usual = float(np.median([s for s, _ in late]))
    alike = [f for s, f in late if abs(s - usual) <= _AS_LATE * usual]
    lasts = sum(f.stop - f.start for f in alike)
    if lasts * measured.dt < _LEAST_S or (len(alike) < 2 and lasts < sum(f.stop - f.start for f in rest)):
        return [*findings]
    like = max(alike, key=lambda f: f.stop - f.start)
    return [_late(f, like) if late_s(f) == 0.0 and _explained(f, usual, measured) else f for f in findings]


def _explained(f: Finding, seconds: float, measured: Measured) -> bool:
    """Whether the reference that much later [s] leaves little of a finding's deviation."""
    at = np.arange(f.start, min(f.stop, measured.y.size))
    y, x = measured.y[at], measured.x[at]
    at = at[measured.use[at] & np.isfinite(y) & np.isfinite(x)]
    if at.size < 3:
        return False
    off = measured.y[at] - measured.x[at]
    whole = every_power(off, measured)
    if whole <= 0.0:
        return False
    for share in np.linspace(1.0 - _AROUND[0], 1.0 + _AROUND[0], _AROUND[1]):
        before = measured.x[np.maximum(at - round(seconds * share / measured.dt), 0)]
        if not np.isfinite(before).all():
            continue
        if every_power(measured.y[at] - before, measured) <= _LEFT * whole:
            return True
    return False


def _late(f: Finding, like: Finding) -> Finding:
    """A finding as one that is late as another one is."""
    words = next(text for text in like.evidence if isinstance(text, Sentence) and is_about(text, About.LATE))
    figures = tuple(e for e in f.evidence if is_about(e, About.DEVIATION, About.CASES, About.TIMES))
    others = [h for h in f.hypotheses if h.mode != FaultMode.OUTSIDE_TABLE.value]
    total = sum(h.p for h in others)
    left = [replace(h, p=(1.0 - _P) * h.p / total) for h in others] if total > 0.0 else []
    named = Hypothesis(f.side.value, FaultMode.OUTSIDE_TABLE.value, _P if left else 1.0)
    said = "It is as late here as elsewhere in the mission, and that alone explains it."
    return replace(
        f,
        mode=FaultMode.OUTSIDE_TABLE,
        probability=_P,
        hypotheses=(named, *left),
        epsilon=None,
        sat=None,
        evidence=(words, said, *figures),
    )
