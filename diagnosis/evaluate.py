"""Compare a report with the truth: states over driving time, faults one to one.

A fault is *right* where component, side and mode agree and the intervals overlap by at least `MIN_OVERLAP`
(intersection over union). A fault of ``sensor_or_actuator`` is right for an inefficient sensor and for an inefficient
actuator, the one pair that cannot be told apart. Time in which the truth says that an actuator was masked counts
nowhere. Left-over faults are matched with left-over reports of the same component, then of any other: those have the
wrong mode, side or part.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from diagnosis.scores import COLUMNS, ROWS, SIDES, Counts, FaultOutcome, ReportOutcome
from replay.errors import ConfigError, LogError
from replay.truth import MissionTruth, TruthInterval

Array = NDArray[np.float64]
Span = tuple[float, float]

MIN_OVERLAP = 0.3
_UNION = "sensor_or_actuator"
_INEFFICIENT = ROWS.index("inefficient")
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
        raise LogError(
            f"{name}: is no complete report ({error!r}); run `mfhca diagnose` on the log again"
        ) from error


def _evaluate(report: Mapping[str, Any], truth: MissionTruth, name: str) -> MissionScores:
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
        states: Mapping[str, Mapping[str, list[tuple[float, float, str]]]],
    ) -> None:
        self.window, self.states, self.rate = window, states, truth.rate_hz
        self.masked = {c: [(s.start_s, s.stop_s) for s in truth.masked if s.component == c] for c in states}
        driving: dict[str, list[Span]] = {}
        for s in truth.driving:
            driving.setdefault(s.component, []).append((s.start_s, s.stop_s))
        anything = _merged([span for spans in driving.values() for span in spans])
        self.driving = {c: _merged(driving.get(c, [])) if c in truth.wheels else anything for c in states}
        faults = [_Fault(f, *self._clip(f.start_s, f.stop_s)) for f in truth.intervals if f.component in states]
        self.faults = [f for f in faults if f.stop > f.start]
        rows = [i for i in intervals if i["component"] in states]
        self.rows = [r for r in rows if r["stop_s"] + shift > window[0] and r["start_s"] + shift < window[1]]
        self.start = np.array([r["start_s"] for r in self.rows], dtype=np.float64) + shift
        self.stop = np.array([r["stop_s"] for r in self.rows], dtype=np.float64) + shift

    def _clip(self, start: float, stop: float) -> Span:
        """First sample at or after each end, within the window."""
        first, last = (np.ceil(t * self.rate - 1e-6) / self.rate for t in (start, stop))
        return max(float(first), self.window[0]), min(float(last), self.window[1])

    def counts(self) -> Counts:
        seconds = {side: np.zeros((len(ROWS), len(COLUMNS))) for side in SIDES}
        healthy = []
        for component in self.states:
            for side, matrix in self._confusion(component).items():
                seconds[side] += matrix
            faulty = sum(b - a for a, b in self._faulty(component))
            healthy.append(self.window[1] - self.window[0] - faulty)
        faults, reports = self._events()
        return Counts(seconds, faults, reports, float(np.mean(healthy)))

    def _faulty(self, component: str) -> list[Span]:
        return _merged([(f.start, f.stop) for f in self.faults if f.truth.component == component])

    def _confusion(self, component: str) -> dict[str, Array]:
        """Driving time by true row and reported column, exact between all times at which anything changes."""
        true = {
            side: [(f.start, f.stop, f.truth.mode.value) for f in self.faults if _is(f.truth, component, side)]
            for side in SIDES
        }
        union = [
            (a, b, str(r["mode"]))
            for a, b, r in zip(self.start.tolist(), self.stop.tolist(), self.rows, strict=True)
            if r["component"] == component and r["side"] == _UNION
        ]
        masked, driving = self.masked[component], self.driving[component]
        every = [*union, *masked, *driving, self.window]
        for side in SIDES:
            every += [*true[side], *self.states[component][side]]
        cuts = np.unique(np.clip([t for span in every for t in span[:2]], *self.window))
        t, width = (cuts[1:] + cuts[:-1]) / 2, np.diff(cuts)
        drives = _codes(t, [(a, b, 1) for a, b in driving], 0) == 1
        hidden = _codes(t, [(a, b, 1) for a, b in _merged(masked)], 0) == 1
        row = {s: _codes(t, [(a, b, _index(m, ROWS, -1)) for a, b, m in true[s]], 0) for s in SIDES}
        either = _codes(t, [(a, b, _index(m, COLUMNS, _UNDECIDED)) for a, b, m in union], -1)
        out = {}
        for side, other in (SIDES, SIDES[::-1]):
            spans = [(a, b, _index(m, COLUMNS, _UNDECIDED)) for a, b, m in self.states[component][side]]
            column = _codes(t, spans, _UNDECIDED)
            column = np.where(either >= 0, _union_column(either, row[side], row[other]), column)
            keep = drives & (row[side] >= 0) & ~(hidden & (side == "actuator"))
            out[side] = np.zeros((len(ROWS), len(COLUMNS)))
            np.add.at(out[side], (row[side][keep], column[keep]), width[keep])
        return out

    def _unmasked(self, fault: _Fault, t: Array | float) -> Array:
        """Time [s] on a clock that stands still while the fault's side is masked."""
        spans = _merged(self.masked[fault.truth.component]) if fault.truth.side.value == "actuator" else []
        return np.asarray(t, dtype=np.float64) - _inside(t, spans)

    def _events(self) -> tuple[tuple[FaultOutcome, ...], tuple[ReportOutcome, ...]]:
        """Match faults and reports one to one, and say what became of each."""
        overlap = np.zeros((len(self.faults), len(self.rows)))
        grade = np.zeros(overlap.shape, dtype=np.int64)
        for i, fault in enumerate(self.faults):
            a, b, start, stop = (self._unmasked(fault, x) for x in (fault.start, fault.stop, self.start, self.stop))
            both = np.clip(np.minimum(b, stop) - np.maximum(a, start), 0.0, None)
            overlap[i] = both / np.maximum((b - a) + (stop - start) - both, 1e-12)
            grade[i] = [_grade(fault.truth, row) for row in self.rows]
        match = _assign(overlap, grade)
        faults = []
        report_outcomes = ["surplus"] * len(self.rows)
        for i, fault in enumerate(self.faults):
            j = match.get(i)
            outcome = self._fault_outcome(fault, j, 0.0 if j is None else float(overlap[i, j]))
            faults.append(outcome)
            if j is not None:
                ignored = outcome.outcome in ("not_excited", "masked")
                report_outcomes[j] = "ignored" if ignored else outcome.outcome
        reports = [self._report_outcome(j, outcome) for j, outcome in enumerate(report_outcomes)]
        return tuple(faults), tuple(reports)

    def _fault_outcome(self, fault: _Fault, j: int | None, overlap: float) -> FaultOutcome:
        truth = fault.truth
        driving = _within(self.driving[truth.component], fault.start, fault.stop)
        masked = _merged(self.masked[truth.component]) if truth.side.value == "actuator" else []
        seen = [piece for a, b in driving for piece in _without((a, b), masked)]
        first, first_seen = self._first_sample(driving), self._first_sample(seen)
        outcome = "missed"
        if first_seen is None:
            outcome = "not_excited" if first is None else "masked"
        elif j is not None:
            row = self.rows[j]
            right = (outcome := _difference(truth, row)) == "right"
        onset = end = error = None
        if j is not None and first_seen is not None and right:
            onset = float(self.start[j]) - first_seen if first_seen == first else None
            end = float(self.stop[j]) - fault.stop if not _hits(masked, fault.stop) else None
            estimate = (row.get("epsilon") or {}).get("value")
            error = None if estimate is None else abs(float(estimate) - truth.epsilon)
        return FaultOutcome(
            component=truth.component,
            side=truth.side.value,
            mode=truth.mode.value,
            start_s=fault.start,
            stop_s=fault.stop,
            epsilon=truth.epsilon,
            driving_share=sum(b - a for a, b in driving) / (fault.stop - fault.start),
            outcome=outcome,
            report="" if j is None else str(self.rows[j]["id"]),
            overlap=overlap,
            onset_error_s=onset,
            end_error_s=end,
            epsilon_error=error,
        )

    def _first_sample(self, spans: Sequence[Span]) -> float | None:
        """First recorded sample within spans [s]."""
        for a, b in spans:
            sample = float(np.ceil(a * self.rate - 1e-6) / self.rate)
            if sample < b:
                return sample
        return None

    def _report_outcome(self, j: int, outcome: str) -> ReportOutcome:
        row, start, stop = self.rows[j], float(self.start[j]), float(self.stop[j])
        component = str(row["component"])
        if outcome == "surplus" and row["side"] == "actuator":
            hidden = sum(b - a for a, b in _within(_merged(self.masked[component]), start, stop))
            outcome = "ignored" if hidden >= stop - start - 1e-9 else outcome
        faulty = sum(b - a for a, b in _within(self._faulty(component), start, stop))
        return ReportOutcome(
            id=str(row["id"]),
            component=component,
            side=str(row["side"]),
            mode=str(row["mode"]),
            severity=str(row["severity"]),
            start_s=start,
            stop_s=stop,
            probability=float(row["probability"]),
            outcome=outcome,
            false_alarm=outcome not in ("right", "ignored") and faulty < 0.5 * (stop - start),
        )
