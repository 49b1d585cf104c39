"""Figures of faults and reports, matched one to one."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from scipy.special import gammaincinv

from diagnosis.evaluation.confusion import mean, ratio
from diagnosis.evaluation.counts import FAULT_OUTCOMES, FaultOutcome, ReportOutcome
from diagnosis.evaluation.document import (
    EpsilonErrors,
    EventCounts,
    EventFigures,
    FalseAlarms,
    Precision,
    Recall,
    Spread,
)
from diagnosis.results.vocabulary import Severity
from replay.faults import TOTAL


def event_figures(faults: Sequence[FaultOutcome], judged: Sequence[ReportOutcome], healthy_s: float) -> EventFigures:
    """All figures of a set of faults and of the reports that belong to it.

    Parameters
    ----------
    faults : Sequence[FaultOutcome]
        Injected faults.
    judged : Sequence[ReportOutcome]
        Reported faults but the ignored ones.
    healthy_s : float
        Time in which every report would be a false alarm [s].
    """
    right = [f for f in faults if f.outcome == "right"]
    found = [f for f in faults if f.outcome in ("right", "wrong_mode", "wrong_side") and f.onset_seen]
    delay = spread((f.detection_delay_s for f in found), signed=True)
    return {
        "events": _events(faults, judged),
        "onset_error_s": spread(f.onset_error_s for f in right),
        "detection_delay_s": {**delay, "without": len(found) - delay["n"]},
        "end_error_s": spread(f.end_error_s for f in right),
        "epsilon": _epsilon(right),
        "false_alarms": _false_alarms(judged, healthy_s / 3600.0),
    }


def recall_of(faults: Sequence[FaultOutcome]) -> Recall:
    """Faults that count, those of them that are right, and their share."""
    counted = [f for f in faults if f.outcome in FAULT_OUTCOMES]
    right = sum(f.outcome == "right" for f in counted)
    return {"faults": len(counted), "right": right, "recall": ratio(right, len(counted))}


def precision_of(reports: Sequence[ReportOutcome]) -> Precision:
    """Reports, those of them that are right, and their share."""
    right = sum(r.outcome == "right" for r in reports)
    return {"reported": len(reports), "right": right, "precision": ratio(right, len(reports))}


def spread(errors: Iterable[float | None], *, signed: bool = False) -> Spread:
    """Median and 95 % quantile of the size of an error (of the value itself where `signed`), and its signed median."""
    known = np.array([e for e in errors if e is not None], dtype=np.float64)
    if not known.size:
        return {"n": 0, "median": None, "p95": None, "bias": None}
    size = known if signed else np.abs(known)
    return {
        "n": int(known.size),
        "median": float(np.median(size)),
        "p95": float(np.quantile(size, 0.95)),
        "bias": float(np.median(known)),
    }


def _events(faults: Sequence[FaultOutcome], judged: Sequence[ReportOutcome]) -> EventCounts:
    found = [f.outcome for f in faults]
    outcomes = {name: found.count(name) for name in FAULT_OUTCOMES}
    total, right = sum(outcomes.values()), outcomes["right"]
    detected = total - outcomes["missed"]
    precision, recall = precision_of(judged)["precision"], ratio(right, total)
    known = [x for x in (precision, recall) if x is not None]
    return {
        "faults": total,
        "reported": len(judged),
        "right": right,
        "wrong_mode": outcomes["wrong_mode"],
        "wrong_side": outcomes["wrong_side"],
        "wrong_part": outcomes["wrong_part"],
        "missed": outcomes["missed"],
        "surplus": sum(r.outcome == "surplus" for r in judged),
        "precision": precision,
        "recall": recall,
        "f1": None if not known else 0.0 if len(known) < 2 or not sum(known) else 2 * known[0] * known[1] / sum(known),
        "detected": detected,
        "isolation_rate": ratio(right + outcomes["wrong_mode"], detected),
        "identification_rate": ratio(right, detected),
        "wrong_wheel_rate": ratio(outcomes["wrong_part"], detected),
        "not_excited": found.count("not_excited"),
        "masked": found.count("masked"),
    }


def _epsilon(right: Sequence[FaultOutcome]) -> EpsilonErrors:
    """Mean absolute error of ε̂ over right faults, and over those whose ε is not fixed by the row."""
    known = [f for f in right if f.epsilon_error is not None]
    partial = [f.epsilon_error for f in known if f.mode not in TOTAL]
    return {
        "n": len(known),
        "without": len(right) - len(known),
        "mae": mean([f.epsilon_error for f in known]),
        "mae_partial": mean(partial),
        "n_partial": len(partial),
    }


def _false_alarms(judged: Sequence[ReportOutcome], hours: float) -> FalseAlarms:
    """Alarms per healthy hour with the upper 95 % bound of a Poisson count; those of severity info apart."""
    alarms = [r for r in judged if r.false_alarm]
    count = sum(r.severity != Severity.INFO for r in alarms)
    bound = float(gammaincinv(count + 1, 0.95))
    return {
        "count": count,
        "info": len(alarms) - count,
        "healthy_h": hours,
        "per_hour": ratio(count, hours),
        "per_hour_high": ratio(bound, hours),
    }
