"""Which row of the fault table holds, sample by sample: the most probable path through the models of `diagnosis.estimation.fault_models`.

Viterbi's recursion over the rows keeps, for each row, the most probable entry (per-survivor processing), so that onsets
come out at the sampling rate. The scores on the way forward know nothing of what follows: they say when a fault could
have been raised at the earliest.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.sample_status import CLEAR, SKIP
from diagnosis.estimation.back_pointers import STAY, trace
from diagnosis.estimation.fault_models import EXACT, HEALTHY, MODELS, ROW_OF_MODEL, ZERO, ModeModel
from diagnosis.estimation.filter_kernel import FilterState, enter, entered_state, likelihoods
from diagnosis.estimation.samples import Samples
from diagnosis.results.fault_rows import ROWS
from replay.arrays.blocks import release
from replay.arrays.column_store import ColumnStore
from replay.arrays.compiling import njit

Array = NDArray[np.float64]

_LEARNING_COST = 10.0  # what a new entry loses until its filter has settled: a settled one is kept that long
_SIBLING_COST = 3.0  # of another model of the same row


class PathPointers(NamedTuple):
    """What the recursion writes about each sample of a block.

    Attributes
    ----------
    back : NDArray[np.uint8], shape (n, models)
        Back-pointers for `trace`.
    filtered : NDArray[np.float32], shape (n, rows)
        Causal probability of each row.
    """

    back: NDArray[np.uint8]
    filtered: NDArray[np.float32]


def initial_state(model: ModeModel) -> FilterState:
    """State before the first sample: healthy is as probable as a fault that began long ago is not."""
    state = entered_state(model)
    state.score[model.admitted()] = -model.switch_cost / 2
    state.score[EXACT] = 0.0
    return state


@njit(cache=True, no_cpython_wrapper=True)
def _enter_from_best(k, best, bank, state, back):  # type: ignore[no-untyped-def]
    """Let every model be entered from the best one, where that is worth what it costs."""
    top = state.score[best]
    for m in range(state.score.size):
        if not bank.admitted[m]:
            continue
        cost = bank.switch_cost
        if ROW_OF_MODEL[m] == ROW_OF_MODEL[best] and m != best:
            cost = _SIBLING_COST
        learning = 0.0 if m in (EXACT, ZERO) else _LEARNING_COST
        if top - cost - learning > state.score[m]:
            state.score[m] = top - cost
            back[k, m] = best
            enter(m, bank, state.mean, state.cov)


@njit(cache=True, nogil=True)
def _scan_modes(samples, bank, state, out):  # type: ignore[no-untyped-def]
    """Viterbi over the models; writes back-pointers (n, models) and softmax of scores by row (n, rows)."""
    status = samples.status
    score, mean, cov = state
    back, filtered = out
    models = score.size
    gain = np.zeros(models)
    for k in range(status.size):
        best = int(np.int64(0))  # a literal 0 would compile what it is passed to once more
        for m in range(1, models):
            if score[m] > score[best]:
                best = m
        if status[k] == CLEAR and ROW_OF_MODEL[best] == HEALTHY:
            if best != EXACT:
                back[k, EXACT] = best
            score[:] = -np.inf
            score[EXACT] = 0.0
            filtered[k, HEALTHY] = 1.0
            continue
        if status[k] != SKIP:
            _enter_from_best(k, best, bank, state, back)
            likelihoods(k, samples, bank, mean, cov, gain)
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
                filtered[k, ROW_OF_MODEL[m]] += w
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
    filtered : NDArray[np.float32], shape (n, rows)
        Causal probability of each row (softmax of the survivors' scores).
    """

    model: NDArray[np.uint8]
    entered: NDArray[np.bool_]
    filtered: NDArray[np.float32]

    @property
    def row(self) -> NDArray[np.int8]:
        """Row of the table per sample. Shape (n,)."""
        return np.asarray(ROW_OF_MODEL.astype(np.int8)[self.model])

    def crossing(self, start: int, stop: int, slack: int, hold: int) -> int | None:
        """First sample of [start, stop) from which on a fault is lastingly more probable than none; see `first_lasting`."""
        near = slice(max(0, start - slack), stop)  # nothing outside counts
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


def forward(samples: Samples, model: ModeModel, state: FilterState) -> tuple[PathPointers, FilterState]:
    """Run the recursion over one block.

    Parameters
    ----------
    samples : Samples
        The block. A sample that is `CLEAR` is taken as healthy unmeasured where the path is healthy, to save time.
    model : ModeModel
        Noise and prior.
    state : FilterState
        From `initial_state` or from the block before; it stays as it is.

    Returns
    -------
    pointers : PathPointers
        Back-pointers and causal probabilities.
    state : FilterState
        For the next block.
    """
    size = samples.y.size
    out = PathPointers(np.full((size, MODELS), STAY, dtype=np.uint8), np.zeros((size, len(ROWS)), dtype=np.float32))
    state = state.copied()
    _scan_modes(samples, model.bank(), state, out)
    return out, state


def most_probable(samples: Samples, model: ModeModel, store: ColumnStore | None = None) -> ModePath:
    """Most probable rows of a whole channel; its long columns stand in `store` (None: one of their own)."""
    store = store or ColumnStore()
    state = initial_state(model)
    pointers, probabilities = store.column(np.uint8, (MODELS,)), store.column(np.float32, (len(ROWS),))
    for part in store.blocks(samples.y.size):
        found, state = forward(samples.at(part), model, state)
        pointers.append(found.back)
        probabilities.append(found.filtered)
        release(samples.y, samples.x)
    whole = pointers.finish()
    path, entered = trace(whole, int(np.argmax(state.score)))
    release(whole)
    return ModePath(path, entered, probabilities.finish())
