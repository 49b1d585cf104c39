"""`report.json` as types: the document that pages, comparison, audit and scripts read.

Fields may be added within the schema, none renamed or removed. All times are seconds from the mission's start unless a
name ends in ``_ns``; speeds are m/s (of joints in the unit of `MachineRow.words`), angles rad, shares and ε plain numbers; what is not known is null.
"""

from __future__ import annotations

from typing import Final, Literal, NotRequired, TypedDict

from diagnosis.results.clearing_rows import ClearingRow, DetectabilityTable
from diagnosis.results.comparison_document import PreviousRow
from diagnosis.results.document_numbers import Probability, Seconds
from diagnosis.results.event_row import EventRow
from diagnosis.results.fleet_note_row import FleetNoteRow
from diagnosis.results.log_rows import LogRow
from diagnosis.results.loop_rows import MetricsRow
from diagnosis.results.size_rows import EpsilonRow, SatRow
from diagnosis.results.vocabulary import Kind, Severity, Tier, Verdict
from diagnosis.results.words_row import Worded
from replay.faults import FaultMode, Side, State

SCHEMA: Final = "mfhca-report/1"
#: Source of a machine's settings where no machine file was given.
PAPER_DEFAULTS: Final = "paper defaults"


class ToolRow(TypedDict):
    """Program that made the document."""

    name: str
    version: str


class WheelPlace(TypedDict):
    """Where a wheel is [m]."""

    x: float
    y: float
    offset: float
    axle: str


class MachineIdentity(TypedDict):
    """What tells machines apart."""

    id: str
    wheels: list[str]


class MachineRow(MachineIdentity, Worded):
    """The machine, where its settings come from, and in `assumed` which numbers are the paper's machine's for want of its own.

    `unpowered` has the wheels without a drive, of which only the speed is judged; absent where all have one.

    Speeds are in `words.speed_unit`, which is m/s but for joints.
    """

    name: str
    axles: list[str]
    geometry: dict[str, WheelPlace] | None
    source: str
    assumed: list[str]
    unpowered: NotRequired[list[str]]


class ReadingRow(TypedDict):
    """How one of the paper's equations was read."""

    name: str
    value: str
    detail: str


class ActionRow(TypedDict):
    """What to do about one part.

    `lead`: the order and the part, with which `text` begins; `check`: how to go about it, of the part's worst fault.
    """

    n: int
    text: str
    lead: NotRequired[str]
    check: NotRequired[str]
    faults: list[str]
    severity: Severity


class PartRow(TypedDict):
    """One side of one wheel, joint or axle."""

    component: str
    side: str


class ToClearRow(TypedDict):
    """What keeps the machine from being cleared, in a sentence, and what would clear it, to follow *to clear it*.

    `parts` has the parts that it is of, empty where it is of the whole machine; `fault` the fault that alone is the reason, else empty;
    `why` of parts that were not judged why not, else empty. Results of earlier versions lack these three.
    """

    reason: str
    act: str
    parts: NotRequired[list[PartRow]]
    fault: NotRequired[str]
    why: NotRequired[str]


class CutRow(TypedDict):
    """In which way what was judged is not the whole mission: ``log`` or ``data`` (of its time), ``wheels`` or ``steering`` (of the machine).

    `components` has the wheels or axles that it is of; empty: the whole machine.
    """

    kind: str
    components: list[str]


class VerdictRow(TypedDict):
    """Whether the machine may go out, and why not; `scope` has why what was judged is not the whole mission.

    `cuts` has the kind of each reason in `scope`, `to_clear` each reason against *ready* beside the faults; results of earlier versions
    lack them.
    """

    status: Verdict
    cleared: bool
    not_cleared: str
    title: str
    text: str
    scope: list[str]
    cuts: NotRequired[list[CutRow]]
    caveats: list[str]
    actions: list[ActionRow]
    to_clear: NotRequired[list[ToClearRow]]


class HypothesisRow(TypedDict):
    """One explanation of an interval and its probability; side ``none`` goes with mode ``healthy``."""

    side: str
    mode: str
    p: Probability


class IntervalRow(TypedDict):
    """One fault; see `diagnosis.results.result.FaultInterval`.

    `about`: what each sentence of `evidence` gives, as `diagnosis.results.sentence.About` names it, empty where it is none of these;
    results of earlier versions lack it.
    """

    id: str
    component: str
    kind: Kind
    side: Side
    mode: FaultMode
    start_s: Seconds
    stop_s: Seconds
    start_ns: int
    stop_ns: int
    epsilon: EpsilonRow | None
    sat: SatRow | None
    probability: Probability
    hypotheses: list[HypothesisRow]
    severity: Severity
    advice: str
    evidence: list[str]
    tier: Tier
    detected_s: Seconds | None
    check: NotRequired[str]
    size_note: NotRequired[str]
    about: NotRequired[list[str]]


class StateRow(TypedDict):
    """One component and side in one state."""

    component: str
    side: Literal["sensor", "actuator"]
    state: State
    start_s: Seconds
    stop_s: Seconds
    reason: str


class PhaseRow(TypedDict):
    """What the machine was doing: ``standstill``, ``forward``, ``reverse``, ``turning``, of joints ``moving``."""

    name: str
    start_s: Seconds
    stop_s: Seconds


class CoverageRow(TypedDict):
    """How long one component and side was in each state [s]."""

    component: str
    side: Literal["sensor", "actuator"]
    tier: Tier
    seconds: dict[str, float]
    driving_s: Seconds
    decided_driving_s: Seconds


class LossRow(TypedDict):
    """Loss of effectiveness of one part over the whole mission, and the driving time behind it.

    `relative`: against the other wheels, so that only its change over missions counts.
    """

    component: str
    side: str
    epsilon: EpsilonRow
    seconds: float
    relative: bool


class SignalRow(TypedDict):
    """One signal: where it was found, and how it was recorded."""

    name: str
    channel: str
    unit: str
    recorded_unit: str
    rate_hz: float | None
    samples: int
    gaps: int
    longest_gap_s: float | None
    missing_share: float | None
    lsb: float | None
    guessed: bool
    source: str


class MissingRow(TypedDict):
    """A signal that is not in the log, and what that costs the diagnosis."""

    name: str
    cost: str


class QualityRow(TypedDict):
    """One check of the data."""

    check: str
    result: str
    effect: str
    ok: bool


class LimitsRow(TypedDict):
    """Limits of the machine file; see `replay.machine.config.Limits`."""

    brief: float
    min_probability: float
    min_epsilon: float
    min_sat: float
    min_assessed: float
    driving_speed: float
    clear_at: float


class ReportDocument(TypedDict):
    """`report.json`: one mission, its verdict, faults, states, coverage and data.

    `previous` is there where the mission was compared with another one of the machine; `fleet` in the newest report of an audited machine
    where the fleet knows more than the mission; `events` where something happened to the machine as a whole, the verdict's first.
    """

    schema: Literal["mfhca-report/1"]
    tool: ToolRow
    log: LogRow
    machine: MachineRow
    readings: list[ReadingRow]
    verdict: VerdictRow
    intervals: list[IntervalRow]
    events: NotRequired[list[EventRow]]
    states: list[StateRow]
    phases: list[PhaseRow]
    coverage: list[CoverageRow]
    loss: list[LossRow]
    clearing: list[ClearingRow]
    detectability: DetectabilityTable
    metrics: MetricsRow
    signals: list[SignalRow]
    missing: list[MissingRow]
    quality: list[QualityRow]
    limits: LimitsRow
    previous: NotRequired[PreviousRow]
    fleet: NotRequired[FleetNoteRow]
