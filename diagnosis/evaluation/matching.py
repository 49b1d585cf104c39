"""Match injected faults with reported ones, one to one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from diagnosis.results.document import IntervalRow
from replay.faults import FaultMode, Side
from replay.truth import TruthInterval

MIN_OVERLAP = 0.3
_GRADES = {"right": 3, "wrong_mode": 2, "wrong_side": 2, "wrong_part": 1}


def difference(truth: TruthInterval, row: IntervalRow) -> str:
    """How a reported fault differs from an injected one: ``right``, ``wrong_mode``, ``wrong_side`` or ``wrong_part``.

    ``sensor_or_actuator`` is right for an inefficient sensor or actuator, the one pair that cannot be told apart.
    """
    if row["component"] != truth.component:
        return "wrong_part"
    same_mode = row["mode"] == truth.mode
    if row["side"] == Side.SENSOR_OR_ACTUATOR:
        if same_mode:
            return "right" if truth.mode is FaultMode.INEFFICIENT else "wrong_side"
        return "wrong_mode"
    if row["side"] != truth.side:
        return "wrong_side"
    return "right" if same_mode else "wrong_mode"


def assign(overlap: NDArray[np.float64], differences: list[list[str]]) -> dict[int, int]:
    """Pair faults with reports: right ones first, then those of the same component, then any; most overlap in all.

    Parameters
    ----------
    overlap : NDArray[np.float64], shape (faults, reports)
        Intersection over union.
    differences : list[list[str]], faults × reports
        From `difference`.

    Returns
    -------
    dict[int, int]
        Report of each fault that has one with an overlap of at least `MIN_OVERLAP`.
    """
    grade = np.array([[_GRADES[d] for d in row] for row in differences], dtype=np.int64).reshape(overlap.shape)
    left = np.where(overlap >= MIN_OVERLAP, overlap, 0.0)
    out: dict[int, int] = {}
    for wanted in (3, 2, 1):
        gain = np.where(grade == wanted, left, 0.0)
        for i, j in zip(*linear_sum_assignment(gain, maximize=True), strict=True):
            if gain[i, j] > 0.0:
                out[int(i)] = int(j)
                left[i, :] = 0.0
                left[:, j] = 0.0
    return out
