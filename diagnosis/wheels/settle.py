"""Faults that began together: whether one wheel's change explains what the others seem to suffer.

When a valve fails or recovers, the pump feeds all other wheels more or less, and the body pulls them along. For a few
blocks it is open which wheel changed, and a wrong answer may keep itself alive. So every fault that began at another
one's change is taken back once; the others are followed again without it, and whichever explains all wheels best stays.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.wheels.blocks import WheelBlocks
from diagnosis.wheels.filter import JointPass, forward, most_probable
from diagnosis.wheels.models import HEALTHY, TOTAL_SENSOR, JointModel
from diagnosis.wheels.runs import Runs, runs_of

_NEAR_S = 0.3
_MARGIN_S = 0.05
_ROUNDS = 1


def settled(blocks: WheelBlocks, model: JointModel, done: JointPass) -> JointPass:
    """The pass with faults taken back that another wheel's change explains better.

    Parameters
    ----------
    blocks, model
        The wheels.
    done : JointPass
        A first pass over all blocks.
    """
    for _ in range(_ROUNDS):
        runs, paths = _paths(blocks, model, done)
        doubted = _doubted(runs, round(_NEAR_S / blocks.dt))
        if not doubted:
            return done
        without = paths.copy()
        for i, a, b in doubted:
            without[a:b, i] = HEALTHY
        trial = forward(blocks, model, given=without)
        gain = np.cumsum((trial.gains - done.gains).sum(axis=1))
        margin = round(_MARGIN_S / blocks.dt)
        taken_back = 0
        for i, a, b in doubted:
            first, last = max(0, a - margin), min(gain.size - 1, b + margin)
            if gain[last] - gain[first] > 0:
                paths[a:b, i] = HEALTHY
                taken_back += 1
        if not taken_back:
            return done
        better = trial if taken_back == len(doubted) else forward(blocks, model, given=paths)
        if better.evidence <= done.evidence:
            return done
        done = better
    return done


def _paths(blocks: WheelBlocks, model: JointModel, done: JointPass) -> tuple[dict[int, Runs], NDArray[np.uint8]]:
    """Runs of every wheel, and its models by block, shape (n, wheels)."""
    paths = np.zeros(blocks.y.shape, dtype=np.uint8)
    runs = {}
    for i, wheel in enumerate(model.wheels):
        if wheel is None:
            continue
        path, entered = most_probable(done, i)
        paths[:, i] = path
        runs[i] = runs_of(path, entered, blocks.quiet[:, i], blocks.status[:, i], blocks.dt)
    return runs, paths


def _doubted(runs: dict[int, Runs], near: int) -> list[tuple[int, int, int]]:
    """Faults (wheel, start, stop) that began near another one's beginning or end."""
    changes = []
    for i, r in runs.items():
        for a, b, m in zip(r.start, r.stop, r.model, strict=True):
            if m != HEALTHY:
                changes += [(int(a), i, int(a)), (int(b), i, int(a))]
    changes.sort()
    times = np.array([t for t, _, _ in changes], dtype=np.int64)
    out = []
    for i, r in runs.items():
        for a, b, m in zip(r.start, r.stop, r.model, strict=True):
            if m == HEALTHY or m in TOTAL_SENSOR:
                continue
            low, high = np.searchsorted(times, (a - near, a + near + 1))
            if any((wheel, start) != (i, int(a)) for _, wheel, start in changes[low:high]):
                out.append((i, int(a), int(b)))
    return out
