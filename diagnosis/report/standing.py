"""How each part of a machine stands: cleared, or what keeps it from that; one notion for facts, timeline and picture."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum

from diagnosis.comparison.coverage import SideCoverage, sides_of
from diagnosis.results.document import ReportDocument
from diagnosis.results.vocabulary import Severity, Tier, Verdict
from replay.faults import Side, State

_NOTHING = 0.005  # of the driving: judged for so little that it is none
_RESTED = 0.9  # of the mission
_WORTH_A_WORD = 0.05  # probability of an alternative

#: A component and its side.
Part = tuple[str, str]


class Standing(StrEnum):
    """How a part stands, to follow *was* or its name."""

    CLEARED = "cleared"
    NOT_CLEARED = "not cleared"
    NOT_LONG_ENOUGH = "not judged long enough"
    NOT_JUDGED = "not judged"
    NOT_STEERED = "not steered"


def standings_of(report: ReportDocument) -> dict[Part, Standing]:
    """How each component and side of a report stands."""
    sides = sides_of(report)
    cleared, rested = _cleared(report, sides), _not_steered(report)
    return {
        part: Standing.CLEARED
        if part in cleared
        else Standing.NOT_STEERED
        if part in rested and not side.long_enough
        else Standing.NOT_CLEARED
        if side.long_enough
        else Standing.NOT_LONG_ENOUGH
        if side.tier is not Tier.NONE and side.decided_s > _NOTHING * side.driving_s
        else Standing.NOT_JUDGED
        for part, side in sides.items()
    }


def _not_steered(report: ReportDocument) -> set[Part]:
    """Sides of axles that were hardly asked to move in the mission, so that nothing is asked of them before the next one."""
    axles = set(report["machine"]["axles"])
    return {
        (row["component"], row["side"])
        for row in report["coverage"]
        if row["component"] in axles
        and row["seconds"].get(State.NOT_EXCITED, 0.0) >= _RESTED * sum(row["seconds"].values()) > 0.0
    }


def _cleared(report: ReportDocument, sides: Mapping[Part, SideCoverage]) -> set[Part]:
    """Parts that were judged and of which nothing is open; none where something is open that is of no part, or that is not said."""
    verdict = report["verdict"]
    if "to_clear" not in verdict:
        return set()
    faults = [f for f in report["intervals"] if f["severity"] != Severity.INFO]
    named: set[Part] = {(f["component"], s) for f in faults for s in Side(f["side"]).sides}
    named |= {  # parts that a fault may be of as well
        (f["component"], s)
        for f in faults
        for h in f["hypotheses"]
        if h["mode"] != State.HEALTHY and h["side"] in set(Side) and h["p"] >= _WORTH_A_WORD
        for s in Side(h["side"]).sides
    }
    named |= {(row["component"], row["side"]) for row in report["detectability"]["rows"] if row["size"] == 0.0}
    points = [row for row in verdict["to_clear"] if not row.get("fault")]  # whose part is among the faulty ones
    mine = [{(p["component"], p["side"]) for p in row.get("parts", [])} for row in points]
    if not all(mine) or (verdict["status"] == Verdict.NOT_ASSESSED and not mine):
        return set()
    return {part for part, side in sides.items() if side.assessed} - named.union(*mine)
