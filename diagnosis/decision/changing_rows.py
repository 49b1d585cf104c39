"""One fault that is told as one row after another: which row it is, is not clear.

A valve that is off by a constant, or a model that does not describe a part, is fitted by whichever row is nearest for the moment. A
chain of such pieces with hardly a moment between them is one fault, whose rows are as probable as they share its time; where one row
has most of it, the pieces stay.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from diagnosis.results.assessment import CODE, Assessment, Finding
from diagnosis.results.result import Epsilon, Hypothesis
from replay.faults import FaultMode, State

_TOUCHES_S, _PIECES = 0.7, 4  # from one to the next; fewer may be several faults
_MOST = 0.6  # of the time, that a row has: it is this one
_NAMED = 4
Part = tuple[str, str]


def with_chains_as_one(assessments: Mapping[Part, Assessment], dt: float) -> dict[Part, Assessment]:
    """Assessments in which a chain of findings of many rows is one finding, each row as probable as it shares its time.

    Parameters
    ----------
    assessments : Mapping[tuple[str, str], Assessment]
        By component and side.
    dt : float
        Step [s].
    """
    return {part: _joined(a, dt) if len(a.findings) >= _PIECES else a for part, a in assessments.items()}


def _joined(a: Assessment, dt: float) -> Assessment:
    chains: list[list[Finding]] = []
    for f in sorted(a.findings, key=lambda f: f.start):
        last = chains[-1] if chains else []
        if last and (last[0].side, last[0].tier) == (f.side, f.tier) and (f.start - last[-1].stop) * dt < _TOUCHES_S:
            last.append(f)
        else:
            chains.append([f])
    told, states = [], a.states
    for chain in chains:
        one = _one(chain, dt)
        if one is None:
            told += chain
            continue
        told.append(one)
        states = states.copy() if states is a.states else states
        for f in chain:
            inside = states[f.start : f.stop]
            inside[inside == CODE[State(f.mode.value)]] = CODE[State(one.mode.value)]
    return a if states is a.states else replace(a, states=states, findings=tuple(told))


def _one(chain: Sequence[Finding], dt: float) -> Finding | None:
    """A chain as one finding; None where it is short, of one row, or one row has most of it."""
    if len(chain) < _PIECES or len({f.mode for f in chain}) < 2:
        return None
    whole = sum(f.stop - f.start for f in chain)
    rows: dict[tuple[str, str], float] = {}
    for f in chain:
        for h in f.hypotheses:
            rows[h.side, h.mode] = rows.get((h.side, h.mode), 0.0) + h.p * (f.stop - f.start) / whole
    own = {row: p for row, p in rows.items() if row[0] in {s.value for s in chain[0].side.sides}}
    best = max(own, key=lambda row: own[row], default=None)
    if best is None or own[best] >= _MOST:
        return None
    known = [f.detected for f in chain if f.detected is not None]
    pieces = "; ".join(f"{_name(f.mode)} {f.start * dt:.1f}–{f.stop * dt:.1f} s" for f in chain[:_NAMED])
    more = f" and {len(chain) - _NAMED} more" if len(chain) > _NAMED else ""
    longest = max(chain, key=lambda f: f.stop - f.start)
    said = f"{len(chain)} pieces that touch look like {_count(chain)} rows in turn ({pieces}{more}): rather one fault that none of them describes."
    of = f"What follows is of the longest of them, {longest.start * dt:.1f}–{longest.stop * dt:.1f} s."
    return replace(
        longest,
        start=chain[0].start,
        stop=max(f.stop for f in chain),
        mode=FaultMode(best[1]),
        probability=own[best],
        hypotheses=tuple(sorted((Hypothesis(*row, p) for row, p in rows.items()), key=lambda h: -h.p)),
        epsilon=None if FaultMode(best[1]).total else _size(chain),
        sat=None,
        evidence=(said, of, *longest.evidence),
        course=(),
        detected=min(known) if known else None,
    )


def _size(chain: Sequence[Finding]) -> Epsilon | None:
    """ε̂ of all pieces whose row has one, each by its time, between the least and the most that any of them may have lost."""
    known = [(f.epsilon, f.stop - f.start) for f in chain if f.epsilon is not None and not f.mode.total]
    if not known:
        return None
    mean = sum(e.value * n for e, n in known) / sum(n for _, n in known)
    return Epsilon(mean, min(e.low for e, _ in known), max(e.high for e, _ in known))


def _name(mode: FaultMode) -> str:
    return mode.value.replace("_", " ")


def _count(chain: Sequence[Finding]) -> int:
    return len({f.mode for f in chain})
