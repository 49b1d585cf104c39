"""The figures of an evaluation, from its counts."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaincinv

from diagnosis.outcomes import (
    COLUMNS,
    FAULT_OUTCOMES,
    REPORT_OUTCOMES,
    ROWS,
    SIDES,
    Counts,
    FaultOutcome,
    ReportOutcome,
)
from diagnosis.result import SEVERITIES

Array = NDArray[np.float64]

_EPSILON_BANDS = ((0.0, 0.2), (0.2, 0.4), (0.4, 0.7), (0.7, 1.0))
_EXCITATION_BANDS = ((0.0, 0.5), (0.5, 0.9), (0.9, 1.0))
_BINS = 10


def figures(counts: Counts) -> dict[str, Any]:
    """All figures as JSON values; None where there is nothing to divide by.

    Parameters
    ----------
    counts : Counts
        Of one mission or of many.
    """
    right = [f for f in counts.faults if f.outcome == "right"]
    judged = [r for r in counts.reports if r.outcome in REPORT_OUTCOMES]
    return {
        "sides": {side: confusion_figures(counts.seconds[side]) for side in SIDES},
        "events": _events(counts.faults, judged),
        "onset_error_s": _spread(f.onset_error_s for f in right),
        "end_error_s": _spread(f.end_error_s for f in right),
        "epsilon": _epsilon(right),
        "modes": _modes(counts.faults),
        "by_epsilon": _bands(counts.faults, lambda f: f.epsilon, _EPSILON_BANDS),
        "by_excitation": _bands(counts.faults, lambda f: f.driving_share, _EXCITATION_BANDS),
        "by_severity": [
            {"severity": s, **_precision([r for r in judged if r.severity == s])} for s in reversed(SEVERITIES)
        ],
        "false_alarms": _false_alarms(judged, counts.healthy_s / 3600.0),
        "calibration": _calibration(judged),
    }


def _ratio(a: float, b: float) -> float | None:
    return float(a) / float(b) if b > 0 else None


def _mean(values: Sequence[float | None]) -> float | None:
    known = [v for v in values if v is not None]
    return float(np.mean(known)) if known else None


def confusion_figures(seconds: Array) -> dict[str, Any]:
    """Figures of one side; means run over the rows that occur in the truth.

    Parameters
    ----------
    seconds : Array, shape (5, 7)
        Driving time by true row and reported column [s].

    Returns
    -------
    dict[str, Any]
        ``macro_f1`` and ``balanced_accuracy`` with undecided time counted as wrong, ``balanced_accuracy_decided``
        over decided time alone, ``decided_share`` [1], ``driving_s``, figures per row, and the confusion itself.
    """
    true = seconds.sum(axis=1)
    decided = seconds[:, :-1].sum(axis=1)
    hit = np.diag(seconds)
    named = seconds[:, : len(ROWS)].sum(axis=0)
    rows: dict[str, dict[str, float | None]] = {}
    for i, row in enumerate(ROWS):
        occurs = true[i] > 0
        rows[row] = {
            "seconds": float(true[i]),
            "recall": _ratio(hit[i], true[i]),
            "recall_decided": _ratio(hit[i], decided[i]) if occurs else None,
            "precision": _ratio(hit[i], named[i]),
            "f1": _ratio(2 * hit[i], true[i] + named[i]) if occurs else None,
        }
    return {
        "driving_s": float(true.sum()),
        "macro_f1": _mean([r["f1"] for r in rows.values()]),
        "balanced_accuracy": _mean([r["recall"] for r in rows.values()]),
        "balanced_accuracy_decided": _mean([r["recall_decided"] for r in rows.values()]),
        "decided_share": _ratio(decided.sum(), true.sum()),
        "rows": rows,
        "true": list(ROWS),
        "reported": list(COLUMNS),
        "seconds": seconds.tolist(),
    }


def _count(items: Iterable[FaultOutcome | ReportOutcome], names: Sequence[str]) -> dict[str, int]:
    found = [i.outcome for i in items]
    return {name: found.count(name) for name in names}


def _precision(reports: Sequence[ReportOutcome]) -> dict[str, Any]:
    right = sum(r.outcome == "right" for r in reports)
    return {"reported": len(reports), "right": right, "precision": _ratio(right, len(reports))}


def _recall(faults: Sequence[FaultOutcome]) -> dict[str, Any]:
    counted = [f for f in faults if f.outcome in FAULT_OUTCOMES]
    right = sum(f.outcome == "right" for f in counted)
    return {"faults": len(counted), "right": right, "recall": _ratio(right, len(counted))}


def _events(faults: Sequence[FaultOutcome], judged: Sequence[ReportOutcome]) -> dict[str, Any]:
    """One-to-one events; isolation and wrong-wheel rate refer to the faults that something was reported for."""
    outcomes = _count(faults, FAULT_OUTCOMES)
    total, right = sum(outcomes.values()), outcomes["right"]
    detected = total - outcomes["missed"]
    return {
        "faults": total,
        "reported": len(judged),
        **outcomes,
        "surplus": sum(r.outcome == "surplus" for r in judged),
        "precision": _ratio(right, len(judged)),
        "recall": _ratio(right, total),
        "f1": _ratio(2 * right, total + len(judged)),
        "isolation_rate": _ratio(right, detected),
        "wrong_wheel_rate": _ratio(outcomes["wrong_part"], detected),
        "not_excited": sum(f.outcome == "not_excited" for f in faults),
        "masked": sum(f.outcome == "masked" for f in faults),
    }


def _spread(errors: Iterable[float | None]) -> dict[str, Any]:
    """Median and 95 % quantile of the absolute error, and the median with its sign."""
    known = np.array([e for e in errors if e is not None], dtype=np.float64)
    if not known.size:
        return {"n": 0, "median": None, "p95": None, "bias": None}
    size = np.abs(known)
    return {
        "n": int(known.size),
        "median": float(np.median(size)),
        "p95": float(np.quantile(size, 0.95)),
        "bias": float(np.median(known)),
    }


def _epsilon(right: Sequence[FaultOutcome]) -> dict[str, Any]:
    """Mean absolute error of ε̂ over right faults, and over those whose ε is not fixed by the row."""
    known = [f for f in right if f.epsilon_error is not None]
    partial = [f.epsilon_error for f in known if f.mode in ("inefficient", "noisy")]
    return {
        "n": len(known),
        "without": len(right) - len(known),
        "mae": _mean([f.epsilon_error for f in known]),
        "mae_partial": _mean(partial),
        "n_partial": len(partial),
    }


def _modes(faults: Sequence[FaultOutcome]) -> list[dict[str, Any]]:
    out = []
    for side in SIDES:
        for mode in sorted({f.mode for f in faults if f.side == side}, key=COLUMNS.index):
            mine = [f for f in faults if (f.side, f.mode) == (side, mode)]
            right = [f for f in mine if f.outcome == "right"]
            out.append(
                {
                    "side": side,
                    "mode": mode,
                    **_recall(mine),
                    "epsilon_mae": _mean([f.epsilon_error for f in right]),
                    "onset_error_s": _spread(f.onset_error_s for f in right),
                }
            )
    return out


def _bands(
    faults: Sequence[FaultOutcome], value: Callable[[FaultOutcome], float], bands: Sequence[tuple[float, float]]
) -> list[dict[str, Any]]:
    """Recall per band; the last band holds its upper end."""
    return [
        {
            "low": low,
            "high": high,
            **_recall([f for f in faults if low <= value(f) < high or (high == bands[-1][1] and value(f) >= high)]),
        }
        for low, high in bands
    ]


def _false_alarms(judged: Sequence[ReportOutcome], hours: float) -> dict[str, Any]:
    """Alarms per healthy hour with the upper 95 % bound of a Poisson count; those of severity info apart."""
    alarms = [r for r in judged if r.false_alarm]
    count = sum(r.severity != "info" for r in alarms)
    bound = float(gammaincinv(count + 1, 0.95))
    return {
        "count": count,
        "info": len(alarms) - count,
        "healthy_h": hours,
        "per_hour": _ratio(count, hours),
        "per_hour_high": _ratio(bound, hours),
    }


def _calibration(judged: Sequence[ReportOutcome]) -> list[dict[str, Any]]:
    """Stated probability against the share that was right."""
    place = [min(int(r.probability * _BINS), _BINS - 1) for r in judged]
    out = []
    for k in range(_BINS):
        mine = [r for r, b in zip(judged, place, strict=True) if b == k]
        stated = _mean([r.probability for r in mine])
        right = _precision(mine)
        out.append(
            {
                "low": k / _BINS,
                "high": (k + 1) / _BINS,
                "reported": len(mine),
                "probability": stated,
                "right": right["precision"],
            }
        )
    return out
