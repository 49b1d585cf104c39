"""`fleet.json` as types, schema ``mfhca-fleet/1``: the document that fleet page, table, comparison and scripts read.

Fields may be added within the schema, none renamed or removed, nor change their meaning. Lengths are in seconds and
metres, ε and shares plain numbers, times nanoseconds since 1970; what is not known is null. A *place* is an index into the
document's list ``machines`` or ``missions``. Kinds, sides and modes are the words of the missions' reports, which may be
of other versions of the tool.
"""

from __future__ import annotations

from typing import NotRequired, TypedDict

from diagnosis.audit.fleet.baseline_types import BaselineRow
from diagnosis.audit.fleet.fault_types import FleetFaultRow, MissionFaultRow
from diagnosis.audit.fleet.trend_types import Axis, TrendRow
from diagnosis.audit.store.outcome import MissionState
from diagnosis.results.vocabulary import Leave, Verdict
from diagnosis.results.words_row import Worded

SCHEMA = "mfhca-fleet/1"


class AuditRow(TypedDict):
    """The audit run: its number in this store, when its newest result was made, and what it noted of the files it was given."""

    run: int | None
    made_ns: int | None
    notes: list[str]


class FleetVerdictRow(TypedDict):
    """Verdict on the fleet: the worst machine's, a few words, a sentence, and the sentences behind it."""

    status: Verdict
    tag: str
    title: str
    text: list[str]


class CountsRow(TypedDict):
    """Numbers of machines, missions and faults.

    Attributes
    ----------
    machines, missions : int
        All of them.
    counted : int
        Missions that machines, faults and trends count: those with a report, copies of a log once.
    states : dict[str, int]
        How missions ended.
    not_assessed : int
        Missions that were read, but whose verdict is *not assessed*; copies of a log once.
    unknown : int
        Missions that were not judged, are perhaps newer than what was, and of no known machine.
    pending : int
        Missions that are not audited yet.
    copies : int
        Missions whose log stands under another name too.
    gone : int
        Missions whose log is no longer there.
    undated : int
        Missions whose clock does not know the date or is more than a day ahead, or with another one of the machine that
        starts at the same moment.
    with_faults : int
        Missions with a fault.
    driving_s, distance_m : float
        Of all judged missions.
    decided : float or None
        Share of the driving time that was judged.
    faults : dict[str, int]
        Number of faults by `Status`.
    first_ns, last_ns : int or None
        Start of the first and last dated mission.
    """

    machines: int
    missions: int
    counted: int
    states: dict[str, int]
    not_assessed: int
    unknown: int
    pending: int
    copies: int
    gone: int
    undated: int
    with_faults: int
    driving_s: float
    distance_m: float
    decided: float | None
    faults: dict[str, int]
    first_ns: int | None
    last_ns: int | None


class PartRow(TypedDict):
    """One component and side of a machine: missions that assessed it, the last one among them, and missions by mode, or by *faulty, kind unclear*."""

    component: str
    side: str
    kind: str
    assessed: int
    assessed_last: bool | None
    modes: dict[str, int]


class SuspicionRow(TypedDict):
    """What an earlier mission held against a part without a fault, and nothing settled since: in words, that mission's place, and how many before it did so too."""

    text: str
    mission: int
    again: int


