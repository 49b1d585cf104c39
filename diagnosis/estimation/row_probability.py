"""Probabilities of the fault rows from their prior and the log-evidence of one segment."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.fault_rows import ROWS, prior
from replay.faults import Side

Array = NDArray[np.float64]

_TEMPER = 0.25  # neighbouring samples are not independent: a share of the log-evidence counts


def row_probabilities(evidence: Array, side: Side = Side.SENSOR) -> Array:
    """Probability of each row by Bayes' rule with tempered evidence, shape (rows,).

    Parameters
    ----------
    evidence : Array, shape (rows,)
        Log-evidence of each row over the segment; see `diagnosis.estimation.filter_kernel.segment_evidence`.
    side : Side
        Whose table; a row that it lacks, or that has no evidence (−∞), has probability 0.
    """
    priors = np.array([prior(code, side) for code in range(len(ROWS))])
    log_prior = np.log(priors, out=np.full(priors.size, -np.inf), where=(priors > 0) & (evidence > -np.inf))
    tempered = log_prior + np.clip(_TEMPER * (evidence - evidence.max()), -700, 0)
    p = np.exp(tempered - tempered.max())
    return np.asarray(p / p.sum(), dtype=np.float64)
