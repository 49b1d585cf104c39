"""Two missions of one machine as types: `mfhca compare --json`, and ``previous`` in ``report.json``.

Fields may be added within the schema, none renamed or removed; times are seconds unless a name ends in ``_ns``.
"""

from __future__ import annotations

from typing import Final, Literal, NotRequired, TypedDict

from diagnosis.results.size_rows import EpsilonRow
from diagnosis.results.vocabulary import Kind, Severity, Tier, Verdict
from diagnosis.results.words_row import Worded
from replay.faults import FaultMode, Side

SCHEMA: Final = "mfhca-compare/1"

#: What became of a fault; ``not_seen_again`` is gone although nothing shows that it is repaired.
Status = Literal["new", "changed", "unchanged", "resolved", "not_seen_again"]
#: Way in which a fault changed; empty where it did not.
Trend = Literal["worse", "better", "other", ""]
#: What is counted: the status, of a changed fault its trend.
Outcome = Literal["new", "worse", "other", "better", "not_seen_again", "resolved", "unchanged"]
#: Part of a fault that changed; ``row`` is its mode, ``loss`` its part's loss over the whole mission.
Change = Literal["row", "side", "severity", "epsilon", "duration", "loss"]
#: Whether a part was assessed in one of the missions alone; empty where in both or in neither.
CoverageStep = Literal["lost", "gained", ""]


class OtherMissionRow(TypedDict):
    """One of two missions."""

    files: list[str]
    start_ns: int
    duration_s: float
    driving_s: float
    verdict: Verdict
    title: str
    machine: str
    machine_id: str
    open_loop: bool
    version: str


class ComparedMissionRow(OtherMissionRow):
    """One of two missions, with the name that the comparison calls it by."""

    name: str


class FoundFaultRow(TypedDict):
    """All faults of one mission on one component and side in one row of the tables."""

    component: str
    kind: Kind
    side: Side
    mode: FaultMode
    ids: list[str]
    seconds: float
    share: float | None
    severity: Severity
    epsilon: EpsilonRow | None
    probability: float
    tier: Tier
    recovered: NotRequired[bool]  # missing in documents of earlier versions, as are the following
    rows: NotRequired[list[str]]  # that it may be, where none has the majority
    longest_s: NotRequired[float]


class FaultChangeRow(TypedDict):
    """What became of one fault; `older` and `newer` are null where it was not found."""

    status: Status
    trend: Trend
    component: str
    kind: Kind
    side: Side
    mode: FaultMode
    older: FoundFaultRow | None
    newer: FoundFaultRow | None
    changes: list[Change]
    note: str


class SideCoverageRow(TypedDict):
    """How long one component and side was judged in one mission [s]; `shown`: the whole mission was judged, and cleared it.

    `long_enough`: whether it was judged for as long as `assessed` needs, whatever the checks say.
    """

    tier: Tier
    driving_s: float
    decided_s: float
    judged_s: float
    assessed: bool
    shown: bool
    long_enough: bool


class CoverageChangeRow(TypedDict):
    """One component and side in both missions; null where a result does not hold it."""

    component: str
    kind: Kind
    side: Literal["sensor", "actuator"]
    older: SideCoverageRow | None
    newer: SideCoverageRow | None
    change: CoverageStep


class LossChangeRow(TypedDict):
    """Loss of effectiveness of one part over the whole of either mission."""

    component: str
    side: str
    older: EpsilonRow
    newer: EpsilonRow


class MetricChangeRow(TypedDict):
    """Mean |e| [m/s] and mean |u_a| [fraction of full opening] of a wheel while driving, ``average`` for all."""

    wheel: str
    tracking_error_older: float | None
    tracking_error_newer: float | None
    control_effort_older: float | None
    control_effort_newer: float | None


class PreviousRow(TypedDict):
    """What became of the faults since another mission of the machine; `counts` and `coverage` hold what changed.

    `open_faults` are sentences on severe faults of earlier missions that an audit's fleet holds open when it writes the comparison;
    it is there where there are any, with `open_asof_ns`, when that was written [ns since 1970].
    """

    order: Literal["earlier", "later"]
    mission: OtherMissionRow
    worse: bool
    counts: dict[str, int]
    faults: list[FaultChangeRow]
    coverage: list[CoverageChangeRow]
    loss: list[LossChangeRow]
    notes: list[str]
    open_faults: NotRequired[list[str]]
    open_asof_ns: NotRequired[int]


class ComparisonDocument(Worded):
    """Two missions of one machine, as `mfhca compare --json` prints them: faults that are new, worse, changed, gone."""

    schema: Literal["mfhca-compare/1"]
    worse: bool
    counts: dict[str, int]
    older: ComparedMissionRow
    newer: ComparedMissionRow
    faults: list[FaultChangeRow]
    coverage: list[CoverageChangeRow]
    metrics: list[MetricChangeRow]
    notes: list[str]
