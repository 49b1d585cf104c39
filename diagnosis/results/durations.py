"""A length of time in words: one rounding for sentences, pages and terminal."""

from __future__ import annotations

from collections.abc import Iterable


def seconds_words(value: float) -> str:
    """A duration [s] as shown: ``140 ms``, ``6.4 s``, ``3.4 min``, ``2.5 h``."""
    value = round(value, 6)  # which a difference of times may miss by its last digit
    if value < 120:
        return f"{value * 1e3:.0f} ms" if value < 1 else f"{value:.1f} s"
    return f"{value / 60:.1f} min" if value < 7200 else f"{value / 3600:.1f} h"


def covered_s(spans: Iterable[tuple[float, float]]) -> float:
    """Time that spans [start, stop) [s] cover: what lies in two of them counts once."""
    total, end = 0.0, float("-inf")
    for start, stop in sorted(spans):
        total += max(0.0, stop - max(start, end))
        end = max(end, stop)
    return total
