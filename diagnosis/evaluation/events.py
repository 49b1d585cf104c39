"""What became of each injected and each reported fault, matched one to one."""

from __future__ import annotations

import numpy as np

from diagnosis.evaluation.aligned import Compared, Fault
from diagnosis.evaluation.counts import FaultOutcome, ReportOutcome
from diagnosis.evaluation.matching import assign, difference
from diagnosis.evaluation.spans import covered, length, within, without
from diagnosis.results.size_rows import EpsilonRow
from replay.faults import TOTAL

_SEEN = 0.5  # of a report's time, that the truth says can be judged: what lies mostly behind a dead sensor is not held against it


def match_events(group: Compared) -> tuple[tuple[FaultOutcome, ...], tuple[ReportOutcome, ...]]:
    """Match the faults and reports of a group, and say what became of each."""
    overlap = np.zeros((len(group.faults), len(group.rows)))
    for i, f in enumerate(group.faults):
        hidden = group.hidden(f.truth.component, f.truth.side)
        # a clock that stands still while the side is masked
        a, b, start, stop = (t - covered(t, hidden) for t in (f.start, f.stop, group.start, group.stop))
        both = np.clip(np.minimum(b, stop) - np.maximum(a, start), 0.0, None)
        overlap[i] = both / np.maximum((b - a) + (stop - start) - both, 1e-12)
    match = assign(overlap, [[difference(f.truth, row) for row in group.rows] for f in group.faults])
    outcomes = ["surplus"] * len(group.rows)
    truths: dict[int, float] = {}
    faults = []
    for i, f in enumerate(group.faults):
        j = match.get(i)
        fault = _fault(group, f, j, 0.0 if j is None else float(overlap[i, j]))
        faults.append(fault)
        if j is not None:
            outcomes[j] = "ignored" if fault.outcome in ("not_excited", "masked") else fault.outcome
            truths[j] = f.truth.epsilon
    return tuple(faults), tuple(_report(group, j, outcome, truths.get(j)) for j, outcome in enumerate(outcomes))


def _fault(group: Compared, fault: Fault, j: int | None, overlap: float) -> FaultOutcome:
    truth, row = fault.truth, None if j is None else group.rows[j]
    driving = within(group.driving[truth.component], fault.start, fault.stop)
    hidden = group.hidden(truth.component, truth.side)
    first, first_seen = (group.first_sample(spans) for spans in (driving, without(driving, hidden)))
    outcome = "missed" if row is None else difference(truth, row)
    if first_seen is None:
        outcome = "not_excited" if first is None else "masked"
    onset_seen = first_seen is not None and first_seen == first
    onset = end = error = delay = None
    if row is not None and first_seen is not None and onset_seen and outcome != "wrong_part":
        raised = row.get("detected_s")
        delay = None if raised is None else float(raised) + group.shift - first_seen
    if row is not None and first_seen is not None and outcome == "right":
        onset = float(group.start[j]) - first_seen if onset_seen else None
        end = None if within(hidden, fault.stop - 1e-9, fault.stop) else float(group.stop[j]) - fault.stop
        estimate = row.get("epsilon")
        error = None if estimate is None else abs(estimate["value"] - truth.epsilon)
    speed, slip = group.excitation(truth.component, fault.start, fault.stop)
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
        detection_delay_s=delay,
        speed=speed,
        slip_share=slip,
        onset_seen=onset_seen,
    )


def _report(group: Compared, j: int, outcome: str, truth: float | None) -> ReportOutcome:
    row, start, stop = group.rows[j], float(group.start[j]), float(group.stop[j])
    component, side = str(row["component"]), str(row["side"])
    if outcome == "surplus" and length(without([(start, stop)], group.hidden(component, side))) < _SEEN * (
        stop - start
    ):
        outcome = "ignored"
    faulty = length(within(group.faulty[component], start, stop))
    estimate = row.get("epsilon")
    speed, slip = group.excitation(component, start, stop)
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
        tier=str(row.get("tier", "")),
        epsilon=None if estimate is None else float(estimate["value"]),
        speed=speed,
        slip_share=slip,
        bounds_hold=_bounds_hold(estimate, truth) if outcome == "right" and row["mode"] not in TOTAL else None,
    )


def _bounds_hold(estimate: EpsilonRow | None, truth: float | None) -> bool | None:
    """Whether bounds hold the truth; None where there are none."""
    if estimate is None or truth is None:
        return None
    return bool(estimate["low"] <= truth <= estimate["high"])
