"""Calibrated probabilities of a run's rows: a multinomial logistic model on the Kalman filters' evidence.

The filters' errors are no white noise, and how far their evidence can be trusted depends on how well the wheels' plants are
known and on what the other wheels do meanwhile. `tests/benchmarks/calibrate_wheels.py` fits the weights on simulated machines
of many structures; they are data beside this module. A run whose features lie far outside of those is not trusted.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import numpy as np
from numpy.typing import NDArray

from diagnosis.wheels.models import (
    A_BIAS,
    A_GAIN,
    A_NONE,
    A_STUCK,
    HEALTHY,
    NOISY_SENSOR,
    ODD,
    ROW_OF_MODEL,
    S_GAIN,
    S_NONE,
    S_STUCK,
    Row,
)

Array = NDArray[np.float64]

#: Models whose evidence a run is described by; noise of all strengths is one.
GROUPS: tuple[tuple[int, ...], ...] = (
    (HEALTHY,),
    (ODD,),
    (S_STUCK,),
    (S_NONE,),
    (S_GAIN,),
    NOISY_SENSOR,
    (A_GAIN,),
    (A_STUCK,),
    (A_NONE,),
    (A_BIAS,),
)
#: Rows that the model tells apart, a healthy wheel first.
CLASSES: tuple[Row | None, ...] = (None, *(row for g in GROUPS[2:] if (row := ROW_OF_MODEL[g[0]]) is not None))
_FAR = 6.0  # standard deviations of the training runs, beyond which a feature counts as this
_LEAST = 1e-4


@dataclass(frozen=True)
class RunContext:
    """What is known of a run beside its evidence.

    Attributes
    ----------
    seconds : float
        Its length [s].
    misfit : float
        What the wheels' plants leave of the speed in the windows that agree best [1].
    others : float
        Mean number of other wheels that are taken to be faulty meanwhile.
    unseen : float
        Share of the run in which the opening lies beyond what a healthy wheel was seen with.
    doubtful : float
        Share of the run in which a steering angle is in doubt.
    changes : float
        Spread of the valve's opening in the run, as a share of its usual size.
    before, after : int
        Models of the runs around it.
    """

    seconds: float
    misfit: float
    others: float
    unseen: float
    doubtful: float
    changes: float
    before: int
    after: int


def features(model: int, evidence: Array, context: RunContext) -> Array:
    """Features of a run, shape (p,): evidence of each group against the best, its context, and the path's model.

    Parameters
    ----------
    model : int
        Model of the path.
    evidence : Array, shape (models,)
        Log-likelihoods; −inf where a model is not considered.
    context : RunContext
        The rest.
    """
    best = float(np.max(evidence))
    behind = np.array([np.log1p(min(best - float(np.max(evidence[list(g)])), 1e5)) for g in GROUPS])
    sound = max(float(evidence[HEALTHY]), float(evidence[ODD]))
    ahead = np.log1p(max(best - sound, 0.0))
    rate = np.log1p(max(best - sound, 0.0) / max(context.seconds, 0.05))
    sides = [np.max(evidence[S_STUCK:A_GAIN]), np.max(evidence[A_GAIN:])]
    apart = float(np.clip(sides[0] - sides[1], -1e5, 1e5))
    between = np.sign(apart) * np.log1p(abs(apart))
    quality = np.log(max(context.misfit, 1e-3))
    path = np.array([float(model in g) for g in GROUPS[2:]])
    rest = np.array(
        [
            np.log(max(context.seconds, 0.02)),
            quality,
            context.others,
            context.unseen,
            context.doubtful,
            np.log1p(context.changes),
            float(S_STUCK <= context.before < A_GAIN),
            float(context.before >= A_GAIN),
            float(S_STUCK <= context.after < A_GAIN),
            float(context.after >= A_GAIN),
        ]
    )
    mixed = np.array([ahead * quality, rate * quality, ahead * context.others, between * context.others, ahead**2])
    return np.concatenate([behind, [ahead, rate, between], rest, path, mixed])


@dataclass(frozen=True)
class Calibration:
    """Weights of the logistic model.

    Attributes
    ----------
    centre, scale : Array, shape (p,)
        Of the features in training.
    weights : Array, shape (classes, p + 1)
        The last column is constant.
    """

    centre: Array
    scale: Array
    weights: Array

    def probabilities(self, x: Array, considered: NDArray[np.bool_]) -> Array:
        """Probability of every class, shape (classes,); 0 for those that are not considered."""
        z = np.clip((x - self.centre) / self.scale, -_FAR, _FAR)
        score = np.where(considered, self.weights @ np.r_[z, 1.0], -np.inf)
        p = np.exp(score - score.max())
        p = p / p.sum()
        p = np.where(considered, np.maximum(p, _LEAST), 0.0)
        return np.asarray(p / p.sum())


@cache
def calibration() -> Calibration:
    """The weights that are shipped."""
    text = files("diagnosis.wheels").joinpath("calibration.json").read_text(encoding="utf-8")
    data = json.loads(text)
    return Calibration(*(np.array(data[key], dtype=np.float64) for key in ("centre", "scale", "weights")))


def calibrated(model: int, evidence: Array, context: RunContext) -> dict[Row | None, float]:
    """Probability of every row of a run; None stands for a healthy wheel. Parameters as in `features`."""
    considered = np.array([row is None or bool(np.isfinite(_evidence(evidence, row))) for row in CLASSES])
    p = calibration().probabilities(features(model, evidence, context), considered)
    return {row: float(q) for row, q in zip(CLASSES, p, strict=True)}


def _evidence(evidence: Array, row: Row) -> float:
    """Best log-likelihood of a row's models."""
    return float(max(e for e, own in zip(evidence, ROW_OF_MODEL, strict=True) if own == row))
