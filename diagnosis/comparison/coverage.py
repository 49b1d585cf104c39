"""What of a machine was assessed in two missions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from replay.faults import FAULT_STATES, State

_LEAST_SHARE, _HARDLY = 0.8, 0.5
_DECIDED = frozenset({State.HEALTHY.value, *(s.value for s in FAULT_STATES)})


@dataclass(frozen=True)
class SideCoverage:
    """How long one component and side was judged in one mission.

    Attributes
    ----------
    tier : str
        Evidence, ``none`` where there is none.
    driving_s, decided_s : float
        Driving time, and how much of it was decided [s].
    judged_s : float
        Decided time of the whole mission [s].
    assessed : bool
        Whether that is as much as a verdict of ``ready`` takes: `min_assessed` seconds and four fifths of the driving.
    """

    tier: str
    driving_s: float
    decided_s: float
    judged_s: float
    assessed: bool

    @property
    def words(self) -> str:
        """How far it was judged, to follow *was*."""
        if self.tier == "none":
            return "not assessed"
        return f"judged for {self.decided_s:.1f} s of {self.driving_s:.1f} s driving" + (
            "" if self.assessed else ", which is too little"
        )

    @property
    def short_words(self) -> str:
        """How little it was judged, to follow *was*: not, hardly (less than half of the driving) or partly."""
        if self.tier == "none" or not self.judged_s:
            return "not assessed"
        much = "hardly" if self.decided_s < _HARDLY * self.driving_s else "only partly"
        return f"{much} assessed ({self.decided_s:.1f} of {self.driving_s:.1f} s of driving)"


@dataclass(frozen=True)
class CoverageChange:
    """One component and side in both missions; None where a result does not hold it.

    `change` is ``lost`` where it was assessed in the older mission alone, ``gained`` in the newer alone, else empty.
    """

    component: str
    kind: str
    side: str
    older: SideCoverage | None
    newer: SideCoverage | None
    change: str


def sides_of(report: Mapping[str, Any]) -> dict[tuple[str, str], SideCoverage]:
    """Coverage of a report by component and side."""
    least = float(report.get("limits", {}).get("min_assessed", 10.0))
    out = {}
    for row in report.get("coverage", ()):
        seconds = {str(k): float(v) for k, v in row["seconds"].items()}
        judged = sum(v for k, v in seconds.items() if k in _DECIDED)
        decided = float(row["decided_driving_s"])
        driving = float(row.get("driving_s", decided))
        tier = str(row.get("tier", "model" if decided else "none"))
        assessed = tier != "none" and decided >= max(least, _LEAST_SHARE * driving)
        out[str(row["component"]), str(row["side"])] = SideCoverage(tier, driving, decided, judged, assessed)
    return out


def coverage_changes(
    older: Mapping[tuple[str, str], SideCoverage],
    newer: Mapping[tuple[str, str], SideCoverage],
    axles: Iterable[str],
) -> tuple[CoverageChange, ...]:
    """Every component and side of either mission, those that were assessed in one of them alone first."""
    steered = frozenset(axles)
    out = []
    for component, side in dict.fromkeys([*older, *newer]):
        a, b = older.get((component, side)), newer.get((component, side))
        had, has = a is not None and a.assessed, b is not None and b.assessed
        change = "lost" if had and not has else "gained" if has and not had else ""
        kind = "steer" if component in steered else "wheel"
        out.append(CoverageChange(component, kind, side, a, b, change))
    return tuple(sorted(out, key=lambda c: ("lost", "gained", "").index(c.change)))
