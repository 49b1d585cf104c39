"""Losses of effectiveness of two missions beside each other: one measure of whether one changed, for faults and for the table of losses."""

from __future__ import annotations

from collections.abc import Mapping

from diagnosis.results.document import ReportDocument
from diagnosis.results.size_rows import EpsilonRow

_LEAST = 0.05  # bounds are those of one mission; the same part differs more from mission to mission

#: Losses over the whole of both missions, older first, by component and side.
Losses = Mapping[tuple[str, str], tuple[EpsilonRow, EpsilonRow]]


def loss_change(older: EpsilonRow, newer: EpsilonRow) -> int:
    """+1 where a loss [1] grew, −1 where it shrank, 0 where either lies within the other's 95 % bounds or they differ by less than 0.05."""
    a, b = older["value"], newer["value"]
    apart = not older["low"] <= b <= older["high"] and not newer["low"] <= a <= newer["high"]
    return (b > a) - (b < a) if apart and abs(a - b) >= _LEAST else 0


def losses_of_both(older: ReportDocument, newer: ReportDocument) -> Losses:
    """Mission-wide ε̂ of the parts for which both missions have one; two missions are too few for those against other wheels."""
    before = {(x["component"], x["side"]): x["epsilon"] for x in older["loss"] if not x["relative"]}
    return {
        key: (before[key], x["epsilon"])
        for x in newer["loss"]
        if not x["relative"] and (key := (x["component"], x["side"])) in before
    }
