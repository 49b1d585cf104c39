"""Probabilities of the fault rows from their prior and the log-evidence of one segment."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.results.fault_rows import ROWS, prior

Array = NDArray[np.float64]

_TEMPER = 0.25  # neighbouring samples are not independent: a share of the log-evidence counts


def row_probabilities(evidence: Array) -> Array:
    """Probability of each row by Bayes' rule with tempered evidence, shape (rows,).

    Parameters
    ----------
    evidence : Array, shape (rows,)
        Log-evidence of each row over the segment; see `diagnosis.estimation.filter_kernel.segment_evidence`.
    """
    log_prior = np.log(np.array([prior(code) for code in range(len(ROWS))]))
    tempered = log_prior + np.clip(_TEMPER * (evidence - evidence.max()), -700, 0)
    p = np.exp(tempered - tempered.max())
    return np.asarray(p / p.sum(), dtype=np.float64)
