"""What an open lane without a fault says: how near each check came to its limit, and what the part would have shown."""

from __future__ import annotations

from dataclasses import dataclass

from diagnosis.pages.labels import clock
from diagnosis.report.shown import HEADS, cells_of
from diagnosis.results.clearing import size_words
from diagnosis.results.clearing_rows import ClearingRow
from diagnosis.results.document import ReportDocument
from replay.faults import Side


@dataclass(frozen=True)
class LaneDetail:
    """The words of one open lane.

    Attributes
    ----------
    checks : tuple[tuple[str, str], ...]
        Each check behind an all-clear, and how near it came to its limit.
    shows : tuple[tuple[str, str], ...]
        Each kind of fault, and the smallest of it that the mission would have shown.
    """

    checks: tuple[tuple[str, str], ...]
    shows: tuple[tuple[str, str], ...]


def healthy_lanes(report: ReportDocument) -> dict[tuple[str, str], LaneDetail]:
    """Words for the lane of every component and side of which anything is known."""
    cells = cells_of(report)
    checks: dict[tuple[str, str], list[tuple[str, str]]] = {}
    for row in report["clearing"]:
        for side in Side(row["side"]).sides:
            checks.setdefault((row["component"], side), []).append((row["asked"], _approach(row)))
    heads = [h.removeprefix(">") for h in HEADS[1:-1]]
    return {
        key: LaneDetail(
            tuple(checks.get(key, ())),
            tuple((h, c) for h, c in zip(heads, cells.get(key, ()), strict=False) if c),
        )
        for key in {**checks, **cells}
    }


def _approach(row: ClearingRow) -> str:
    """How near a check came to its limit, and when."""
    if row["worst"] is None:
        return "the mission does not show it"
    beyond = "" if row["passed"] else ", beyond it"
    worst = f"{size_words(row['check'], row['worst'])}, limit {size_words(row['check'], row['limit'])}{beyond}"
    when = "over the whole mission" if row["start_s"] is None else f"largest at {clock(row['start_s'], 1)}"
    return f"{worst}; {when}"
