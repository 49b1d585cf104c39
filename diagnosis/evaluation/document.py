"""The scores' document as types: what `mfhca evaluate --json` prints.

Figures are None where there is nothing to divide by. Times are seconds, speeds m/s, ε and shares plain numbers.
"""

from __future__ import annotations

from typing import NotRequired, TypedDict

SCHEMA = "mfhca-evaluation/1"


class Recall(TypedDict):
    """Faults that count, those of them that are right, and their share."""

    faults: int
    right: int
    recall: float | None


class Precision(TypedDict):
    """Reported faults, those of them that are right, and their share."""

    reported: int
    right: int
    precision: float | None


class Spread(TypedDict):
    """Median and 95 % quantile of the size of an error, and its signed median [s]."""

    n: int
    median: float | None
    p95: float | None
    bias: float | None


class Delay(Spread):
    """Detection delay; `without` counts faults whose moment of detection is not known."""

    without: int


class RowFigures(TypedDict):
    """Figures over the driving time of one row."""

    seconds: float
    recall: float | None
    recall_decided: float | None
    precision: float | None
    f1: float | None


class DamadicsRates(TypedDict):
    """False and true detection rate, false and true isolation rate; see `diagnosis.evaluation.confusion`."""

    r_fd: float | None
    r_td: float | None
    r_fi: float | None
    r_ti: float | None


class SideFigures(TypedDict):
    """Figures of one side's driving time, and the confusion [s] of `true` rows and `reported` columns."""

    driving_s: float
    macro_f1: float | None
    balanced_accuracy: float | None
    balanced_accuracy_decided: float | None
    decided_share: float | None
    undecided_share: float | None
    damadics: DamadicsRates
    rows: dict[str, RowFigures]
    true: list[str]
    reported: list[str]
    seconds: list[list[float]]


class EventCounts(TypedDict):
    """Faults and reports matched one to one.

    Isolation, identification and wrong-wheel rate refer to the faults that something was reported for: the share with
    the right component and side, with the right row too, and on another component.
    """

    faults: int
    reported: int
    right: int
    wrong_mode: int
    wrong_side: int
    wrong_part: int
    missed: int
    surplus: int
    precision: float | None
    recall: float | None
    f1: float | None
    detected: int
    isolation_rate: float | None
    identification_rate: float | None
    wrong_wheel_rate: float | None
    not_excited: int
    masked: int


class EpsilonErrors(TypedDict):
    """Mean |ε̂ − ε| over right faults, and over those whose ε is not fixed by the row (`partial`)."""

    n: int
    without: int
    mae: float | None
    mae_partial: float | None
    n_partial: int


class FalseAlarms(TypedDict):
    """Alarms per healthy hour with the upper 95 % bound of a Poisson count; those of severity info apart."""

    count: int
    info: int
    healthy_h: float
    per_hour: float | None
    per_hour_high: float | None


class EventFigures(TypedDict):
    """All figures of a set of faults and of the reports that belong to it."""

    events: EventCounts
    onset_error_s: Spread
    detection_delay_s: Delay
    end_error_s: Spread
    epsilon: EpsilonErrors
    false_alarms: FalseAlarms


class AllFigures(EventFigures):
    """The same with the figures of each side's driving time."""

    sides: dict[str, SideFigures]


class ModeFigures(Recall, EventFigures):
    """Figures of one row of the tables."""

    side: str
    mode: str
    epsilon_mae: float | None
    time: RowFigures | None


class BandFigures(Recall, AllFigures):
    """Figures of a band of ε or speed; `high` None: no upper end."""

    low: float
    high: float | None


class ContactFigures(Recall, AllFigures):
    """Figures by what tyre and sensor let through: ``free``, ``slip``, ``masked``."""

    contact: str


class ExcitationRecall(Recall):
    """Recall of a band of the share of driving in a fault's time."""

    low: float
    high: float


class SeverityPrecision(Precision):
    """Precision of one severity as reported."""

    severity: str


class ProbabilityBin(TypedDict):
    """Stated probability against the share that was right, in one bin."""

    low: float
    high: float
    reported: int
    probability: float | None
    right: float | None


class ReliabilityFigures(TypedDict):
    """How well stated probabilities hold: counts, Brier score, expected calibration error, bins.

    `bounds` right reports give 95 % bounds of ε; `bounds_hold` is the share of these that hold the truth.
    """

    reported: int
    right: int
    brier: float | None
    ece: float | None
    bounds: int
    bounds_hold: float | None
    bins: list[ProbabilityBin]


class Reliability(ReliabilityFigures):
    """The same for one tier and side; ``all`` for both together."""

    tier: str
    side: str


class Figures(AllFigures):
    """All figures of one group of components."""

    modes: list[ModeFigures]
    by_epsilon: list[BandFigures]
    by_speed: list[BandFigures]
    by_contact: list[ContactFigures]
    by_excitation: list[ExcitationRecall]
    by_severity: list[SeverityPrecision]
    reliability: list[Reliability]
    calibration: list[ProbabilityBin]


class FaultRow(TypedDict):
    """What became of one injected fault; see `diagnosis.evaluation.counts.FaultOutcome`."""

    component: str
    side: str
    mode: str
    start_s: float
    stop_s: float
    epsilon: float
    driving_share: float
    outcome: str
    report: str
    overlap: float
    onset_error_s: float | None
    end_error_s: float | None
    epsilon_error: float | None
    detection_delay_s: float | None
    speed: float | None
    slip_share: float
    onset_seen: bool


class ReportRow(TypedDict):
    """What one reported fault was worth; see `diagnosis.evaluation.counts.ReportOutcome`."""

    id: str
    component: str
    side: str
    mode: str
    severity: str
    start_s: float
    stop_s: float
    probability: float
    outcome: str
    false_alarm: bool
    tier: str
    epsilon: float | None
    speed: float | None
    slip_share: float
    bounds_hold: bool | None


class MissionFigures(Figures):
    """Figures of one mission with its faults and reports."""

    faults: list[FaultRow]
    reported: list[ReportRow]


class ResultRow(TypedDict):
    """One result: its figures for wheels and steering, each where the result holds such components.

    `left_out`: components with faults that the result does not hold; `not_driven`: faults during which the part was not driven.
    """

    result: str
    truth: str
    left_out: list[str]
    not_driven: list[str]
    wheel: NotRequired[MissionFigures]
    steer: NotRequired[MissionFigures]


class ScoresDocument(TypedDict):
    """Scores of results against the truth; `all` pools them by ``wheel`` and ``steer``."""

    schema: str
    results: list[ResultRow]
    all: dict[str, Figures]
