"""The compiled recursions over the steering models: Viterbi's, and those along a given path."""

from __future__ import annotations

from math import isnan

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.sample_status import PAIR, SKIP
from diagnosis.steering.filter_constants import FilterConstants
from diagnosis.steering.filter_state import (
    Array,
    Block,
    BlockSeries,
    FilterBank,
    Redundancy,
    RedundantBlock,
    SteeringPath,
)
from diagnosis.steering.model_bank import MODELS, STATES
from diagnosis.steering.step_kernel import advance, enter
from diagnosis.steering.waiting_kernel import learning_cost, may_wait, still_due, switch_cost
from replay.arrays.compiling import njit
from replay.arrays.copying import put, put_rows
from replay.arrays.numeric import uncounted


@njit(cache=True, error_model="numpy", forceinline=True, no_cpython_wrapper=True)
def _block(k: int, series: BlockSeries) -> Block:
    """Block k of an axle."""
    return Block(
        series.mean[k],
        series.power[k],
        series.samples[k],
        series.driven[k],
        series.spread[k],
        series.u[k],
        series.pace[k],
        series.status[k],
    )


@njit(cache=True, error_model="numpy", forceinline=True, no_cpython_wrapper=True)
def _redundant_block(k: int, seen: Redundancy) -> RedundantBlock:
    """What is measured redundantly in block k."""
    return RedundantBlock(
        seen.angle[k],
        seen.angle_variance[k],
        seen.opening[k],
        seen.opening_variance[k],
        seen.share[k],
        seen.share_variance[k],
        seen.command[k],
    )


@njit(cache=True, error_model="numpy", nogil=True)
def scan(
    series: BlockSeries,
    allowed: NDArray[np.bool_],
    constants: FilterConstants,
    score: Array,
    states: FilterBank,
    back: NDArray[np.uint8],
) -> None:
    """Viterbi over the models; changes `score` and `states`, writes back-pointers (n, models).

    Most models of a sensor that shows nothing, or noise, are entered anew in every block: what they make of it is told from the best
    model's by far. Such a one is not followed where it is sure that the next block enters it again (`diagnosis.steering.waiting_kernel`);
    until then its score is what it has at most. Nothing that is written differs.
    """
    bank = FilterBank(
        uncounted(states.mean),
        uncounted(states.cov),
        uncounted(states.noise),
        uncounted(states.gap),
        uncounted(states.room),
    )
    waits, due = np.zeros(MODELS, dtype=np.bool_), np.zeros(MODELS, dtype=np.bool_)
    for k in range(series.mean.size):
        best = int(np.int64(0))  # a literal 0 would compile what it is passed to once more
        for m in range(1, MODELS):
            if score[m] > score[best]:
                best = m
        top = score[best]
        if series.status[k] != SKIP:
            for m in range(MODELS):
                if m == best or not allowed[m]:
                    continue
                cost = switch_cost(m, best, constants)
                if top - cost - learning_cost(m) > score[m]:
                    score[m] = top - cost
                    back[k, m] = best
                    enter(m, best, constants, bank)
        top = -1e300
        block, seen = _block(k, series), _redundant_block(k, series.redundancy)
        entered_next = k + 1 < series.mean.size and series.status[k + 1] != SKIP
        some = block.status == PAIR and entered_next and not isnan(block.driven)
        for m in range(MODELS):
            waits[m] = some and may_wait(m, best) and back[k, m] == best
            due[m] = allowed[m] and not waits[m]
        more = True
        while more:
            for m in range(MODELS):
                if due[m]:
                    score[m] += advance(m, block, seen, constants, bank)
                    top, due[m] = max(top, score[m]), False
            more = some and still_due(score, top, block, constants, bank, waits, due)
        for m in range(MODELS):
            score[m] -= top


@njit(cache=True, error_model="numpy")
def empty_bank() -> FilterBank:
    """States of all models, before any has begun."""
    return FilterBank(
        np.zeros((MODELS, STATES)),
        np.zeros((MODELS, STATES, STATES)),
        np.ones((MODELS, 2)),
        np.zeros((MODELS, 2)),
        np.zeros(STATES),
    )


@njit(cache=True, error_model="numpy")
def start(m: int, first: float, constants: FilterConstants, bank: FilterBank) -> None:
    """Begin model m of a mission at the measured angle `first`. In rad."""
    stop = constants.axle.stop
    bank.mean[m, 0] = min(max(first, -stop), stop)
    bank.cov[m, 0, 0], bank.cov[m, 1, 1] = stop**2, (0.2 * constants.axle.rate_limit) ** 2
    bank.gap[m, 1] = constants.axle.play**2
    enter(m, m, constants, bank)


@njit(cache=True, error_model="numpy", nogil=True)
def path_evidence(
    series: BlockSeries,
    models: NDArray[np.uint8],
    begin: int,
    end: int,
    known: SteeringPath,
    first: float,
    constants: FilterConstants,
    kept: bool,
) -> tuple[float, Array]:
    """Log-evidence of blocks begin…end of a path, less the price of its switches, and [φ, r, a, b, d, c] at the end.

    The states before block `begin` are those of the path `known`; it begins a mission at the measured angle `first` [rad].
    Where `kept`, the states after each block are written into `known`: a function of its own would compile the filter again.

    `models` of shape (m,), the state of shape (6,).
    """
    bank = empty_bank()
    if begin > 0:
        before = np.int64(known.model[begin - 1])
        put(bank.mean[before], known.mean[begin - 1])
        put_rows(bank.cov[before], known.cov[begin - 1])
        put(bank.noise[before], known.noise[begin - 1])
        put(bank.gap[before], known.gap[begin - 1])
    else:
        before = np.int64(models[0])
        start(before, first, constants, bank)
    total = 0.0
    for k in range(begin, end):
        m = np.int64(models[k])
        if m != before:
            enter(m, before, constants, bank)
            total -= switch_cost(m, before, constants)
            before = m
        total += advance(m, _block(k, series), _redundant_block(k, series.redundancy), constants, bank)
        if kept:
            put(known.mean[k], bank.mean[m])
            put_rows(known.cov[k], bank.cov[m])
            put(known.noise[k], bank.noise[m])
            put(known.gap[k], bank.gap[m])
    return total, bank.mean[before].copy()
