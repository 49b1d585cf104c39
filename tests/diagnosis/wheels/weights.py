"""Weights of a calibration that needs no training: the row with the most evidence holds."""

from __future__ import annotations

import numpy as np

from diagnosis.wheels.calibration import CLASSES, GROUPS, Calibration, RunContext, features
from diagnosis.wheels.models import HEALTHY, MODELS, ROW_OF_MODEL
from replay.faults import Side

CONTEXT = RunContext(3.0, 0.02, 0.0, 0.0, 0.0, 0.3, HEALTHY, HEALTHY)
STEEP = 2.0


def by_evidence(valves: float = 0.0) -> Calibration:
    """Weights by which a row's probability goes with (1 + what it lacks to the best)^−STEEP.

    Parameters
    ----------
    valves : float
        What speaks for rows of valves besides.
    """
    size = features(HEALTHY, np.zeros(MODELS), CONTEXT).size
    weights = np.zeros((len(CLASSES), size + 1))
    weights[0, len(GROUPS)] = -STEEP  # the best sound model, under any load
    for c, row in enumerate(CLASSES):
        if row is not None:
            weights[c, next(g for g, models in enumerate(GROUPS) if ROW_OF_MODEL[models[0]] == row)] = -STEEP
            weights[c, -1] = valves if row[0] is Side.ACTUATOR else 0.0
    return Calibration(np.zeros(size), np.ones(size), weights)
