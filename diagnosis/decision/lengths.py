"""Lengths in the evidence of a fault, beside the time that the fault is stated to last.

A sentence is made where a run of samples is judged. The fault's ends are found later: where it begins to show, where recording stopped, where one
fault ends and the next begins. So a sentence leaves its length in braces, as it does words of the machine (`diagnosis.results.sentence.lasting`),
and what was measured over a longer time than the fault lasts says so here.
"""

from __future__ import annotations

import re
from collections.abc import Iterable

from diagnosis.results.sentence import mapped

_LENGTH = re.compile(r"\{(\d+(?:\.\d+)?) s\}")
AROUND = "in and around it"
_EDGES_S, _EDGES = 0.05, 0.02  # in time and of a fault's: its ends are found to about that


def is_longer(length_s: float, seconds: float) -> bool:
    """Whether a length [s] is more than a fault of `seconds` can have lasted by its ends."""
    return length_s > seconds + max(_EDGES_S, _EDGES * seconds)


def with_lengths_told(evidence: Iterable[str], seconds: float) -> tuple[str, ...]:
    """Sentences of a fault that lasts for `seconds` with their lengths; a longer time is said to be that in and around it."""

    def told(found: re.Match[str]) -> str:
        length = f"{found.group(1)} s"
        return f"{length} {AROUND}" if is_longer(float(found.group(1)), seconds) else length

    return tuple(mapped(text, lambda part: _LENGTH.sub(told, part)) for text in evidence)
