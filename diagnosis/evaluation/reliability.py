"""How well the stated probabilities hold: bins against the share that was right, Brier score, calibration error."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from diagnosis.evaluation.counts import REPORT_OUTCOMES, ReportOutcome
from diagnosis.evaluation.document import ProbabilityBin, Reliability, ReliabilityFigures

BINS = 10


def probability_bins(reports: Sequence[ReportOutcome]) -> list[ProbabilityBin]:
    """Stated probability against the share that was right, in `BINS` equal bins; None in empty ones."""
    place = [min(int(r.probability * BINS), BINS - 1) for r in reports]
    out: list[ProbabilityBin] = []
    for k in range(BINS):
        mine = [r for r, b in zip(reports, place, strict=True) if b == k]
        out.append(
            {
                "low": k / BINS,
                "high": (k + 1) / BINS,
                "reported": len(mine),
                "probability": float(np.mean([r.probability for r in mine])) if mine else None,
                "right": float(np.mean([r.outcome == "right" for r in mine])) if mine else None,
            }
        )
    return out


def reliability(reports: Sequence[ReportOutcome]) -> list[Reliability]:
    """Reliability of the probability of side and mode, over all judged reports and per tier and side.

    Parameters
    ----------
    reports : Sequence[ReportOutcome]
        Reported faults; ignored ones count nothing.

    Returns
    -------
    list[Reliability]
        ``tier`` and ``side`` (``all`` first), ``reported``, ``right``, ``brier`` = mean (p − right)² (Brier 1950),
        ``ece`` = Σ n_k/n·|mean p_k − share right_k| over the bins (expected calibration error), ``bounds`` and
        ``bounds_hold``: reports with 95 % bounds of ε, and the share of them that hold the truth, and ``bins``.
    """
    judged = [r for r in reports if r.outcome in REPORT_OUTCOMES]
    keys = sorted({(r.tier, r.side) for r in judged})
    groups = [("all", "all", judged)]
    groups += [(tier, side, [r for r in judged if (r.tier, r.side) == (tier, side)]) for tier, side in keys]
    return [{"tier": tier or "unknown", "side": side, **_figures(mine)} for tier, side, mine in groups]


def _figures(reports: Sequence[ReportOutcome]) -> ReliabilityFigures:
    stated = np.array([r.probability for r in reports])
    right = np.array([r.outcome == "right" for r in reports], dtype=np.float64)
    bins = probability_bins(reports)
    hold = [r.bounds_hold for r in reports if r.bounds_hold is not None]
    gaps = [
        b["reported"] * abs(b["probability"] - b["right"])
        for b in bins
        if b["probability"] is not None and b["right"] is not None
    ]
    return {
        "reported": len(reports),
        "right": int(right.sum()),
        "brier": float(np.mean((stated - right) ** 2)) if reports else None,
        "ece": sum(gaps) / len(reports) if reports else None,
        "bounds": len(hold),
        "bounds_hold": float(np.mean(hold)) if hold else None,
        "bins": bins,
    }
