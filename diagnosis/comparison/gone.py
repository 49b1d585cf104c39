"""Why a fault that a newer mission does not show is not resolved by that: only a later, whole mission in which it would have shown resolves it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from diagnosis.comparison.found import FoundFault, Sides, keys_of
from diagnosis.results.clearing_rows import DetectabilityRow
from diagnosis.results.detectability import of_part
from diagnosis.results.durations import seconds_words
from diagnosis.results.machine_words import MachineWords
from diagnosis.results.vocabulary import Severity, Tier
from diagnosis.results.wheel_model import RESOLUTION

_LIKELY = 0.5  # of the places in a mission at which a fault would have been found


@dataclass(frozen=True)
class Newer:
    """What the newer mission could show.

    Attributes
    ----------
    sides : Sides
        What was judged, by component and side.
    shown : Sequence[DetectabilityRow]
        What it would have shown, as its report has it; empty: its report does not say.
    clear_at : float
        The loss that the shares of those rows are about [1].
    order : str
        Sentence that says why it is not known to be later; may be empty.
    """

    sides: Sides
    shown: Sequence[DetectabilityRow] = ()
    clear_at: float = 0.25
    order: str = ""


def why_not_resolved(a: FoundFault, newer: Newer, words: MachineWords) -> str:
    """Sentence that says why a fault that is gone cannot count as resolved, empty where it can."""
    for key in keys_of(a.component, a.side):
        side, part = newer.sides.get(key), words.part_name(a.kind, key[1])
        if side is None:
            return f"The newer result does not hold the {part}."
        if not side.assessed:
            return f"In the newer mission the {part} was {side.words}."
        small = a.epsilon is not None and a.epsilon["low"] < RESOLUTION[key[1]]
        if side.tier is Tier.TRACKING and not a.mode.total:
            return f"In the newer mission the {part} was judged by its tracking alone, which does not show this row."
        if side.tier.strength < a.tier.strength and not a.mode.total and small:
            return (
                f"In the newer mission the {part} was judged by weaker evidence ({side.tier}, not {a.tier}), which "
                f"mostly does not name a loss below about {100 * RESOLUTION[key[1]]:.0f} % there."
            )
    if not would_show(a, newer.shown, newer.clear_at):
        return f"By its report the newer mission would more often have missed than shown such a fault of {seconds_words(a.longest_s)}."
    if a.recovered and a.severity is not Severity.INFO:
        return "In the older mission it went away by itself as well, so that its absence shows no repair."
    return newer.order


def would_show(fault: FoundFault, shown: Sequence[DetectabilityRow], clear_at: float) -> bool:
    """Whether a mission would have shown a fault more often than not; also where its report does not say.

    Parameters
    ----------
    fault : FoundFault
        As long as its longest piece.
    shown : Sequence[DetectabilityRow]
        Smallest faults that the mission would have shown.
    clear_at : float
        The loss [1] that their shares are about.
    """
    own = [r for key in keys_of(fault.component, fault.side) for r in of_part(shown, *key)]
    rows = [r for r in own if r["deviation"] == fault.mode.value]
    if not rows:
        return True
    lengths = sorted({r["for_s"] for r in rows if r["for_s"] is not None})
    asked: list[float | None] = [*([x for x in lengths if x <= fault.longest_s][-1:] or lengths[:1])]
    asked = asked or [None]
    return any(_shows(r, fault, clear_at) for r in rows if r["for_s"] in asked)


def _shows(row: DetectabilityRow, fault: FoundFault, clear_at: float) -> bool:
    if not row["places"]:
        return False
    size = None if fault.epsilon is None or not fault.mode.scaled else fault.epsilon["value"]
    if row["size"] is not None and size is not None and row["size"] <= size:
        return True
    if row["share"] is None:  # of what has no size that counts, such as noise
        return row["size"] is not None
    return row["share"] >= _LIKELY and (size is None or size >= clear_at)
