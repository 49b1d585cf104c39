"""What of a machine was assessed in two missions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from diagnosis.results.assessed import is_judged, is_limited
from diagnosis.results.comparison_document import CoverageStep
from diagnosis.results.document import ReportDocument
from diagnosis.results.vocabulary import Kind, Tier
from replay.faults import DECIDED, Side

#: A component and its side.
Part = tuple[str, str]

_HARDLY = 0.5


@dataclass(frozen=True)
class SideCoverage:
    """How long one component and side was judged in one mission.

    Attributes
    ----------
    tier : Tier
        Evidence.
    driving_s, decided_s : float
        Driving time, and how much of it was decided [s].
    judged_s : float
        Decided time of the whole mission [s].
    assessed : bool
        Whether that is as much as a verdict of ``ready`` takes: `min_assessed` seconds and four fifths of the driving of a whole
        mission, and checks of the all-clear that none of its faults would have passed.
    shown : bool
        Whether the whole mission was judged, and the checks clear the component.
    long_enough : bool
        Whether it was judged for as long as `assessed` needs, whatever the checks say.
    """

    tier: Tier
    driving_s: float
    decided_s: float
    judged_s: float
    assessed: bool
    shown: bool = True
    long_enough: bool = False

    @property
    def words(self) -> str:
        """How far it was judged, to follow *was*."""
        if self.tier is Tier.NONE:
            return "not judged"
        return f"judged for {self.decided_s:.1f} s of {self.driving_s:.1f} s driving" + (
            "" if self.assessed else ", which is too little" if self.shown else ", and not cleared"
        )

    @property
    def short_words(self) -> str:
        """How little it was judged, to follow *was*: not, hardly (less than half of the driving) or partly."""
        if self.tier is Tier.NONE or not self.judged_s:
            return "not judged"
        if not self.shown:
            return "not cleared"
        much = "hardly" if self.decided_s < _HARDLY * self.driving_s else "only partly"
        return f"{much} judged ({self.decided_s:.1f} of {self.driving_s:.1f} s of driving)"


@dataclass(frozen=True)
class CoverageChange:
    """One component and side in both missions; None where a result does not hold it.

    `change` is ``lost`` where it was assessed in the older mission alone, ``gained`` in the newer alone, else empty.
    """

    component: str
    kind: Kind
    side: str
    older: SideCoverage | None
    newer: SideCoverage | None
    change: CoverageStep


def sides_of(report: ReportDocument) -> dict[Part, SideCoverage]:
    """Coverage of a report by component and side."""
    least = report["limits"]["min_assessed"]
    open_ = {(c["component"], s) for c in report["clearing"] if not c["passed"] for s in Side(c["side"]).sides}
    out: dict[Part, SideCoverage] = {}
    for row in report["coverage"]:
        judged = sum(v for k, v in row["seconds"].items() if k in DECIDED)
        decided, driving, tier = row["decided_driving_s"], row["driving_s"], row["tier"]
        limited = is_limited(report["verdict"], row["component"])
        shown = not limited and (row["component"], row["side"]) not in open_
        long_enough = tier is not Tier.NONE and is_judged(decided, driving, least)
        assessed = shown and long_enough
        out[row["component"], row["side"]] = SideCoverage(tier, driving, decided, judged, assessed, shown, long_enough)
    return out


def coverage_changes(
    older: Mapping[Part, SideCoverage],
    newer: Mapping[Part, SideCoverage],
    axles: Iterable[str],
) -> tuple[CoverageChange, ...]:
    """Every component and side of either mission, those that were assessed in one of them alone first."""
    steered = frozenset(axles)
    out = []
    for component, side in dict.fromkeys([*older, *newer]):
        a, b = older.get((component, side)), newer.get((component, side))
        had, has = a is not None and a.assessed, b is not None and b.assessed
        change: CoverageStep = "lost" if had and not has else "gained" if has and not had else ""
        kind = Kind.STEER if component in steered else Kind.WHEEL
        out.append(CoverageChange(component, kind, side, a, b, change))
    return tuple(sorted(out, key=lambda c: ("lost", "gained", "").index(c.change)))
