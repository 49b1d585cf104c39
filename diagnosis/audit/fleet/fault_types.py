"""Faults in `fleet.json`, as types; see `diagnosis.audit.fleet.fleet_types`."""

from __future__ import annotations

from typing import Literal, NotRequired, TypedDict

from diagnosis.results.vocabulary import Severity

#: Whether a fault is new, comes and goes, was found once, is past or repaired; see `diagnosis.audit.fleet.machines.FleetFault`.
Status = Literal["new", "recurring", "once", "past", "repaired"]
#: What became of a fault against an earlier audit; see `diagnosis.audit.fleet.compare`.
FaultChange = Literal["new", "worse", "better", "not_seen_again", "resolved", "unchanged"]


class BoundsRow(TypedDict):
    """An estimate with its 95 % bounds."""

    value: float
    low: float
    high: float


class FleetFaultRow(TypedDict):
    """All faults of one machine on one component and side in one row of the tables.

    Attributes
    ----------
    machine : int
        Place of the machine.
    component, kind, side, mode : str
        As in the missions' reports.
    severity : Severity
        The worst since the part was last assessed without it.
    status : Status
        Whether it is new, recurring, found once, past or repaired.
    missions, assessed : int
        Missions with it, of those that assessed the part.
    first, last : int
        Places of its first and last mission.
    last_id : str
        Its name in the report of the last one.
    since : int
        Missions that assessed the part after the last one with it.
    first_run : int or None
        Audit run that brought the first mission with it; null: not known.
    epsilon : BoundsRow or None
        ε̂ in the last one.
    open : bool
        Whether it was of high severity, is not repaired, and was not refuted by enough missions.
    needed, clean : int
        Missions without it after which it is past, and those so far.
    repaired_ns : int or None
        When the part was repaired last, as far as that was recorded.
    unclear : bool
        Whether the report of the last one says that its kind is unclear: `mode` is then the likeliest of several. Absent before.
    """

    machine: int
    component: str
    kind: str
    side: str
    mode: str
    severity: Severity
    status: Status
    missions: int
    assessed: int
    first: int
    last: int
    last_id: str
    since: int
    first_run: int | None
    epsilon: BoundsRow | None
    open: bool
    needed: int
    clean: int
    repaired_ns: int | None
    unclear: NotRequired[bool]


class MissionFaultRow(TypedDict):
    """One fault of one mission; `lasting`: to the end of its log (absent before)."""

    id: str
    component: str
    kind: str
    side: str
    mode: str
    severity: Severity
    seconds: float
    epsilon: BoundsRow | None
    probability: float
    unclear: NotRequired[bool]
    lasting: NotRequired[bool]


class FaultStandingRow(TypedDict):
    """How a fault stands in one of two audits, with the name and report of its last mission and its name in that."""

    side: str
    severity: Severity
    status: Status
    missions: int
    assessed: int
    epsilon: BoundsRow | None
    last: str
    report: str | None
    id: str


class FaultChangeRow(TypedDict):
    """A fault in both audits: what became of it, names of what changed, and what is to be said of it; `unclear` as in `FleetFaultRow`."""

    outcome: FaultChange
    machine: str
    component: str
    kind: str
    side: str
    mode: str
    severity: Severity
    older: FaultStandingRow | None
    newer: FaultStandingRow | None
    changes: list[str]
    note: str
    unclear: NotRequired[bool]
