"""A report and the truth of one group of components (wheels or steering) on the truth's clock."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.evaluation.excitation import Speeds
from diagnosis.evaluation.spans import Span, length, merged, within
from diagnosis.results.document import IntervalRow
from replay.truth import MissionTruth, TruthInterval, TruthSpan

Array = NDArray[np.float64]
States = Mapping[str, list[tuple[float, float, str]]]


@dataclass(frozen=True)
class Fault:
    """An injected fault on the sample grid [s]."""

    truth: TruthInterval
    start: float
    stop: float


class Compared:
    """Faults, reports and circumstances of one group, all times on the truth's clock [s].

    Parameters
    ----------
    intervals : Sequence[IntervalRow]
        Faults of the report.
    states : Mapping[str, States]
        Reported states by component and side; shifted already.
    truth : MissionTruth
        What was injected.
    window : Span
        Where report and truth overlap.
    shift : float
        What is added to the report's times.
    speeds : Speeds or None
        Commanded speeds on the report's clock.
    """

    def __init__(
        self,
        intervals: Sequence[IntervalRow],
        states: Mapping[str, States],
        truth: MissionTruth,
        window: Span,
        shift: float,
        speeds: Speeds | None,
    ) -> None:
        self.window, self.states, self.rate, self.shift, self.speeds = window, states, truth.rate_hz, shift, speeds
        driving: dict[str, list[Span]] = {}
        for s in truth.driving:
            driving.setdefault(s.component, []).append((s.start_s, s.stop_s))
        anything = [span for spans in driving.values() for span in spans]
        self.driving = {c: merged(driving.get(c, []) if c in truth.wheels else anything) for c in states}
        self.masked = self._by_component(truth.masked)
        self.slip = self._by_component(truth.slip)
        faults = [Fault(f, *self._clip(f.start_s, f.stop_s)) for f in truth.intervals if f.component in states]
        self.faults = [f for f in faults if f.stop > f.start]
        self.faulty = {c: merged((f.start, f.stop) for f in self.faults if f.truth.component == c) for c in states}
        mine = [(i, i["start_s"] + shift, i["stop_s"] + shift) for i in intervals if i["component"] in states]
        mine = [(i, a, b) for i, a, b in mine if b > window[0] and a < window[1]]
        self.rows = [i for i, _, _ in mine]
        self.start = np.array([a for _, a, _ in mine], dtype=np.float64)
        self.stop = np.array([b for _, _, b in mine], dtype=np.float64)

    def _by_component(self, spans: Sequence[TruthSpan]) -> dict[str, list[Span]]:
        return {c: merged(self._clip(s.start_s, s.stop_s) for s in spans if s.component == c) for c in self.states}

    def _clip(self, start: float, stop: float) -> Span:
        """First samples at or after the ends, within the window."""
        return max(self.sample(start), self.window[0]), min(self.sample(stop), self.window[1])

    def sample(self, t: float) -> float:
        """First sample at or after a time [s]."""
        return math.ceil(t * self.rate - 1e-6) / self.rate

    def first_sample(self, spans: Sequence[Span]) -> float | None:
        """First recorded sample within spans [s]."""
        return next((self.sample(a) for a, b in spans if self.sample(a) < b), None)

    def hidden(self, component: str, side: str) -> list[Span]:
        """Where the truth says that a side cannot be judged."""
        return self.masked[component] if side == "actuator" else []

    def excitation(self, component: str, start: float, stop: float) -> tuple[float | None, float]:
        """Mean commanded speed [m/s] and share of slip [1] over the driving time between two times."""
        driving = within(self.driving[component], start, stop)
        speed = None if self.speeds is None else self.speeds.mean(component, driving, self.shift)
        slips = sum(length(within(self.slip[component], a, b)) for a, b in driving)
        return speed, slips / length(driving) if driving else 0.0
