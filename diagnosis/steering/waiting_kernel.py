"""The price of going from one steering model to another, and which models need not be followed over a block (compiled).

A model that has been entered may be entered again in the next block, from the model that is best then. What it made of the block in
between is lost. It is enough to know that it will be so: by the most that the block may give it, which its noise alone tells.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.steering.filter_constants import FilterConstants
from diagnosis.steering.filter_state import Array, Block, FilterBank
from diagnosis.steering.measurement_kernel import most_likely
from diagnosis.steering.model_bank import (
    ACTUATOR,
    HEALTHY,
    HEALTHY_MODEL,
    INEFFICIENT,
    MODELS,
    NO_SIGNAL,
    NO_SIGNAL_MODEL,
    NOISY,
    SENSOR,
    STUCK,
)
from replay.arrays.compiling import njit

_LEARNING_COST = 8.0  # what a model whose states are yet to be learnt must gain to be entered [log-likelihood]
_CHANGE_COST = 12.0
_NOISE_COST = 3.0  # of one kind of noise after the other [log-likelihood]
_SURE = 0.01  # room for what rounding makes of variances [log-likelihood]


@njit(cache=True, error_model="numpy", forceinline=True, no_cpython_wrapper=True)
def _change(row: int, old: int) -> float:
    """Minus the log-probability that a part goes from one row to another without being healthy between them."""
    return _CHANGE_COST if row != HEALTHY and old != HEALTHY else 0.0


@njit(cache=True, error_model="numpy", no_cpython_wrapper=True)
def switch_cost(m: int, old: int, constants: FilterConstants) -> float:
    """Minus the log-probability of going from model `old` to m within one block."""
    s, s0 = SENSOR[m], SENSOR[old]
    cost = constants.switch_cost
    out = 0.0
    if s != s0:
        out += _NOISE_COST if s >= NOISY and s0 >= NOISY else cost + _change(s, s0)
    if ACTUATOR[m] != ACTUATOR[old]:
        hidden = s in (STUCK, NO_SIGNAL) and not constants.redundant
        out += 0.0 if hidden else cost + _change(ACTUATOR[m], ACTUATOR[old])
    return out


@njit(cache=True, error_model="numpy", forceinline=True, no_cpython_wrapper=True)
def learning_cost(m: int) -> float:
    """By how much entering model m must pay beyond its price [log-likelihood]."""
    return 0.0 if m in (HEALTHY_MODEL, NO_SIGNAL_MODEL) else _LEARNING_COST


@njit(cache=True, error_model="numpy", forceinline=True, no_cpython_wrapper=True)
def may_wait(m: int, old: int) -> bool:
    """Whether noise alone may tell that model m, entered from `old`, explains nothing."""
    s = SENSOR[m]
    return s != SENSOR[old] and s in (STUCK, NO_SIGNAL, NOISY)


@njit(cache=True, error_model="numpy", no_cpython_wrapper=True)
def still_due(
    score: Array,
    top: float,
    block: Block,
    constants: FilterConstants,
    bank: FilterBank,
    waits: NDArray[np.bool_],
    due: NDArray[np.bool_],
) -> bool:
    """Whether some models that wait have to be followed over the block after all; if not, their scores become what they are at most.

    `score` [log-likelihood], `waits` and `due` of shape (models,); `top` is the best score of those that have been followed. Marks the models as due,
    and no longer waiting.
    """
    lead, more = 0, False
    for m in range(1, MODELS):
        if not waits[m] and score[m] > score[lead]:
            lead = m
    for m in range(MODELS):
        if waits[m]:
            most = score[m] + most_gained(m, block, constants, bank)
            if most - top + _SURE >= -switch_cost(m, lead, constants) - learning_cost(m):
                waits[m], due[m], more = False, True, True
    if not more:
        for m in range(MODELS):
            if waits[m]:
                score[m] += most_gained(m, block, constants, bank)
    return more


@njit(cache=True, error_model="numpy", no_cpython_wrapper=True)
def most_gained(m: int, block: Block, constants: FilterConstants, bank: FilterBank) -> float:
    """The most that `advance` may give model m, whose sensor's row has just been entered, for a block with samples [log-likelihood].

    What is measured redundantly gives nothing at most.
    """
    out = most_likely(m, block, constants.axle, constants.sensor, bank)
    free = SENSOR[m] >= INEFFICIENT or ACTUATOR[m] == INEFFICIENT or ACTUATOR[m] == NOISY
    return float(out - constants.freedom_cost if free else out)
