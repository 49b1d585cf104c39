"""Words of a comparison, for terminal and page."""

from __future__ import annotations

from collections.abc import Mapping

from diagnosis.results.comparison_document import Change, CoverageChangeRow
from diagnosis.results.vocabulary import Tier

OUTCOMES: dict[str, str] = {
    "new": "new",
    "worse": "worse",
    "other": "changed",
    "better": "better",
    "not_seen_again": "not seen again, no repair shown",
    "resolved": "resolved",
    "unchanged": "unchanged",
}
SIGNS: dict[str, str] = {
    "new": "+",
    "worse": "▲",
    "other": "≠",
    "better": "▼",
    "not_seen_again": "?",
    "resolved": "✓",
    "unchanged": "=",
}
CHANGES: dict[Change, str] = {
    "row": "row",
    "side": "side",
    "severity": "severity",
    "epsilon": "ε̂",
    "duration": "duration",
}


def headline(counts: Mapping[str, int]) -> str:
    """How many faults became what, in words."""
    found = [f"{counts[name]} {words}" for name, words in OUTCOMES.items() if counts.get(name)]
    return "Faults: " + ", ".join(found) if found else "No fault in either mission"


def times(count: int, seconds: float) -> str:
    """Number and whole time of faults. Time in s."""
    return (f"{count}×, " if count > 1 else "") + (f"{seconds * 1e3:.0f} ms" if seconds < 1 else f"{seconds:.1f} s")


def coverage_words(change: CoverageChangeRow) -> str:
    """What became of how long a part was judged; empty where it stayed long enough."""
    before, now = (
        side is not None and side["tier"] is not Tier.NONE and side["decided_s"] > 0
        for side in (change["older"], change["newer"])
    )
    if change["change"] == "lost":
        if change["newer"] is not None and not change["newer"]["shown"]:
            return "no longer cleared"
        return "no longer long enough" if now else "no longer assessed"
    if change["change"] == "gained":
        if change["older"] is not None and not change["older"]["shown"]:
            return "cleared now"
        return "long enough now" if before else "assessed now"
    if any(side is not None and side["assessed"] for side in (change["older"], change["newer"])):
        return ""
    return "long enough in neither" if before or now else "assessed in neither"
