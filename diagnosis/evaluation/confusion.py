"""Figures of one side's time by true row and reported state."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.evaluation.counts import COLUMNS, TRUE_STATES
from diagnosis.evaluation.document import DamadicsRates, RowFigures, SideFigures

Array = NDArray[np.float64]


def ratio(a: float, b: float) -> float | None:
    """a/b, None where there is nothing to divide by. In the unit of a per b."""
    return float(a) / float(b) if b > 0 else None


def mean(values: Sequence[float | None]) -> float | None:
    """Mean of the known values; None where there is none. In the unit of the values."""
    known = [v for v in values if v is not None]
    return float(np.mean(known)) if known else None


def confusion_figures(seconds: Array) -> SideFigures:
    """Figures of one side; means run over the rows that occur in the truth.

    Parameters
    ----------
    seconds : Array, shape (5, 7)
        Driving time by true row and reported column [s].

    Returns
    -------
    SideFigures
        ``macro_f1`` and ``balanced_accuracy`` with undecided time counted as wrong, ``balanced_accuracy_decided``
        over decided time alone, ``decided_share`` and ``undecided_share`` [1], ``driving_s``, figures per row, and
        the confusion itself.
    """
    true = seconds.sum(axis=1)
    decided = seconds[:, :-1].sum(axis=1)
    hit = np.diag(seconds)
    named = seconds[:, : len(TRUE_STATES)].sum(axis=0)
    rows: dict[str, RowFigures] = {}
    for i, row in enumerate(TRUE_STATES):
        occurs = true[i] > 0
        rows[row] = {
            "seconds": float(true[i]),
            "recall": ratio(hit[i], true[i]),
            "recall_decided": ratio(hit[i], decided[i]) if occurs else None,
            "precision": ratio(hit[i], named[i]),
            "f1": ratio(2 * hit[i], true[i] + named[i]) if occurs else None,
        }
    return {
        "driving_s": float(true.sum()),
        "macro_f1": mean([r["f1"] for r in rows.values()]),
        "balanced_accuracy": mean([r["recall"] for r in rows.values()]),
        "balanced_accuracy_decided": mean([r["recall_decided"] for r in rows.values()]),
        "decided_share": ratio(decided.sum(), true.sum()),
        "undecided_share": ratio((true - decided).sum(), true.sum()),
        "damadics": damadics_rates(seconds),
        "rows": rows,
        "true": list(TRUE_STATES),
        "reported": list(COLUMNS),
        "seconds": seconds.tolist(),
    }


def damadics_rates(seconds: Array) -> DamadicsRates:
    """Time-based indices of the DAMADICS actuator benchmark (Bartyś, Patton, Syfert, de las Heras, Quevedo 2006).

    A side's detection decision is high where it is reported in any fault row, its isolation decision of a row where
    it is reported in that row; undecided time is low. There, a fault starts at t_from and a scenario is judged from
    t_on to its end; here the fault-free and the faulty driving time of all scenarios are added up.

    Parameters
    ----------
    seconds : Array, shape (5, 7)
        Driving time by true row and reported column [s].

    Returns
    -------
    DamadicsRates
        ``r_fd``, false detection rate: Σ time with a high detection decision without a fault / fault-free time.
        ``r_td``, true detection rate: Σ time with a high detection decision during a fault / faulty time.
        ``r_fi``, false isolation rate: Σ time during a fault with the decision of another row / faulty time.
        ``r_ti``, true isolation rate: Σ time during a fault with the decision of its row / faulty time.
        The detection time t_dt, from t_from to the rise of the detection decision, is the detection delay of
        `diagnosis.evaluation.event_scores`, counted from the first excited sample. The isolation time t_it would need causal
        decisions per row, which a report does not hold.
    """
    faulty, healthy = seconds[1:].sum(), seconds[0].sum()
    high = seconds[:, 1:-1].sum(axis=1)
    isolated = np.diag(seconds)[1:].sum()
    return {
        "r_fd": ratio(high[0], healthy),
        "r_td": ratio(high[1:].sum(), faulty),
        "r_fi": ratio(high[1:].sum() - isolated, faulty),
        "r_ti": ratio(isolated, faulty),
    }
