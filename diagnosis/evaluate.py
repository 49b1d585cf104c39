"""Compare a report with the truth: states over driving time, faults one to one.

A fault is right where component, side and mode agree and the intervals overlap enough (`diagnosis.matching`). Left-over
faults are matched with left-over reports of the same component, then of any other: those have the wrong mode, side or
part. Time in which the truth says that an actuator was masked counts nowhere.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from diagnosis.matching import UNION, assign, difference
from diagnosis.outcomes import COLUMNS, ROWS, SIDES, Counts, FaultOutcome, ReportOutcome
from diagnosis.spans import Span, codes_at, covered, length, merged, within, without
from replay.errors import ConfigError, LogError
from replay.truth import MissionTruth, TruthInterval

Array = NDArray[np.float64]
Codes = NDArray[np.int64]
States = Mapping[str, list[tuple[float, float, str]]]

_HEALTHY, _INEFFICIENT = ROWS.index("healthy"), ROWS.index("inefficient")
_UNDECIDED = COLUMNS.index("undecided")


@dataclass(frozen=True)
class MissionScores:
    """Counts of one mission.

    Attributes
    ----------
    groups : Mapping[str, Counts]
        ``wheel`` and ``steer``, each where the result holds such components.
    left_out : tuple[str, ...]
        Components with injected faults that the result does not hold.
    """

    groups: Mapping[str, Counts]
    left_out: tuple[str, ...]


@dataclass(frozen=True)
class _Fault:
    """An injected fault on the sample grid."""

    truth: TruthInterval
    start: float
    stop: float


def evaluate_report(report: Mapping[str, Any], truth: MissionTruth, name: str = "report.json") -> MissionScores:
    """Count what a report got right and wrong.

    Parameters
    ----------
    report : Mapping[str, Any]
        Contents of a ``report.json``.
    truth : MissionTruth
        What was injected.
    name : str
        The report's name, for messages.

    Raises
    ------
    ConfigError
        Where the truth is that of another mission or machine.
    LogError
        Where the report lacks parts.
    """
    try:
        return _evaluate(report, truth, name)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise LogError(f"{name}: is no complete report ({error!r}); run `mfhca diagnose` on the log again") from error


def _evaluate(report: Mapping[str, Any], truth: MissionTruth, name: str) -> MissionScores:
    if not truth.rate_hz > 0:
        raise ConfigError(f"the truth file's rate_hz is {truth.rate_hz:g}; expected the recorded rate, above 0 Hz")
    shift = (int(report["log"]["start_ns"]) - truth.start_ns) * 1e-9
    window = (max(0.0, shift), min(truth.duration_s, shift + float(report["log"]["duration_s"])))
    if window[1] <= window[0]:
        raise ConfigError(
            f"{name}: begins {shift:.1f} s after the truth file's mission, which lasts {truth.duration_s:.1f} s, so they "
            "do not overlap; give the truth file of this log with --truth"
        )
    states: dict[str, dict[str, list[tuple[float, float, str]]]] = {}
    for row in report["states"]:
        spans = states.setdefault(row["component"], {side: [] for side in SIDES})
        spans[row["side"]].append((row["start_s"] + shift, row["stop_s"] + shift, row["state"]))
    if not set(states) & set(truth.wheels):
        raise ConfigError(
            f"{name}: its components are {', '.join(states) or 'none'}, the truth file's wheels {', '.join(truth.wheels)}; "
            "give the truth file of this log with --truth"
        )
    groups: dict[str, Counts] = {}
    for group in ("wheel", "steer"):
        parts = [c for c in states if (c in truth.wheels) == (group == "wheel")]
        if parts:
            part_states = {c: states[c] for c in parts}
            groups[group] = _Group(report["intervals"], shift, window, truth, part_states).counts()
    left_out = tuple(dict.fromkeys(f.component for f in truth.intervals if f.component not in states))
    return MissionScores(groups, left_out)


class _Group:
    """Wheels or steering axles of one mission, all times on the truth's clock [s]."""

    def __init__(
        self,
        intervals: Sequence[Mapping[str, Any]],
        shift: float,
        window: Span,
        truth: MissionTruth,
        states: Mapping[str, States],
    ) -> None:
        self.window, self.states, self.rate = window, states, truth.rate_hz
        driving: dict[str, list[Span]] = {}
        for s in truth.driving:
            driving.setdefault(s.component, []).append((s.start_s, s.stop_s))
        anything = [span for spans in driving.values() for span in spans]
        self.driving = {c: merged(driving.get(c, []) if c in truth.wheels else anything) for c in states}
        self.masked = {
            c: merged(self._clip(s.start_s, s.stop_s) for s in truth.masked if s.component == c) for c in states
        }
        faults = [_Fault(f, *self._clip(f.start_s, f.stop_s)) for f in truth.intervals if f.component in states]
        self.faults = [f for f in faults if f.stop > f.start]
        self.faulty = {c: merged((f.start, f.stop) for f in self.faults if f.truth.component == c) for c in states}
        mine = [(i, i["start_s"] + shift, i["stop_s"] + shift) for i in intervals if i["component"] in states]
        mine = [(i, a, b) for i, a, b in mine if b > window[0] and a < window[1]]
        self.rows = [i for i, _, _ in mine]
        self.start = np.array([a for _, a, _ in mine], dtype=np.float64)
        self.stop = np.array([b for _, _, b in mine], dtype=np.float64)

    def _clip(self, start: float, stop: float) -> Span:
        """First samples at or after the ends, within the window."""
        return max(self._sample(start), self.window[0]), min(self._sample(stop), self.window[1])

    def _sample(self, t: float) -> float:
        return math.ceil(t * self.rate - 1e-6) / self.rate

    def _hidden(self, component: str, side: str) -> list[Span]:
        """Where the truth says that a side cannot be judged."""
        return self.masked[component] if side == "actuator" else []

    def counts(self) -> Counts:
        """Count everything."""
        each = [self._confusion(component) for component in self.states]
        healthy = [self.window[1] - self.window[0] - length(self.faulty[c]) for c in self.states]
        faults, reports = self._events()
        seconds = {side: np.sum([confusion[side] for confusion in each], axis=0) for side in SIDES}
        return Counts(seconds, faults, reports, float(np.mean(healthy)))

    def _confusion(self, component: str) -> dict[str, Array]:
        """Driving time by true row and reported column, exact between the times at which anything changes."""
        driving = self.driving[component]
        mine = [f for f in self.faults if f.truth.component == component]
        true = {
            s: [(f.start, f.stop, _index(f.truth.mode, ROWS, -1)) for f in mine if f.truth.side == s] for s in SIDES
        }
        told = {s: [(a, b, _index(m, COLUMNS, _UNDECIDED)) for a, b, m in self.states[component][s]] for s in SIDES}
        either = [
            (float(a), float(b), _index(r["mode"], COLUMNS, _UNDECIDED))
            for a, b, r in zip(self.start, self.stop, self.rows, strict=True)
            if r["component"] == component and r["side"] == UNION
        ]
        coded = [*either, *(span for s in SIDES for span in (*true[s], *told[s]))]
        spans = [*driving, *self.masked[component], *((a, b) for a, b, _ in coded), self.window]
        cuts = np.unique(np.clip(np.array(spans).ravel(), *self.window))
        t, width = (cuts[1:] + cuts[:-1]) / 2, np.diff(cuts)
        row = {s: codes_at(t, true[s], _HEALTHY) for s in SIDES}
        claim = codes_at(t, either, -1)
        drives = covered(cuts[1:], driving) > covered(cuts[:-1], driving)
        out = {}
        for side, other in (SIDES, SIDES[::-1]):
            column = np.where(
                claim < 0, codes_at(t, told[side], _UNDECIDED), _union_column(claim, row[side], row[other])
            )
            hidden = self._hidden(component, side)
            keep = drives & (row[side] >= 0) & (covered(cuts[1:], hidden) == covered(cuts[:-1], hidden))
            out[side] = np.zeros((len(ROWS), len(COLUMNS)))
            np.add.at(out[side], (row[side][keep], column[keep]), width[keep])
        return out

    def _events(self) -> tuple[tuple[FaultOutcome, ...], tuple[ReportOutcome, ...]]:
        """Match faults and reports one to one, and say what became of each."""
        overlap = np.zeros((len(self.faults), len(self.rows)))
        for i, f in enumerate(self.faults):
            hidden = self._hidden(f.truth.component, f.truth.side)
            # a clock that stands still while the side is masked
            a, b, start, stop = (t - covered(t, hidden) for t in (f.start, f.stop, self.start, self.stop))
            both = np.clip(np.minimum(b, stop) - np.maximum(a, start), 0.0, None)
            overlap[i] = both / np.maximum((b - a) + (stop - start) - both, 1e-12)
        match = assign(overlap, [[difference(f.truth, row) for row in self.rows] for f in self.faults])
        outcomes = ["surplus"] * len(self.rows)
        faults = []
        for i, f in enumerate(self.faults):
            j = match.get(i)
            fault = self._fault(f, j, 0.0 if j is None else float(overlap[i, j]))
            faults.append(fault)
            if j is not None:
                outcomes[j] = "ignored" if fault.outcome in ("not_excited", "masked") else fault.outcome
        return tuple(faults), tuple(self._report(j, outcome) for j, outcome in enumerate(outcomes))

    def _fault(self, fault: _Fault, j: int | None, overlap: float) -> FaultOutcome:
        truth, row = fault.truth, None if j is None else self.rows[j]
        driving = within(self.driving[truth.component], fault.start, fault.stop)
        hidden = self._hidden(truth.component, truth.side)
        first, first_seen = (self._first_sample(spans) for spans in (driving, without(driving, hidden)))
        outcome = "missed" if row is None else difference(truth, row)
        if first_seen is None:
            outcome = "not_excited" if first is None else "masked"
        onset = end = error = None
        if row is not None and first_seen is not None and outcome == "right":
            onset = float(self.start[j]) - first_seen if first_seen == first else None
            end = None if within(hidden, fault.stop - 1e-9, fault.stop) else float(self.stop[j]) - fault.stop
            estimate = (row.get("epsilon") or {}).get("value")
            error = None if estimate is None else abs(float(estimate) - truth.epsilon)
        return FaultOutcome(
            component=truth.component,
            side=truth.side.value,
            mode=truth.mode.value,
            start_s=fault.start,
            stop_s=fault.stop,
            epsilon=truth.epsilon,
            driving_share=length(driving) / (fault.stop - fault.start),
            outcome=outcome,
            report="" if row is None else str(row["id"]),
            overlap=overlap,
            onset_error_s=onset,
            end_error_s=end,
            epsilon_error=error,
        )

    def _first_sample(self, spans: Sequence[Span]) -> float | None:
        """First recorded sample within spans [s]."""
        return next((self._sample(a) for a, b in spans if self._sample(a) < b), None)

    def _report(self, j: int, outcome: str) -> ReportOutcome:
        row, start, stop = self.rows[j], float(self.start[j]), float(self.stop[j])
        component, side = str(row["component"]), str(row["side"])
        if outcome == "surplus" and not without([(start, stop)], self._hidden(component, side)):
            outcome = "ignored"
        faulty = length(within(self.faulty[component], start, stop))
        return ReportOutcome(
            id=str(row["id"]),
            component=component,
            side=side,
            mode=str(row["mode"]),
            severity=str(row["severity"]),
            start_s=start,
            stop_s=stop,
            probability=float(row["probability"]),
            outcome=outcome,
            false_alarm=outcome not in ("right", "ignored") and faulty < 0.5 * (stop - start),
        )


def _index(name: str, names: Sequence[str], default: int) -> int:
    return names.index(name) if name in names else default


def _union_column(claim: Codes, mine: Codes, other: Codes) -> Codes:
    """Column of one side where a fault of either side was reported.

    Where one side is inefficient as claimed, the claim stands for that side and says nothing bad of a healthy other.
    Where both sides are healthy it is wrong on both. Any other truth leaves the side undecided: the claim names none.
    """
    fulfilled = (claim == _INEFFICIENT) & ((mine == _INEFFICIENT) | (other == _INEFFICIENT))
    false = (mine == _HEALTHY) & (other == _HEALTHY)
    stands = np.where((mine == _INEFFICIENT) | (mine == _HEALTHY), mine, _UNDECIDED)
    return np.where(fulfilled, stands, np.where(false, claim, _UNDECIDED))
