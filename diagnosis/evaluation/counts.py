"""What an evaluation counts; the counts of many missions add up."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import inf

import numpy as np
from numpy.typing import NDArray

from diagnosis.results import fault_rows
from replay.faults import Side, State

Array = NDArray[np.float64]

SIDES: tuple[str, ...] = (Side.SENSOR.value, Side.ACTUATOR.value)
TRUE_STATES: tuple[str, ...] = tuple(row.value for row in fault_rows.ROWS)
COLUMNS = (*TRUE_STATES, State.OUTSIDE_TABLE.value, "undecided")
FAULT_OUTCOMES = ("right", "wrong_mode", "wrong_side", "wrong_part", "missed")
REPORT_OUTCOMES = ("right", "wrong_mode", "wrong_side", "wrong_part", "surplus")

# Bands: low ≤ value < high; the last one holds its upper end.
EPSILON_BANDS = ((0.0, 0.2), (0.2, 0.4), (0.4, 0.7), (0.7, 1.0))
SPEED_BANDS = ((0.0, 0.12), (0.12, 0.24), (0.24, inf))  # [m/s]: thirds of the paper's machine
CONTACT = ("free", "slip", "masked")
BANDS = {"epsilon": len(EPSILON_BANDS), "speed": len(SPEED_BANDS), "contact": len(CONTACT)}


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
    detection_delay_s : float or None
        Moment at which the evidence would have raised it causally − first excited sample [s]; None where nothing was
        reported for its component, or the report does not know that moment.
    speed : float or None
        Mean |commanded speed| over its driving time [m/s]; None where the result does not hold it.
    slip_share : float
        Share of its driving time in which the tyre slipped [1].
    onset_seen : bool
        Whether its first excited sample was not masked; else its onset and delay are not known.
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
    detection_delay_s: float | None = None
    speed: float | None = None
    slip_share: float = 0.0
    onset_seen: bool = True


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
    tier : str
        Evidence behind it, as reported.
    epsilon : float or None
        ε̂ [1], as reported.
    speed, slip_share : float or None, float
        As for `FaultOutcome`.
    bounds_hold : bool or None
        Whether its 95 % bounds of ε hold the truth; None where it is not right, states none, or is stuck or silent (ε = 1).
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
    tier: str = ""
    epsilon: float | None = None
    speed: float | None = None
    slip_share: float = 0.0
    bounds_hold: bool | None = None


def _empty(bands: int = 0) -> dict[str, Array]:
    shape = (len(TRUE_STATES), len(COLUMNS))
    return {side: np.zeros((bands, *shape) if bands else shape) for side in SIDES}


def _empty_parts() -> dict[str, dict[str, Array]]:
    return {name: _empty(bands) for name, bands in BANDS.items()}


def _empty_healthy() -> dict[str, Array]:
    return {name: np.zeros(bands) for name, bands in BANDS.items()}


@dataclass(frozen=True)
class Counts:
    """Counts of one group of components (wheels or steering).

    Attributes
    ----------
    seconds : Mapping[str, Array], each of shape (5, 7)
        Per side: driving time by true row (`TRUE_STATES`) and reported column (`COLUMNS`) [s].
    faults, reports : tuple[FaultOutcome, ...], tuple[ReportOutcome, ...]
        Injected and reported faults.
    healthy_s : float
        Time without a fault of a component, averaged over the components [s].
    parts : Mapping[str, Mapping[str, Array]], each of shape (bands, 5, 7)
        `seconds` divided by ``epsilon`` of the true fault (faulty rows alone), by ``speed`` where the result holds
        it, and by ``contact``; the last of `CONTACT` is masked time, which `seconds` does not hold.
    healthy_parts : Mapping[str, Array], each of shape (bands,)
        Driving part of `healthy_s` divided alike [s]; zeros for ``epsilon``.
    """

    seconds: Mapping[str, Array] = field(default_factory=_empty)
    faults: tuple[FaultOutcome, ...] = ()
    reports: tuple[ReportOutcome, ...] = ()
    healthy_s: float = 0.0
    parts: Mapping[str, Mapping[str, Array]] = field(default_factory=_empty_parts)
    healthy_parts: Mapping[str, Array] = field(default_factory=_empty_healthy)


def add(parts: Sequence[Counts]) -> Counts:
    """Counts of many missions as those of one."""
    return Counts(
        seconds={side: sum((p.seconds[side] for p in parts), zero) for side, zero in _empty().items()},
        faults=tuple(f for p in parts for f in p.faults),
        reports=tuple(r for p in parts for r in p.reports),
        healthy_s=float(sum(p.healthy_s for p in parts)),
        parts={
            name: {side: sum((p.parts[name][side] for p in parts), zero) for side, zero in empty.items()}
            for name, empty in _empty_parts().items()
        },
        healthy_parts={
            name: sum((p.healthy_parts[name] for p in parts), zero) for name, zero in _empty_healthy().items()
        },
    )


def band_of(value: float, bands: Sequence[tuple[float, float]]) -> int:
    """Index of the band that holds a value; beyond the last one it is the last. In the unit of the bands."""
    return next((i for i, (_, high) in enumerate(bands) if value < high), len(bands) - 1)
