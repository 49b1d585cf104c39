"""The part of `fleet.json` on an earlier audit: what is new, missing or changed against it."""

from __future__ import annotations

from typing import Literal, NotRequired, TypedDict

from diagnosis.audit.fleet.fault_types import FaultChangeRow
from diagnosis.results.vocabulary import Verdict


class CoverageChangeRow(TypedDict):
    """A part that was assessed in the last mission of one of two audits alone."""

    machine: str
    component: str
    kind: str
    side: str
    change: Literal["lost", "gained"]


class VerdictChangeRow(TypedDict):
    """A machine with another verdict than in the earlier audit."""

    machine: str
    older: Verdict
    newer: Verdict


class MachineChangesRow(TypedDict):
    """Labels of machines that are new and missing, and changed verdicts."""

    new: list[str]
    missing: list[str]
    changed: list[VerdictChangeRow]


class MissionChangesRow(TypedDict):
    """Numbers of missions, and names that the later audit lacks where both hold some of the same missions.

    `new_counted`: how many of the new ones have a report and count, copies of a log once; documents of earlier versions lack it.
    """

    older: int
    newer: int
    new: int
    new_counted: NotRequired[int]
    missing: list[str]


class BaselineRow(TypedDict):
    """An audit against an earlier one; see `diagnosis.audit.fleet.compare`.

    Attributes
    ----------
    worse : bool
        Whether a fault is new or worse, or machines or missions are missing.
    counts : dict[str, int]
        Number of faults by `FaultChange`.
    missions, machines
        Which are new, missing or changed.
    faults : list[FaultChangeRow]
        Faults of either audit.
    coverage : list[CoverageChangeRow]
        Parts that are assessed no longer, or now.
    """

    worse: bool
    counts: dict[str, int]
    missions: MissionChangesRow
    machines: MachineChangesRow
    faults: list[FaultChangeRow]
    coverage: list[CoverageChangeRow]
