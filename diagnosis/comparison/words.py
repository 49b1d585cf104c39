"""Words of a comparison, for terminal and page."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from diagnosis.results.candidates import unclear_words
from diagnosis.results.comparison_document import Change, CoverageChangeRow, FaultChangeRow, SideCoverageRow
from diagnosis.results.durations import seconds_words
from diagnosis.results.fault_rows import state_label
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
    "loss": "loss over the mission",
}


def headline(counts: Mapping[str, int], *, several: bool = False) -> str:
    """How many faults became what, in words; `several`: some stand for more than one of a mission, which count as one."""
    found = [f"{counts[name]} {words}" for name, words in OUTCOMES.items() if counts.get(name)]
    once = ", each part and kind once" if several else ""
    return f"Faults{once}: " + ", ".join(found) if found else "No fault in either mission"


def standing(counts: Mapping[str, int]) -> bool:
    """Whether any fault stands in the newer mission, or is gone without a sign of repair: nothing new is no relief then."""
    return any(n for name, n in counts.items() if name != "resolved")


def are_several(faults: Iterable[FaultChangeRow]) -> bool:
    """Whether some rows of a comparison stand for more than one fault of a mission."""
    return any(len(f["ids"]) > 1 for c in faults for f in (c["older"], c["newer"]) if f is not None)


def row_of_found(mode: str, side: str, rows: Sequence[str]) -> tuple[str, str]:
    """Symbol and label of a fault of a comparison: its row, or that its kind is unclear, with the candidates."""
    if not rows:
        return mode, state_label(mode, side)
    words = unclear_words(side, rows)
    return "warning", words[0].upper() + words[1:]


def times(count: int, seconds: float) -> str:
    """Number and whole time of faults. Time in s."""
    return (f"{count}×, " if count > 1 else "") + seconds_words(seconds)


def coverage_words(change: CoverageChangeRow) -> str:
    """What became of how long a part was judged; empty where it stayed long enough."""
    before, now = (
        side is not None and side["tier"] is not Tier.NONE and side["decided_s"] > 0
        for side in (change["older"], change["newer"])
    )
    if change["change"] == "lost":
        if _checks_alone(change["newer"]):
            return "a check is open now"
        return "no longer judged long enough" if now else "no longer judged"
    if change["change"] == "gained":
        if _checks_alone(change["older"]):
            return "its checks pass now"
        return "judged long enough now" if before else "judged now"
    if any(side is not None and side["assessed"] for side in (change["older"], change["newer"])):
        return ""
    return "judged long enough in neither" if before or now else "judged in neither"


def coverage_head(changes: Sequence[CoverageChangeRow]) -> str:
    """Heading of parts that count as assessed in one of two missions alone: for how long they were judged, or for their checks."""
    checks = [_checks_alone(side) for c in changes for side in (c["older"], c["newer"])]
    if not any(checks):
        return "Judged long enough in one mission only"
    both = all(_checks_alone(c["older"]) or _checks_alone(c["newer"]) for c in changes)
    return (
        "Judged in both missions, its checks passed in one only"
        if both
        else "Judged long enough, or its checks passed, in one mission only"
    )


def _checks_alone(side: SideCoverageRow | None) -> bool:
    """Whether a part was judged long enough and is not cleared for its checks, or for a mission that was cut."""
    return side is not None and side["long_enough"] and not side["shown"]
