"""Which row of the fault table holds, sample by sample: the most probable path through the models of `diagnosis.estimation.fault_models`.

Viterbi's recursion over the rows keeps, for each row, the most probable entry (per-survivor processing), so that onsets
come out at the sampling rate. The scores on the way forward know nothing of what follows: they say when a fault could
have been raised at the earliest.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from diagnosis.estimation.fault_models import (
    CLEAR,
    HEALTHY,
    MODELS,
    NOISY_MODELS,
    ROW_OF_MODEL,
    ROWS,
    SKIP,
    STAY,
    ModeModel,
    enter,
    likelihoods,
    trace,
)
from replay.arrays.spill import Column, blocks, release

Array = NDArray[np.float64]

_LEARNING_COST = 10.0  # what a new entry loses until its filter has settled: a settled one is kept that long


@dataclass(frozen=True)
class ModeState:
    """What the recursion carries from block to block: score, mean and covariance per model."""

    score: Array
    mean: Array
    cov: Array


def initial_state(model: ModeModel) -> ModeState:
    """State before the first sample: healthy is as probable as a fault that began long ago is not."""
    score = np.full(MODELS, -model.switch_cost / 2)
    score[HEALTHY] = 0.0
    mean, cov = np.zeros((MODELS, 2)), np.zeros((MODELS, 3))
    for m in range(MODELS):
        enter(m, model.packed(), mean, cov)
    return ModeState(score, mean, cov)


@njit(cache=True)
def _scan_modes(y, x, status, quiet, p, noisy, row, score, mean, cov, back, filtered):  # type: ignore[no-untyped-def]
    """Viterbi over the models; writes back-pointers (n, models) and softmax of scores by row (n, rows)."""
    models = score.size
    gain = np.zeros(models)
    for k in range(y.size):
        best = 0
        for m in range(1, models):
            if score[m] > score[best]:
                best = m
        if status[k] == CLEAR and row[best] == HEALTHY:
            if best != 0:
                back[k, 0] = best
            score[:] = -np.inf
            score[0] = 0.0
            filtered[k, HEALTHY] = 1.0
            continue
        top = score[best]
        if status[k] != SKIP:
            for m in range(models):
                cost = p[4]
                if row[m] == row[best] and m != best:
                    cost = 3.0
                learning = 0.0 if m == 0 or m == 2 else _LEARNING_COST
                if top - cost - learning > score[m]:
                    score[m] = top - cost
                    back[k, m] = best
                    enter(m, p, mean, cov)
            likelihoods(y[k], x[k], status[k], quiet[k], p, noisy, row, mean, cov, gain)
            top = -np.inf
            for m in range(models):
                score[m] += gain[m]
                top = max(top, score[m])
            for m in range(models):
                score[m] -= top
        total = 0.0
        for m in range(models):
            if score[m] > -50.0:
                w = np.exp(score[m])
                filtered[k, row[m]] += w
                total += w
        for i in range(filtered.shape[1]):
            filtered[k, i] /= total


@dataclass(frozen=True)
class ModePath:
    """Most probable rows.

    Attributes
    ----------
    model : NDArray[np.uint8], shape (n,)
        Model per sample.
    entered : NDArray[np.bool_], shape (n,)
        Samples at which a model was entered.
    filtered : NDArray[np.float32], shape (n, 5)
        Causal probability of each row (softmax of the survivors' scores).
    """

    model: NDArray[np.uint8]
    entered: NDArray[np.bool_]
    filtered: NDArray[np.float32]

    @property
    def row(self) -> NDArray[np.int8]:
        """Row of the table per sample."""
        return np.asarray(ROW_OF_MODEL.astype(np.int8)[self.model])

    def crossing(self, start: int, stop: int, slack: int, hold: int) -> int | None:
        """First sample of [start, stop) from which on a fault is lastingly more probable than none; see `first_lasting`."""
        near = slice(max(0, start - slack), stop)  # nothing outside is looked at
        raised = self.filtered[near, HEALTHY] < 0.5
        found = first_lasting(raised, start - near.start, stop - near.start, slack, hold)
        return None if found is None else near.start + found


def first_lasting(raised: NDArray[np.bool_], start: int, stop: int, slack: int, hold: int) -> int | None:
    """First sample of an interval from which on a causal decision lasts, so that a blip is no detection.

    The ends of the interval were found looking back: a rise up to `slack` samples before `start` counts as `start`, and
    the last `slack` samples count nothing; nor does a decision end where it is withdrawn for less than that.

    Parameters
    ----------
    raised : NDArray[np.bool_], shape (n,)
        Where the evidence up to a sample speaks for a fault.
    start, stop : int
        Samples of the interval, half open.
    slack : int
        Samples by which its ends may be off; at most a quarter of the interval at its end.
    hold : int
        Samples that a decision must last, or to the interval's end.

    Returns
    -------
    int or None
        None where a causal reading would have missed the fault.
    """
    first, last = max(0, start - slack), stop - min(slack, (stop - start) // 4)
    held = np.r_[False, raised[first:last], False]
    rises, falls = np.flatnonzero(held[1:] & ~held[:-1]), np.flatnonzero(held[:-1] & ~held[1:])
    apart = rises[1:] - falls[:-1] >= slack
    begins, ends = rises[np.r_[True, apart][: rises.size]], falls[np.r_[apart, True][: falls.size]]
    lasts = (ends - begins >= hold) | (ends == last - first)
    return max(start, first + int(begins[lasts][0])) if lasts.any() else None


def forward(
    y: Array,
    x: Array,
    status: NDArray[np.int8],
    quiet: NDArray[np.bool_],
    model: ModeModel,
    state: ModeState,
) -> tuple[NDArray[np.uint8], NDArray[np.float32], ModeState]:
    """Run the recursion over one block.

    Parameters
    ----------
    y, x : Array, shape (n,)
        Measured value and reference.
    status : NDArray[np.int8], shape (n,)
        `SKIP` (nothing new), `PAIR` (both valid), `SILENT` (y silent while its source lives), `BLIND` (both valid, but
        x changes faster than the log resolves) or `CLEAR` (a pair far from anything that contradicts healthy: taken as
        healthy unmeasured where the path is healthy, to save time).
    quiet : NDArray[np.bool_], shape (n,)
        Where the machine stands, so that a reading of zero is what a healthy channel gives too.
    model : ModeModel
        Noise and prior.
    state : ModeState
        From `initial_state` or from the block before.

    Returns
    -------
    back : NDArray[np.uint8], shape (n, models)
        Back-pointers for `trace`.
    filtered : Array, shape (n, 5)
        Causal probability of each row.
    state : ModeState
        For the next block.
    """
    back = np.full((y.size, MODELS), STAY, dtype=np.uint8)
    filtered = np.zeros((y.size, len(ROWS)), dtype=np.float32)
    score, mean, cov = state.score.copy(), state.mean.copy(), state.cov.copy()
    p = model.packed()
    _scan_modes(y, x, status, quiet, p, NOISY_MODELS, ROW_OF_MODEL, score, mean, cov, back, filtered)
    return back, filtered, ModeState(score, mean, cov)


def most_probable(
    y: Array,
    x: Array,
    status: NDArray[np.int8],
    quiet: NDArray[np.bool_],
    model: ModeModel,
) -> ModePath:
    """Most probable rows of a whole channel; see `forward` for the arguments."""
    state = initial_state(model)
    pointers, probabilities = Column(np.uint8, (MODELS,)), Column(np.float32, (len(ROWS),))
    for part in blocks(y.size):
        back, filtered, state = forward(y[part], x[part], status[part], quiet[part], model, state)
        pointers.append(back)
        probabilities.append(filtered)
        release(y, x)
    whole = pointers.finish()
    path, entered = trace(whole, int(np.argmax(state.score)))
    release(whole)
    return ModePath(path, entered, probabilities.finish())
