"""What an assessor hands on for one component and side: findings, states and evidence columns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import astuple, dataclass, field, replace
from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.detectability import Powers
from diagnosis.results.loss import Loss
from diagnosis.results.result import Closeups, Epsilon, Hypothesis, Sat
from diagnosis.results.vocabulary import Tier
from replay.faults import TOTAL, FaultMode, Side, State

_LEAST = 0.1  # ε̂ of the smallest fault; below it a varying saturation term is not told from it
_BOUND = 0.95  # of which the bounds of ε̂ speak
STATES: tuple[State, ...] = tuple(State)
CODE = {state: np.int8(i) for i, state in enumerate(STATES)}


@dataclass(frozen=True)
class Finding:
    """One fault of one component on samples [start, stop); see `FaultInterval` for the other fields.

    `epsilon` keeps within [0, 1] unless the fault lies outside the table; a size that is not finite is not known. `detected` is the sample at which a causal reading of the same evidence, without anything later, would have raised
    it; None where that is not known.
    """

    start: int
    stop: int
    side: Side
    mode: FaultMode
    probability: float
    hypotheses: tuple[Hypothesis, ...]
    epsilon: Epsilon | None
    sat: Sat | None
    evidence: tuple[str, ...]
    tier: Tier
    detected: int | None = None

    def __post_init__(self) -> None:
        if self.epsilon is not None and self.mode is not FaultMode.OUTSIDE_TABLE:
            known = self.epsilon.high > 0.0  # a fault of the tables that takes nothing away has no such size
            object.__setattr__(self, "epsilon", self.epsilon.as_share() if known else None)
            self._bound_by_row()
        if self.sat is not None and self.mode.varying and (self.epsilon is None or self.epsilon.value < _LEAST):
            object.__setattr__(self, "sat", None)  # ε·sat is known, but not what share of sat that is
        if self.sat is not None:
            object.__setattr__(self, "sat", self.sat.as_possible())
        for name in ("epsilon", "sat"):
            size = getattr(self, name)
            if size is not None and not all(isfinite(x) for x in astuple(size) if isinstance(x, float)):
                object.__setattr__(self, name, None)

    def _bound_by_row(self) -> None:
        """Where the readings do not bound what a stuck or silent part has lost, its rows do: all (ε = 1), else what counts as a fault."""
        if self.mode.total and self.epsilon is not None and self.epsilon.low <= 0.0:
            total, healthy = (
                sum(h.p for h in self.hypotheses if h.mode in modes) for modes in (TOTAL, {State.HEALTHY.value})
            )
            low = 1.0 if total >= _BOUND else _LEAST if healthy <= 1.0 - _BOUND else 0.0
            object.__setattr__(self, "epsilon", replace(self.epsilon, low=low))


@dataclass(frozen=True)
class Assessment:
    """One component and side over the whole mission.

    Attributes
    ----------
    states : NDArray[np.int8], shape (n,)
        Index into `STATES` of each sample.
    reasons : Mapping[State, str]
        Why a state that is no judgement was given.
    findings : tuple[Finding, ...]
        Faults in order of time.
    columns : Mapping[str, NDArray[np.float32 | np.float64]], each of the rows of `replay.arrays.envelope` for n steps
        Evidence series by leaf name (``residual``, ``threshold``, ``delta``, …).
    tier : Tier
        Evidence behind it; `Tier.NONE` where nothing is judged.
    notes : tuple[str, ...]
        Figures that the judgement used, one sentence each.
    unexplained_s : float
        Time [s] in which something deviates that no single fault explains well enough to be stated.
    closeups : Closeups or None
        Every sample of `columns` around the findings, where they are envelopes.
    loss : Loss or None
        Loss of effectiveness over the mission, where a second measurement shows it.
    powers : Powers or None
        What the mission would have shown to this evidence; None: as to the checks of the all-clear.
    """

    states: NDArray[np.int8]
    reasons: Mapping[State, str] = field(default_factory=dict)
    findings: tuple[Finding, ...] = ()
    columns: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    tier: Tier = Tier.NONE
    notes: tuple[str, ...] = ()
    unexplained_s: float = 0.0
    closeups: Closeups | None = None
    loss: Loss | None = None
    powers: Powers | None = None


def unassessed(size: int, state: State, reason: str) -> Assessment:
    """An assessment that says why nothing is judged."""
    return Assessment(states=np.full(size, CODE[state], dtype=np.int8), reasons={state: reason})
