"""What the Kalman models make of every wheel: the most probable path, its runs, and all models' evidence over them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.wheels.blocks import WheelBlocks
from diagnosis.wheels.filter import JointPass, forward, most_probable
from diagnosis.wheels.frames.described import described, run_context
from diagnosis.wheels.frames.features import Followed
from diagnosis.wheels.inputs import WheelsData
from diagnosis.wheels.models import ODD, JointModel
from diagnosis.wheels.run_kernel import RunEvidence, evidence_of_runs
from diagnosis.wheels.runs import runs_of
from diagnosis.wheels.settle import settled
from replay.arrays.processors import each
from replay.arrays.quantiles import median_of

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Following:
    """One wheel as the features need it, and the evidence behind."""

    described: Followed
    evidence: RunEvidence


def follow(data: WheelsData, blocks: WheelBlocks, model: JointModel) -> tuple[JointPass, dict[int, Following]]:
    """Run the recursion over all wheels and trace each one's path; the result holds the wheels with a model."""
    done = settled(blocks, model, forward(blocks, model))
    traced = {i: most_probable(done, i) for i, wheel in enumerate(model.wheels) if wheel is not None}
    faulty = np.zeros(blocks.y.shape, dtype=np.bool_)
    for i, (models, _) in traced.items():
        faulty[:, i] = models > ODD
    n = len(blocks.y)
    doubtful = np.zeros(n)
    steps = np.asarray(data.doubtful[:: blocks.width].any(axis=1), dtype=np.float64)[:n]
    doubtful[: steps.size] = steps

    def one(i: int) -> Following:
        models, entered = traced[i]
        runs = runs_of(models, entered, blocks.quiet[:, i], blocks.status[:, i], blocks.dt)
        evidence = evidence_of_runs(blocks, model, done, i, runs)
        opening = blocks.u[:, i].reshape(n, blocks.width).mean(axis=1)
        driven = np.abs(opening)[~blocks.quiet[:, i]]
        usual = float(median_of(driven)) if driven.size else 1.0
        others = faulty.sum(axis=1) - faulty[:, i].astype(np.float64)
        unseen = (blocks.unseen[:, i] != 0).astype(np.float64)
        rows = [
            described(
                int(runs.model[r]),
                evidence.evidence[r],
                run_context(runs, r, opening, usual, others, unseen, doubtful, data.misfit, blocks.dt),
            )
            for r in range(runs.model.size)
        ]
        return Following(Followed(models, runs, np.array(rows), done.fault[:, i]), evidence)

    return done, dict(zip(traced, each(one, traced, len(blocks.u)), strict=True))
