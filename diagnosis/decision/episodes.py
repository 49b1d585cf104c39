"""Findings of one part that are one fault: the same row, as large, and nothing healthy seen between them.

A constant loss that shows only while the wheel is driven hard is found in pieces. Between them nothing can be judged; where the part
was seen to be healthy for longer, the pieces are faults of their own. A share lost of little is little: what is called healthy while the
reference hardly moves counts by how far the loss would show there, and so by how far a delay would, while it hardly changes, and not at
all where it fits the loss far better than none. Nothing between the pieces of one fault stays called healthy. Losses that touch are one
that grows or fades. A shorter piece
beside a fault, of which no row is probable enough to give it a name and that may be of the row of that fault, is the end or the
beginning of it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from diagnosis.decision.between import as_late, goes_on, healthy_steps, late_on
from diagnosis.estimation.one_delay import late_s
from diagnosis.results.assessment import CODE, Assessment, Finding, Reason
from diagnosis.results.candidates import candidates
from diagnosis.results.result import Epsilon
from diagnosis.results.sentence import About, stated_anew
from diagnosis.results.vocabulary import Tier
from replay.faults import TOTAL, FaultMode, State

#: Healthy time between two findings that makes two faults of them [s]: second measurements see it at once, a model needs longer.
_SEEN_HEALTHY_S = {Tier.DIRECT: 0.05}
_SEEN_BY_MODELS_S = 0.5
_SEEN_SCALED_S = (
    0.3  # what loses a share looks healthy while its reference passes zero; seconds in which the loss would show
)
_SEEN_LATE_S = 2.0  # likewise of a delay: the changes at both ends of the gap, evened, are such seconds
_CHANGES = 0.1  # of ε̂: a bound that is wider than this to either side has the course of a loss in it
_HIDDEN = Reason("a fault before and after it would hardly show")
_SPARE = 0.1  # of ε̂: by which two bounds may miss each other
_NAMED = 6
_TOUCHES_S = 0.1
Part = tuple[str, str]


def with_episodes(assessments: Mapping[Part, Assessment], dt: float) -> dict[Part, Assessment]:
    """The same with findings joined that are one fault.

    Parameters
    ----------
    assessments : Mapping[Part, Assessment]
        By component and side.
    dt : float
        Step [s].
    """
    out: dict[Part, Assessment] = {}
    for part, a in assessments.items():
        both = {side: b for (component, side), b in assessments.items() if component == part[0]}
        findings = a.findings if len(a.findings) < 2 else joined(a.findings, both, dt)
        told = tuple(_with_its_chance(f) for f in findings)
        out[part] = a if told == a.findings else without_healthy_between(replace(a, findings=told), a.findings)
    return out


def without_healthy_between(joined: Assessment, pieces: Sequence[Finding]) -> Assessment:
    """The same with nothing called healthy between the pieces of one fault: of the fault where it goes on, else it does not show there."""
    states, healthy = joined.states.copy(), CODE[State.HEALTHY]
    open_state = State.NOT_EXCITED if State.NOT_EXCITED in joined.reasons else State.NOT_ASSESSED
    hidden = False
    for a, b in pairwise(sorted(pieces, key=lambda f: f.start)):
        gap = slice(a.stop, b.start)
        if b.start <= a.stop or not any(f.start <= a.start and b.stop <= f.stop for f in joined.findings):
            continue
        seen = joined.states[gap] == healthy
        on = State(a.mode.value) if a.mode.scaled and goes_on(a, b, joined) else open_state
        states[gap][seen] = CODE[on]
        hidden |= on is open_state and bool(seen.any())
    if np.array_equal(states, joined.states):
        return joined
    out = replace(joined, states=states)
    return out.reasoned(open_state, _HIDDEN) if hidden and open_state not in joined.reasons else out


def _with_its_chance(finding: Finding) -> Finding:
    """The same with sentences that give the probability of what it was joined or put together to, not of a part of it."""
    said = f"{100 * finding.probability:.0f}"
    return replace(finding, evidence=tuple(stated_anew(text, About.CASES, said) for text in finding.evidence))


def joined(findings: Sequence[Finding], sides: Mapping[str, Assessment], dt: float) -> tuple[Finding, ...]:
    """Findings in order of time, those that are one fault as one.

    Parameters
    ----------
    findings : Sequence[Finding]
        Of one side of a part.
    sides : Mapping[str, Assessment]
        Both sides of the component: a finding that may be either's counts in both lists.
    dt : float
        Step [s].
    """
    findings = _with_edges(findings, dt)
    groups: list[list[Finding]] = []
    for f in sorted(findings, key=lambda f: f.start):
        if groups and _continues(groups[-1][-1], f, sides, dt):
            groups[-1].append(f)
        else:
            groups.append([f])
    return tuple(group[0] if len(group) == 1 else _episode(group, dt, looks=_looks(group, sides)) for group in groups)


def _looks(group: Sequence[Finding], sides: Mapping[str, Assessment]) -> bool:
    """Whether anything between the pieces of one fault looks healthy."""
    known = [sides[s.value].states for s in group[0].side.sides if s.value in sides]
    return any(bool(np.any(x[a.stop : b.start] == CODE[State.HEALTHY])) for a, b in pairwise(group) for x in known)


def _with_edges(findings: Sequence[Finding], dt: float) -> list[Finding]:
    """The same with pieces whose kind is unclear put to the fault that they touch and may be of."""
    out = sorted(findings, key=lambda f: f.start)
    k = 0
    while k < len(out):
        beside = [j for j in (k - 1, k + 1) if 0 <= j < len(out) and _edge_of(out[k], out[j], dt)]
        if not beside:
            k += 1
            continue
        most = max(beside, key=lambda j: _chance(out[k], out[j].mode))
        piece, fault = out[k], out[most]
        words = f"From {piece.start * dt:.2f} to {piece.stop * dt:.2f} s its kind is unclear: it may as well be of another row."
        out[most] = replace(
            fault,
            start=min(piece.start, fault.start),
            stop=max(piece.stop, fault.stop),
            course=(*fault.course, words),
        )
        del out[k]
        k = max(0, k - 1)
    return out


def _edge_of(piece: Finding, fault: Finding, dt: float) -> bool:
    """Whether a piece of which no row has the majority may be the beginning or the end of a fault beside it, which is no milder."""
    if len(piece.side.sides) > 1 or (piece.side, piece.tier) != (fault.side, fault.tier):
        return False
    if piece.stop - piece.start >= fault.stop - fault.start:
        return False
    gap = max(piece.start, fault.start) - min(piece.stop, fault.stop)
    milder = (
        not fault.mode.total and sum(_chance(piece, m) for m in TOTAL) > sum(_chance(fault, m) for m in TOTAL) + 0.5
    )
    return abs(gap) * dt <= _TOUCHES_S and not milder and not _rows(fault) and fault.mode in _rows(piece)


def _rows(finding: Finding) -> tuple[str, ...]:
    return candidates(finding.side.value, ((h.side, h.mode, h.p) for h in finding.hypotheses))


def _chance(finding: Finding, mode: FaultMode) -> float:
    return sum(h.p for h in finding.hypotheses if h.mode == mode)


def _continues(a: Finding, b: Finding, sides: Mapping[str, Assessment], dt: float) -> bool:
    """Whether b goes on with the fault that a is."""
    if (a.side, a.mode, a.tier) != (b.side, b.mode, b.tier) or b.start < a.stop:
        return False
    usual = _SEEN_HEALTHY_S.get(a.tier, _SEEN_BY_MODELS_S)
    least = _SEEN_LATE_S if late_s(a) > 0.0 else max(usual, _SEEN_SCALED_S) if a.mode.scaled else usual
    seen = healthy_steps(a, b, sides, dt) * dt >= least
    known = [sides[s.value] for s in a.side.sides if s.value in sides]
    seen = seen and not any(a.mode.scaled and goes_on(a, b, one) for one in known)
    seen = seen and not any(late_on(a, b, one, dt) for one in known)
    changes = a.mode is FaultMode.INEFFICIENT and (b.start - a.stop) * dt <= _TOUCHES_S  # a loss that grows or fades
    return not seen and (changes or _alike(a.epsilon, b.epsilon)) and _same_value(a, b) and as_late(a, b)


def _alike(a: Epsilon | None, b: Epsilon | None) -> bool:
    if a is None or b is None:
        return a is b
    return a.low - _SPARE <= b.high and b.low - _SPARE <= a.high


def _same_value(a: Finding, b: Finding) -> bool:
    """Whether parts that are stuck are stuck at the same value."""
    if not a.mode.total or a.sat is None or b.sat is None:
        return True
    spare = 0.1 * max(abs(a.sat.mean), abs(b.sat.mean))
    return a.sat.low - spare <= b.sat.high and b.sat.low - spare <= a.sat.high


def _episode(group: Sequence[Finding], dt: float, *, looks: bool) -> Finding:
    """One finding for several, with what the longest shows and the course of all; `looks`: something between them looks healthy."""
    length = np.array([f.stop - f.start for f in group], dtype=np.float64)
    longest = group[int(np.argmax(length))]
    best = max(group, key=lambda f: f.probability)
    one_size = all(_alike(a.epsilon, b.epsilon) for a, b in pairwise(group))
    spans = [f"{f.start * dt:.1f}–{f.stop * dt:.1f} s{'' if one_size else _lost(f)}" for f in group[:_NAMED]]
    more = f" and {len(group) - _NAMED} more" if len(group) > _NAMED else ""
    between = (
        "between them hardly anything changed, as would show it"
        if late_s(longest) > 0.0
        else "what looks healthy between them is too brief, or would show too little of it, to make several of it"
        if looks
        else "between them nothing healthy was seen of this part"
    )
    course = f"It shows in {len(group)} stretches ({', '.join(spans)}{more}); {between}: one fault."
    known = [f.detected for f in group if f.detected is not None]
    return replace(
        longest,
        start=group[0].start,
        stop=group[-1].stop,
        probability=best.probability,
        hypotheses=best.hypotheses,
        epsilon=_pooled([f.epsilon for f in group], length),
        course=(*longest.course, course),
        detected=min(known) if known else None,
    )


def _lost(finding: Finding) -> str:
    """How much a stretch lost, to follow its time."""
    return "" if finding.epsilon is None else f": {100 * finding.epsilon.value:.0f} % lost"


def _pooled(sizes: Sequence[Epsilon | None], length: NDArray[np.float64]) -> Epsilon | None:
    """ε̂ of all, each by its bound and its length; the bound of the best one, or what they differ by."""
    known = [(e, n) for e, n in zip(sizes, length, strict=True) if e is not None]
    if not known:
        return None
    half = np.array([max(0.5 * (e.high - e.low), 1e-3) for e, _ in known])
    value = np.array([e.value for e, _ in known])
    weight = np.array([n for _, n in known]) / half**2
    mean = float(weight @ value / weight.sum())
    spread = max(float(np.min(half)), float(np.sqrt(weight @ (value - mean) ** 2 / weight.sum())))
    low, high = mean - spread, mean + spread
    if half.max() > _CHANGES:  # of what grows or fades: the most that it has been
        high = max(high, *(e.high for e, _ in known))
    return Epsilon(mean, low, high)
