"""Lengths in the evidence of a fault, beside the time that the fault is stated to last.

A sentence is made where a run of samples is judged. The fault's ends are found later: where it begins to show, where recording stopped, where one
fault ends and the next begins. What was measured over a longer time than the fault lasts says so.
"""

from __future__ import annotations

import re
from collections.abc import Iterable

from diagnosis.results.sentence import mapped

#: A length that a sentence gives: for how long a channel did something, not how long something lasted before or behind it.
LENGTH = re.compile(r"\b(?<!grew )(for|over) (\d+(?:\.\d+)?) s\b(?! (?:before|after|in and|of driving|in all))")
AROUND = "in and around it"
_EDGES_S, _EDGES = 0.05, 0.02  # in time and of a fault's: its ends are found to about that


def is_longer(length_s: float, seconds: float) -> bool:
    """Whether a length [s] is more than a fault of `seconds` can have lasted by its ends."""
    return length_s > seconds + max(_EDGES_S, _EDGES * seconds)


def with_lengths_told(evidence: Iterable[str], seconds: float) -> tuple[str, ...]:
    """Sentences of a fault that lasts for `seconds`, in which a longer time is said to be that in and around it."""

    def told(found: re.Match[str]) -> str:
        return f"{found.group(0)} {AROUND}" if is_longer(float(found.group(2)), seconds) else found.group(0)

    return tuple(mapped(text, lambda part: LENGTH.sub(told, part)) for text in evidence)
