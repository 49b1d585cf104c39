"""A fleet's document as its page shows it: names made visible, missions and faults with the addresses of their pages."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import PurePosixPath
from typing import NotRequired, TypedDict
from urllib.parse import quote

from diagnosis.audit.fleet.baseline_types import CoverageChangeRow, MachineChangesRow, MissionChangesRow
from diagnosis.audit.fleet.fault_types import FaultChangeRow, FleetFaultRow
from diagnosis.audit.fleet.fleet_types import (
    AuditRow,
    CountsRow,
    FleetDocument,
    FleetVerdictRow,
    MachineRow,
    MissionRow,
)
from diagnosis.audit.fleet.trend_types import Axis
from diagnosis.pages import labels

#: Values that a template fills in.
Context = dict[str, object]


class ShownMission(MissionRow):
    """A mission with the address of its page; empty where it has none."""

    address: str


class ShownFaultChange(FaultChangeRow):
    """A fault in both audits with the address of its place in its last mission's page."""

    address: str


class ShownMissions(Sequence[ShownMission]):
    """Missions as the page shows them, each made when it is asked for: of a large fleet few are.

    Attributes
    ----------
    as_found : Sequence[MissionRow]
        The same as the document has them.
    """

    def __init__(self, missions: Sequence[MissionRow]) -> None:
        self.as_found = missions
        self._made: dict[int, ShownMission] = {}

    def __len__(self) -> int:
        return len(self.as_found)

    def __getitem__(self, place: int) -> ShownMission:  # type: ignore[override]
        found = self._made.get(place)
        if found is None:
            m = self.as_found[place]
            shown: ShownMission = {**m, "address": address(m.get("report"))}
            found = self._made[place] = labels.made_visible(shown)
        return found


class ShownBaseline(TypedDict):
    """As in `diagnosis.audit.fleet.fleet_types.BaselineRow`."""

    worse: bool
    counts: dict[str, int]
    missions: MissionChangesRow
    machines: MachineChangesRow
    faults: list[ShownFaultChange]
    coverage: list[CoverageChangeRow]


class ShownDocument(TypedDict):
    """As in `diagnosis.audit.fleet.fleet_types.FleetDocument`, without trends."""

    version: str
    axis: Axis
    audit: AuditRow
    verdict: FleetVerdictRow
    counts: CountsRow
    machines: list[MachineRow]
    faults: list[FleetFaultRow]
    missions: NotRequired[ShownMissions]
    baseline: ShownBaseline | None


def shown(document: FleetDocument) -> ShownDocument:
    """A document as the page shows it; names are made visible, addresses lead to the names as they are."""
    found: ShownDocument = {
        "version": document["version"],
        "axis": document["axis"],
        "audit": document["audit"],
        "verdict": document["verdict"],
        "counts": document["counts"],
        "machines": document["machines"],
        "faults": document["faults"],
        "baseline": None,
    }
    earlier = document["baseline"]
    if earlier is not None:
        faults: list[ShownFaultChange] = [
            {**f, "address": fault_address(address(f["newer"]["report"]), f["newer"]["id"]) if f["newer"] else ""}
            for f in earlier["faults"]
        ]
        found["baseline"] = {
            "worse": earlier["worse"],
            "counts": earlier["counts"],
            "missions": earlier["missions"],
            "machines": earlier["machines"],
            "faults": faults,
            "coverage": earlier["coverage"],
        }
    visible: ShownDocument = labels.made_visible(found)
    visible["missions"] = ShownMissions(document["missions"])
    return visible


def address(report: str | None) -> str:
    """Address of a mission's page below this one; empty where the folder is none below this one."""
    if not report:
        return ""
    path = PurePosixPath(report)
    if path.is_absolute() or ".." in path.parts:
        return ""
    return quote(f"{report}/report.html", safe="/", errors="backslashreplace")


def fault_address(page: str, fault: str) -> str:
    """Address of a fault in a mission's page."""
    return f"{page}#fault={quote(fault, safe='')}" if page else ""
