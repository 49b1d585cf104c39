"""A length of time in words: one rounding for sentences, pages and terminal."""

from __future__ import annotations


def seconds_words(value: float) -> str:
    """A duration [s] as shown: ``140 ms``, ``6.4 s``, ``3.4 min``, ``2.5 h``."""
    value = round(value, 6)  # which a difference of times may miss by its last digit
    if value < 120:
        return f"{value * 1e3:.0f} ms" if value < 1 else f"{value:.1f} s"
    return f"{value / 60:.1f} min" if value < 7200 else f"{value / 3600:.1f} h"
