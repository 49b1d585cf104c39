"""Faults of one part that come again and again: one intermittent fault, however many times it was seen."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

from replay.faults import State

#: As many faults of one row on one part are one that comes and goes, such as a loose contact; two may be two.
OFTEN = 3
_CANDIDATE = 0.15  # of a fault's rows: one that it may as well be of


class Seen(NamedTuple):
    """One fault as it is counted: its part, its row, and the rows that it may be of with their probabilities [1]."""

    component: str
    side: str
    mode: str
    rows: tuple[tuple[str, float], ...]


#: Component, side and row.
_Kind = tuple[str, str, str]


def counted(lists: Sequence[Sequence[Seen]]) -> list[int]:
    """Number of faults in each of some lists, the worst first, where those that recur count once, in the first list that has one of them."""
    kinds = _kinds([f for faults in lists for f in faults])
    often = {kind for kind, times in Counter(kinds).items() if times >= OFTEN}
    out, seen, k = list[int](), set[_Kind](), 0
    for faults in lists:
        own = kinds[k : k + len(faults)]
        k += len(faults)
        out.append(sum(kind not in often for kind in own) + len(often.intersection(own) - seen))
        seen |= often.intersection(own)
    return out


def _kinds(faults: Sequence[Seen]) -> list[_Kind]:
    """What each fault is: part, side, and the commonest row of the part's faults that it may be of, else its own."""
    parts: dict[tuple[str, str], Counter[str]] = {}
    for f in faults:
        parts.setdefault((f.component, f.side), Counter())[f.mode] += 1
    out = []
    for f in faults:
        ranked = [mode for mode, _ in parts[f.component, f.side].most_common()]
        out.append((f.component, f.side, next(m for m in ranked if m == f.mode or _may_be(f, m))))
    return out


def _may_be(f: Seen, mode: str) -> bool:
    """Whether a row is a candidate of a fault."""
    faulty = [(row, p) for row, p in f.rows if row != State.HEALTHY.value]
    return sum(p for row, p in faulty if row == mode) >= _CANDIDATE * sum(p for _, p in faulty)
