"""What an evaluation counts; the counts of many missions add up."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SIDES = ("sensor", "actuator")
ROWS = ("healthy", "stuck", "no_signal", "inefficient", "noisy")
COLUMNS = (*ROWS, "outside_table", "undecided")
FAULT_OUTCOMES = ("right", "wrong_mode", "wrong_side", "wrong_part", "missed")
REPORT_OUTCOMES = ("right", "wrong_mode", "wrong_side", "wrong_part", "surplus")


@dataclass(frozen=True)
class FaultOutcome:
    """What became of one injected fault.

    Attributes
    ----------
    component, side, mode : str
        Of the fault.
    start_s, stop_s : float
        First sample of the fault and first one after it [s].
    epsilon, driving_share : float
        ε of L4 or L8, and the share of its time that was driving [1].
    outcome : str
        One of `FAULT_OUTCOMES`, else ``not_excited`` or ``masked``: those count nowhere.
    report : str
        Id of the reported fault that it was matched with; empty for none.
    overlap : float
        Intersection over union with it [1].
    onset_error_s, end_error_s : float or None
        Reported start − first excited sample, reported − true end [s]; None where it is not right.
    epsilon_error : float or None
        |ε̂ − ε|; None where it is not right or no ε̂ was given.
    """

    component: str
    side: str
    mode: str
    start_s: float
    stop_s: float
    epsilon: float
    driving_share: float
    outcome: str
    report: str = ""
    overlap: float = 0.0
    onset_error_s: float | None = None
    end_error_s: float | None = None
    epsilon_error: float | None = None


@dataclass(frozen=True)
class ReportOutcome:
    """What a reported fault was worth.

    Attributes
    ----------
    id, component, side, mode, severity : str
        As reported.
    start_s, stop_s, probability : float
        As reported, on the truth's clock.
    outcome : str
        One of `REPORT_OUTCOMES`, else ``ignored``: masked, or matched with a fault that was never excited.
    false_alarm : bool
        Not right, and for more than half of its time no side of the component was faulty.
    """

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


def _empty() -> dict[str, Array]:
    return {side: np.zeros((len(ROWS), len(COLUMNS))) for side in SIDES}


@dataclass(frozen=True)
class Counts:
    """Counts of one group of components (wheels or steering).

    Attributes
    ----------
    seconds : Mapping[str, Array], each of shape (5, 7)
        Per side: driving time by true row (`ROWS`) and reported column (`COLUMNS`) [s].
    faults, reports : tuple[FaultOutcome, ...], tuple[ReportOutcome, ...]
        Injected and reported faults.
    healthy_s : float
        Time without a fault of a component, averaged over the components [s].
    """

    seconds: Mapping[str, Array] = field(default_factory=_empty)
    faults: tuple[FaultOutcome, ...] = ()
    reports: tuple[ReportOutcome, ...] = ()
    healthy_s: float = 0.0


def add(parts: Sequence[Counts]) -> Counts:
    """Counts of many missions as those of one."""
    return Counts(
        seconds={side: sum((p.seconds[side] for p in parts), np.zeros((len(ROWS), len(COLUMNS)))) for side in SIDES},
        faults=tuple(f for p in parts for f in p.faults),
        reports=tuple(r for p in parts for r in p.reports),
        healthy_s=float(sum(p.healthy_s for p in parts)),
    )
