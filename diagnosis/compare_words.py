"""Words of a comparison, for terminal and page."""

from __future__ import annotations

from collections.abc import Mapping

OUTCOMES = {
    "new": "new",
    "worse": "worse",
    "other": "changed",
    "better": "better",
    "not_seen_again": "not seen again, but not assessed",
    "resolved": "resolved",
    "unchanged": "unchanged",
}
CHANGES = {"row": "row", "side": "side", "severity": "severity", "epsilon": "ε̂", "duration": "duration"}


def headline(counts: Mapping[str, int]) -> str:
    """How many faults became what, in words."""
    told = [f"{n} {OUTCOMES[name]}" for name, n in counts.items() if n]
    return "Faults: " + ", ".join(told) if told else "No fault in either mission"


def times(count: int, seconds: float) -> str:
    """Number and whole time of faults."""
    return (f"{count}×, " if count > 1 else "") + (f"{seconds * 1e3:.0f} ms" if seconds < 1 else f"{seconds:.1f} s")
