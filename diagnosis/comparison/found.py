"""Faults of one mission as it states them, gathered by component, side and row."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from diagnosis.comparison.coverage import SideCoverage
from diagnosis.results.candidates import candidates_of
from diagnosis.results.document import IntervalRow, ReportDocument, StateRow
from diagnosis.results.ending import HEALTHY_S, healthy_after
from diagnosis.results.size_rows import EpsilonRow
from diagnosis.results.vocabulary import Kind, Severity, Tier
from replay.faults import FaultMode, Side

Sides = Mapping[tuple[str, str], SideCoverage]


@dataclass(frozen=True)
class FoundFault:
    """All faults of one mission on one component and side in one row.

    Attributes
    ----------
    component, kind, side, mode : str, Kind, Side, FaultMode
        As in `diagnosis.results.result.FaultInterval`.
    ids : tuple[str, ...]
        Their numbers in the report.
    seconds : float
        Time of all of them [s].
    share : float or None
        The same as a share of the time in which the side was judged; None where that is not known.
    severity : Severity
        The worst.
    epsilon : EpsilonRow or None
        ``value``, ``low``, ``high`` of the longest of the worst ones.
    probability : float
        Of the same one.
    tier : Tier
        Strongest evidence.
    recovered : bool
        Whether the part was healthy again in the same mission, for a second or more behind the end of one of them.
    rows : tuple[str, ...]
        Rows that it may be, where none of them has the majority in the same one, the likeliest first; else empty.
    longest_s : float
        Time of the longest of them [s].
    """

    component: str
    kind: Kind
    side: Side
    mode: FaultMode
    ids: tuple[str, ...]
    seconds: float
    share: float | None
    severity: Severity
    epsilon: EpsilonRow | None
    probability: float
    tier: Tier
    recovered: bool = False
    rows: tuple[str, ...] = ()
    longest_s: float = 0.0


def found_faults(report: ReportDocument, sides: Sides) -> list[FoundFault]:
    """Gather a report's faults by component, side and row, worst first; `sides` from `sides_of`."""
    groups: dict[tuple[str, Side, FaultMode], list[IntervalRow]] = {}
    for i in report["intervals"]:
        groups.setdefault((i["component"], i["side"], i["mode"]), []).append(i)
    out = [_found(key, faults, sides, report["states"]) for key, faults in groups.items()]
    return sorted(out, key=lambda f: (-f.severity.rank, -f.seconds, f.component, f.side, f.mode))


def _found(
    key: tuple[str, Side, FaultMode], faults: Sequence[IntervalRow], sides: Sides, states: Sequence[StateRow]
) -> FoundFault:
    component, side, mode = key
    first = max(faults, key=lambda f: (f["severity"].rank, f["stop_s"] - f["start_s"]))
    seconds = float(sum(f["stop_s"] - f["start_s"] for f in faults))
    judged = [sides[k].judged_s for k in keys_of(component, side) if k in sides]
    epsilon = first["epsilon"]
    return FoundFault(
        component=component,
        kind=first["kind"],
        side=side,
        mode=mode,
        ids=tuple(f["id"] for f in faults),
        seconds=seconds,
        share=seconds / max(judged) if judged and max(judged) > 0 else None,
        severity=first["severity"],
        epsilon=epsilon,
        probability=first["probability"],
        tier=max((f["tier"] for f in faults), key=lambda tier: tier.strength),
        rows=candidates_of(first),
        longest_s=max(f["stop_s"] - f["start_s"] for f in faults),
        recovered=healthy_after(*key[:2], min(f["stop_s"] for f in faults), states) >= HEALTHY_S,
    )


def keys_of(component: str, side: Side) -> list[tuple[str, Side]]:
    """Component and side of the parts that a fault may sit in."""
    sides = (Side.SENSOR, Side.ACTUATOR) if side is Side.SENSOR_OR_ACTUATOR else (side,)
    return [(component, s) for s in sides]