class MachineRow(Worded):
    """One machine.

    Attributes
    ----------
    id, name, label : str
        Identity and name, either may be empty, and what to call it.
    verdict : Verdict
        Where it stands.
    standing : str
        The same in words.
    last_verdict : Verdict
        Of its last judged mission.
    last_judged_ns : int or None
        Start of that mission.
    leave : Leave
        Whether it may go out: by its reports, and by what of earlier missions is open.
    cleared : bool
        Whether `leave` is *may go out*.
    last_cleared : bool or None
        Whether the report of its last judged mission alone lets it go out, and that of each which may be later; null: not said.
    not_cleared : str
        Why that report does not let it go out; empty where it does, or is not of faults to watch.
    open_points : list[str]
        What its newest report leaves open without naming a fault, each with its parts.
    suspicions : list[SuspicionRow]
        What its last ten missions but the newest one held against a part without a fault, and nothing settled since.
    outdated : bool
        Whether the last report says that a fault of an earlier mission is open which is not any more: it was repaired since.
    unjudged : int
        Missions that were not judged and may be later: such a machine is not ``ready``.
    note : str
        What limits that; may be empty.
    missions, undated, failed : list[int]
        Places of its missions: those with a date in its order, those without, and those without a report.
    with_faults : int
        Missions with a fault.
    driving_s : float
        Of all judged missions.
    decided : float or None
        Share of the driving time that was judged.
    min_epsilon : float
        Limit of ε.
    parts : list[PartRow]
        Its components and sides.
    """

    id: str
    name: str
    label: str
    verdict: Verdict
    standing: str
    last_verdict: Verdict
    last_judged_ns: int | None
    leave: NotRequired[Leave]
    cleared: NotRequired[bool]
    last_cleared: bool | None
    not_cleared: NotRequired[str]
    open_points: NotRequired[list[str]]
    suspicions: NotRequired[list[SuspicionRow]]
    outdated: NotRequired[bool]
    unjudged: int
    note: str
    missions: list[int]
    undated: list[int]
    failed: list[int]
    with_faults: int
    driving_s: float
    decided: float | None
    min_epsilon: float
    parts: list[PartRow]


class MissionRow(TypedDict):
    """One mission; what comes from its result is not there where it is not audited yet.

    Attributes
    ----------
    name : str
        Of the mission.
    files : list[str]
        Its files, relative to the store's folder, or URLs.
    bytes : int
        Their size.
    gone : bool
        Whether the log is no longer there.
    machine : int or None
        Place of the machine.
    state, reason
        How its audit ended, or ``pending``.
    verdict : Verdict or None
        Null where there is no report.
    faults : list[MissionFaultRow]
        Those of at least low severity, worst first.
    title : str
        The verdict in words.
    start_ns, duration_s, driving_s, distance_m
        From its report.
    open_loop : bool
        Whether faults were injected into the log.
    attempts : int
        Attempts at it.
    version : str
        Of the tool that judged it.
    report : str or None
        Folder of the report.
    first_run : int or None
        Audit run that judged it first; null: not known.
    judged : bool
        Whether every part of a wheel was judged long enough: of a mission without a verdict, that it did not clear its machine, and no less.
    copy_of : str or None
        Name of the mission that this one is a copy of.
    """

    name: str
    files: list[str]
    bytes: int
    gone: bool
    machine: int | None
    state: MissionState
    reason: str
    verdict: Verdict | None
    faults: list[MissionFaultRow]
    title: NotRequired[str]
    start_ns: NotRequired[int | None]
    duration_s: NotRequired[float | None]
    driving_s: NotRequired[float | None]
    distance_m: NotRequired[float | None]
    open_loop: NotRequired[bool]
    attempts: NotRequired[int]
    version: NotRequired[str]
    report: NotRequired[str | None]
    first_run: NotRequired[int | None]
    judged: NotRequired[bool]
    copy_of: NotRequired[str | None]


class FleetDocument(TypedDict):
    """`fleet.json`.

    Attributes
    ----------
    schema, version : str
        Of the document and of the tool.
    axis : Axis
        Of the trends.
    audit, verdict, counts
        Of the whole fleet.
    machines : list[MachineRow]
        Worst first.
    faults : list[FleetFaultRow]
        Of all machines, in their order.
    trends : list[TrendRow]
        Of all machines, in their order.
    missions : list[MissionRow]
        By machine and time.
    baseline : BaselineRow or None
        What changed against another audit.
    mark : str
        Of the store's content when the document was begun; another mark there means that it is out of date.
    """

    schema: str
    version: str
    axis: Axis
    audit: AuditRow
    verdict: FleetVerdictRow
    counts: CountsRow
    machines: list[MachineRow]
    faults: list[FleetFaultRow]
    trends: list[TrendRow]
    missions: list[MissionRow]
    baseline: BaselineRow | None
    mark: NotRequired[str]
