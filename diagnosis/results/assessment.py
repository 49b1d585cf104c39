"""What an assessor hands on for one component and side: findings, states and evidence columns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import astuple, dataclass, field, replace
from enum import StrEnum
from math import isfinite
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.detectability import Powers
from diagnosis.results.loss import Loss
from diagnosis.results.result import Closeups, Epsilon, Hypothesis, Sat
from diagnosis.results.vocabulary import Tier
from replay.faults import TOTAL, FaultMode, Side, State

#: ε̂ of the smallest fault [1]; below it a varying saturation term is not told from it.
LEAST_SHARE = 0.1
_BOUND = 0.95  # of which the bounds of ε̂ speak
STATES: tuple[State, ...] = tuple(State)
CODE = {state: np.int8(i) for i, state in enumerate(STATES)}


@dataclass(frozen=True)
class Finding:
    """One fault of one component on samples [start, stop); see `FaultInterval` for the other fields.

    `epsilon` keeps within [0, 1] unless the fault lies outside the table; a size that is not finite is not known. `detected` is the sample at which a causal reading of the same evidence, without anything later, would have raised
    it; None where that is not known. `course` has the sentences on what comes after the onset, to follow those of `evidence`.
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
    course: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if self.epsilon is not None and self.mode is not FaultMode.OUTSIDE_TABLE:
            known = self.epsilon.high > 0.0  # a fault of the tables that takes nothing away has no such size
            object.__setattr__(self, "epsilon", self.epsilon.as_share() if known else None)
            self._bound_by_row()
        if self.sat is not None and self.mode.varying and (self.epsilon is None or self.epsilon.value < LEAST_SHARE):
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
            low = 1.0 if total >= _BOUND else LEAST_SHARE if healthy <= 1.0 - _BOUND else 0.0
            object.__setattr__(self, "epsilon", replace(self.epsilon, low=low))


class Lack(StrEnum):
    """What is missing, or wrong, where a part is not judged: it decides what somebody does to have it judged."""

    #: Nothing of an axle, or of one side of it, is in the log.
    SIGNALS = "signals"
    #: What the part is told is not in the log.
    COMMAND = "command"
    #: How the part answers its command did not show.
    ANSWER = "answer"
    #: A signal has a wrong unit or is a wrong channel.
    UNIT = "unit"
    #: The mission contradicts the unit of all valves' openings, or the machine file leaves it open.
    OPENING_UNIT = "opening_unit"
    #: The wheel seems to have no drive.
    DRIVE = "drive"
    #: Its command is known, and nothing that measures what it measures.
    SECOND = "second"
    #: A second measurement is off by itself.
    SECOND_OFF = "second_off"
    #: Neither is.
    BESIDE = "beside"
    #: What is read repeats what is asked for: nothing is measured.
    ECHO = "echo"


class Reason(NamedTuple):
    """Why a part is not judged, in words, and what is missing for it; None where it is nothing that one log has and another lacks."""

    text: str
    lack: Lack | None = None


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
    unexplained_size : str
        How far, against what, and when, to follow the part's name; empty where that is not known, or hardly anything.
    closeups : Closeups or None
        Every sample of `columns` around the findings, where they are envelopes.
    loss : Loss or None
        Loss of effectiveness over the mission, where a second measurement shows it.
    powers : Powers or None
        What the mission would have shown to this evidence; None: as to the checks of the all-clear.
    lacks : Mapping[State, Lack]
        What is missing where a reason is that something is.
    hidden : str
        What does not show although the part was judged, a sentence; empty where nothing is known to hide.
    """

    states: NDArray[np.int8]
    reasons: Mapping[State, str] = field(default_factory=dict)
    findings: tuple[Finding, ...] = ()
    columns: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    tier: Tier = Tier.NONE
    notes: tuple[str, ...] = ()
    unexplained_s: float = 0.0
    unexplained_size: str = ""
    closeups: Closeups | None = None
    loss: Loss | None = None
    powers: Powers | None = None
    lacks: Mapping[State, Lack] = field(default_factory=dict)
    hidden: str = ""

    def reasoned(self, state: State, reason: Reason) -> Assessment:
        """The same with another reason of a state."""
        lacks = {s: lack for s, lack in self.lacks.items() if s is not state}
        return replace(
            self,
            reasons={**self.reasons, state: reason.text},
            lacks=lacks if reason.lack is None else {**lacks, state: reason.lack},
        )


def unassessed(size: int, state: State, reason: str, lack: Lack | None = None) -> Assessment:
    """An assessment that says why nothing is judged, and what is missing for it."""
    states = np.full(size, CODE[state], dtype=np.int8)
    return Assessment(states=states).reasoned(state, Reason(reason, lack))
