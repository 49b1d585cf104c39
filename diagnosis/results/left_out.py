"""What was left out of a mission is not damaged: it was read whole, and its signals are not used."""

from __future__ import annotations

from collections.abc import Iterable

_SAID = " was left out"


def is_left_out(text: str) -> bool:
    """Whether a sentence on a log's damage says no more than that a file was left out, or why."""
    return _SAID in text


def only_left_out(texts: Iterable[str]) -> bool:
    """Whether all of them do; not where there are none."""
    found = list(texts)
    return bool(found) and all(map(is_left_out, found))
