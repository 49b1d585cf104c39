"""A diagnosed mission: what `report.json` holds, and the columns of `report.parquet` beside it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.document import ReportDocument
from diagnosis.results.restored import Layout
from diagnosis.results.size_rows import EpsilonRow
from diagnosis.results.vocabulary import Kind, Severity, Tier
from replay.faults import FaultMode, Side, State
from replay.machine.quantities import OPENING

_TWO_SIDED = 1.96  # standard deviations of 95 % bounds


@dataclass(frozen=True)
class Epsilon:
    """ε̂ with its 95 % bounds [1]."""

    value: float
    low: float
    high: float

    def as_share(self) -> Epsilon:
        """The same within [0, 1], where every fault of the table has its ε."""
        return Epsilon(*(min(1.0, max(0.0, x)) for x in (self.value, self.low, self.high)))

    def with_gain(self, std: float) -> Epsilon:
        """With bounds that hold a gain of the healthy part that is uncertain by this share as well."""
        more = _TWO_SIDED * std * (1.0 - self.value)
        return Epsilon(
            self.value,
            self.value - float(np.hypot(self.value - self.low, more)),
            self.value + float(np.hypot(self.high - self.value, more)),
        )

    def exceeds_table(self, least: float) -> float:
        """Probability that a gain is more than 1 by more than `least` [1], which no row of the tables has."""
        return self.below(-least)

    def below(self, least: float) -> float:
        """Probability that less than `least` is lost [1], by the bounds."""
        std = (self.high - self.low) / (2.0 * _TWO_SIDED)
        return (
            0.5 * math.erfc((self.value - least) / (math.sqrt(2.0) * std)) if std > 0.0 else float(self.value < least)
        )

    def row(self) -> EpsilonRow:
        """The same for ``report.json``."""
        return {"value": self.value, "low": self.low, "high": self.high}


@dataclass(frozen=True)
class Sat:
    """Saturation term: mean, its 95 % bounds, and root mean square, in `unit`."""

    mean: float
    rms: float
    low: float
    high: float
    unit: str

    def as_possible(self) -> Sat:
        """The same within what there can be: no valve opens further than to its end."""
        if self.unit != OPENING:
            return self
        mean, low, high = (min(1.0, max(-1.0, x)) for x in (self.mean, self.low, self.high))
        return Sat(mean, min(self.rms, 1.0), low, high, self.unit)


@dataclass(frozen=True)
class Hypothesis:
    """One explanation of an interval and its probability."""

    side: str
    mode: str
    p: float


@dataclass(frozen=True)
class FaultInterval:
    """One fault.

    Attributes
    ----------
    id : str
        ``F1``, ``F2``, … in order of severity, then time.
    component : str
        Wheel or steering axle.
    kind : Kind
        Of the component.
    start_s, stop_s : float
        Mission time [s], half open.
    start_ns, stop_ns : int
        The same on the log's clock.
    epsilon, sat : Epsilon or None, Sat or None
        None where the mode leaves them undefined or the data do not fix them.
    probability : float
        Probability of side and mode.
    hypotheses : tuple[Hypothesis, ...]
        Alternatives with theirs, most probable first.
    severity : Severity
        By Assumptions 1 and 2.
    advice : str
        What to do.
    evidence : tuple[str, ...]
        What decided, one sentence each with its figures.
    tier : Tier
        Evidence behind it.
    detected_s : float or None
        Mission time [s] at which the same evidence, read without anything later, would have raised the fault; None
        where that is not known.
    check : str
        How a technician checks the part.
    size_note : str
        Why ε̂ is missing, or a bound of it open; else empty.
    about : tuple[str, ...]
        What each sentence of `evidence` gives, as `diagnosis.results.sentence.About` names it; empty where it is none of these.
    """

    id: str
    component: str
    kind: Kind
    side: Side
    mode: FaultMode
    start_s: float
    stop_s: float
    start_ns: int
    stop_ns: int
    epsilon: Epsilon | None
    sat: Sat | None
    probability: float
    hypotheses: tuple[Hypothesis, ...]
    severity: Severity
    advice: str
    evidence: tuple[str, ...]
    tier: Tier
    detected_s: float | None = None
    check: str = ""
    size_note: str = ""
    about: tuple[str, ...] = ()


@dataclass(frozen=True)
class StateSpan:
    """One stretch of one component and side in one state; the spans of a component and side leave no gap."""

    component: str
    side: Literal["sensor", "actuator"]
    state: State
    start_s: float
    stop_s: float
    reason: str = ""


@dataclass(frozen=True)
class Closeups:
    """Stretches with every sample, of a mission whose columns are envelopes.

    Attributes
    ----------
    step : NDArray[np.int64], shape (m,)
        Steps of the mission, increasing; consecutive ones are one stretch.
    columns : Mapping[str, NDArray[np.float32]], each of shape (m,)
        Samples at those steps; NaN where there is none or where a column was not kept.
    """

    step: NDArray[np.int64]
    columns: Mapping[str, NDArray[Any]]

    def runs(self) -> list[tuple[int, int]]:
        """Places of the first row of each stretch and of the row behind its last."""
        cuts = np.flatnonzero(np.diff(self.step) != 1) + 1
        return [(a, b) for a, b in pairwise([0, *cuts.tolist(), len(self.step)]) if b > a]


@dataclass(frozen=True)
class MissionResult:
    """Everything that a report shows; `report` is JSON, `columns` the time series.

    Attributes
    ----------
    report : ReportDocument
        The document written as ``report.json``.
    columns : Mapping[str, NDArray[np.float32 | np.float64]], each of shape (n,)
        Time series on one uniform axis; ``t`` [s] first. Of long missions they are envelopes: see `replay.arrays.envelope`.
    windows : Closeups or None
        Every sample around the worst faults, where the columns are envelopes.
    layout : Layout or None
        How the columns stood in the file that they were read from.
    """

    report: ReportDocument
    columns: Mapping[str, NDArray[np.float64] | NDArray[np.float32]] = field(default_factory=dict)
    windows: Closeups | None = None
    layout: Layout | None = None


_LEAVES = frozenset({str, int, bool, type(None)})


def _plain(value: Any) -> Any:
    """JSON value of a dataclass field: no NaN, no NumPy types, floats rounded to nine digits."""
    if isinstance(value, dict):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(v) for v in value]
    if isinstance(value, float | np.floating):
        return float(f"{float(value):.9g}") if math.isfinite(value) else None
    if isinstance(value, np.integer):
        return int(value)
    if isinstance(value, np.bool_):
        return bool(value)
    return value


def to_json(value: Any) -> Any:
    """Turn a dataclass, mapping or sequence into plain JSON values; NaN becomes null."""
    if (kind := value.__class__) in _LEAVES:
        return value
    if kind is float:
        return _plain(value)
    if hasattr(value, "__dataclass_fields__"):
        return {name: to_json(getattr(value, name)) for name in value.__dataclass_fields__}
    if isinstance(value, Mapping):
        return {str(k): to_json(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [to_json(v) for v in value]
    return _plain(value)
