"""Bounds of ε̂ that say nothing: from nothing on, or up to all."""

from __future__ import annotations

#: Of ε [1]: what a page rounds to all.
WHOLE = 0.995
_NONE = 0.005


def open_bounds(low: float, high: float) -> tuple[bool, bool]:
    """Whether the lower and the upper bound of ε̂ [1] say nothing."""
    return low <= _NONE, high >= WHOLE


def is_open(low: float, high: float) -> bool:
    """Whether either of these bounds of ε̂ [1] says nothing."""
    return any(open_bounds(low, high))
