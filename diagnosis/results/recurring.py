"""Faults of one part that come again and again: one intermittent fault, however many times it was seen."""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable, Iterable

#: As many faults of one row on one part are one that comes and goes, such as a loose contact.
OFTEN = 5


def counted(kinds: Iterable[Hashable]) -> int:
    """Number of faults by what each is (part, side and row), where those that recur count once."""
    return sum(1 if n >= OFTEN else n for n in Counter(kinds).values())
