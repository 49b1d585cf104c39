"""From a wheel's blocks to the probability of each of its states, and the spells of its faults."""

from __future__ import annotations

import numpy as np

from diagnosis.response.inputs import cells
from diagnosis.response.joint import cut, joint_of
from diagnosis.response.kernel import posterior
from diagnosis.response.machine import Judged
from diagnosis.response.models import MEAN_FAULTY_S, MEAN_HEALTHY_S, Beside, scores
from diagnosis.response.rivals import jumped, shared
from diagnosis.response.spells import spells_of
from diagnosis.response.usual_times import as_usual

_AT_A_JUMP = 0.1, 0.3  # probability that a fault begins, or ends, where the channel jumps


def judge(one: Judged, beside: Beside | None, dt: float, width: int) -> Judged:
    """A wheel with the probability of each state in each block, and the spells of its faults.

    Parameters
    ----------
    one : Judged
        The wheel.
    beside : Beside or None
        What another view says of its speed.
    dt : float
        Step [s].
    width : int
        Steps in a block.
    """
    block_s, blocks = width * dt, one.wheel.blocks
    if beside is not None:  # what shakes other wheels too is no sensor's noise, up to what a wheel's inertia allows
        blocks = blocks._replace(usual=np.maximum(blocks.usual, np.minimum(beside.rough, blocks.most)))
    rolled = one.data.rolled
    usual, name = as_usual(blocks.mean, one.data.joint_share, width), f"{one.data.name}_position"
    joint = None if rolled is None else joint_of(blocks, cells(rolled, width), beside, name, usual)
    score = scores(blocks, one.driving, block_s, beside, None if joint is None else joint.view)
    places = one.wheel.samples.step[one.wheel.jumps.place] // width
    enters, leaves = np.full((2, len(score)), [[-np.expm1(-block_s / t)] for t in (MEAN_HEALTHY_S, MEAN_FAULTY_S)])
    enters[places], leaves[places] = _AT_A_JUMP
    p = posterior(score, enters, leaves)
    return one._replace(
        posterior=p,
        spells=[s if jumped(one, s) else shared(s, beside) for s in cut(spells_of(p, block_s), joint, blocks)],
        speed=None if beside is None else beside.speed,
        across=None if beside is None else beside.across,
        joint=joint,
        view=beside,
        wheel=one.wheel._replace(
            blocks=blocks, compared="" if beside is None else beside.compared, own=beside is not None and beside.own
        ),
    )
