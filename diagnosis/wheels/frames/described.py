"""A run of the Kalman models' path in figures: evidence of each group of models, length, and what else is known of it."""

from __future__ import annotations

from dataclasses import dataclass

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
    S_GAIN,
    S_NONE,
    S_STUCK,
)
from diagnosis.wheels.runs import Runs

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


def described(model: int, evidence: Array, context: RunContext) -> Array:
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


def run_context(
    runs: Runs,
    r: int,
    opening: Array,
    usual: float,
    others: Array,
    unseen: Array,
    doubtful: Array,
    misfit: float,
    dt: float,
) -> RunContext:
    """What is known of run r beside its evidence.

    Parameters
    ----------
    runs, r
        Runs of a wheel's path in blocks, and which.
    opening, others, unseen, doubtful : Array, shape (n,)
        Mean effective opening [fraction]; number of other wheels that are taken to be faulty; where the opening lies beyond
        what a healthy wheel was seen with; where a steering angle is in doubt.
    usual : float
        Usual size of the opening where the wheel drives [fraction].
    misfit : float
        As in `RunContext`.
    dt : float
        Block [s].
    """
    first, last = int(runs.start[r]), int(runs.stop[r])
    part = slice(first, max(last, first + 1))
    return RunContext(
        seconds=(last - first) * dt,
        misfit=misfit,
        others=float(others[part].mean()),
        unseen=float(unseen[part].mean()),
        doubtful=float(doubtful[part].mean()),
        changes=float(opening[part].std() / max(usual, 1e-6)),
        before=int(runs.model[r - 1]) if r > 0 else HEALTHY,
        after=int(runs.model[r + 1]) if r + 1 < runs.model.size else HEALTHY,
    )
