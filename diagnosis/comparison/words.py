"""Words of a comparison, for terminal and page."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

OUTCOMES = {
    "new": "new",
    "worse": "worse",
    "other": "changed",
    "better": "better",
    "not_seen_again": "not seen again, but not assessed",
    "resolved": "resolved",
    "unchanged": "unchanged",
}
SIGNS = {
    "new": "+",
    "worse": "▲",
    "other": "≠",
    "better": "▼",
    "not_seen_again": "?",
    "resolved": "✓",
    "unchanged": "=",
}
CHANGES = {"row": "row", "side": "side", "severity": "severity", "epsilon": "ε̂", "duration": "duration"}


def headline(counts: Mapping[str, int]) -> str:
    """How many faults became what, in words."""
    found = [f"{n} {OUTCOMES[name]}" for name, n in counts.items() if n]
    return "Faults: " + ", ".join(found) if found else "No fault in either mission"


def times(count: int, seconds: float) -> str:
    """Number and whole time of faults."""
    return (f"{count}×, " if count > 1 else "") + (f"{seconds * 1e3:.0f} ms" if seconds < 1 else f"{seconds:.1f} s")


def coverage_words(change: Mapping[str, Any]) -> str:
    """What became of how long a part was judged, of a `CoverageChange` as JSON; empty where it stayed long enough."""
    sides = change.get("older"), change.get("newer")
    some = [bool(s and s.get("tier") != "none" and s.get("decided_s")) for s in sides]
    if change.get("change") == "lost":
        return "no longer long enough" if some[1] else "no longer assessed"
    if change.get("change") == "gained":
        return "long enough now" if some[0] else "assessed now"
    if any(s and s.get("assessed") for s in sides):
        return ""
    return "long enough in neither" if any(some) else "assessed in neither"
