"""Most probable rows of the sensor's table for a speed beside an independent reading of it: a hidden Markov model."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.sample_status import BLIND, PAIR
from diagnosis.drives.kernel import scan_rows, sum_states
from diagnosis.drives.models import ROW, STATES, RowModel
from diagnosis.estimation.back_pointers import STAY, trace

Array = NDArray[np.float64]


class SpeedSamples(NamedTuple):
    """A measured speed beside an independent reading of it; all of shape (n,).

    Attributes
    ----------
    y, x : Array
        Measured speed and the independent reading of it [m/s]; NaN where not valid.
    slack : Array
        Standard deviation of how far that reading may be out for long [m/s].
    status : NDArray[np.int8]
        See `diagnosis.channels.sample_status`; `BLIND` where y has no x beside it.
    quiet : NDArray[np.bool_]
        Where the drive is neither commanded nor moving.
    """

    y: Array
    x: Array
    slack: Array
    status: NDArray[np.int8]
    quiet: NDArray[np.bool_]

    def part(self, start: int, stop: int) -> SpeedSamples:
        """Samples [start, stop)."""
        s = slice(start, stop)
        return SpeedSamples(self.y[s], self.x[s], self.slack[s], self.status[s], self.quiet[s])


@dataclass(frozen=True)
class RowState:
    """What the recursion carries from block to block: the states' scores, and the last sample of y."""

    score: Array
    last: float


def initial_state(model: RowModel) -> RowState:
    """State before a mission that may begin with a fault."""
    score = np.full(STATES, -model.switch_cost / 2)
    score[0] = 0.0
    return RowState(score, float("nan"))


def _before(y: Array, status: NDArray[np.int8], last: float) -> Array:
    """Value of the last new sample of y before each step."""
    places = np.where((status == PAIR) | (status == BLIND), np.arange(y.size), -1)
    latest = np.r_[-1, np.maximum.accumulate(places)[:-1]] if y.size else places
    return np.where(latest >= 0, y[latest], last)


def forward(samples: SpeedSamples, model: RowModel, state: RowState) -> tuple[NDArray[np.uint8], Array, RowState]:
    """Run the recursion over one block.

    Parameters
    ----------
    samples : SpeedSamples
        The block.
    model : RowModel
        Noise and prior.
    state : RowState
        From `initial_state` or from the block before.

    Returns
    -------
    back : NDArray[np.uint8], shape (n, states)
        Where a state was entered from; `STAY` where it went on.
    lead : Array, shape (n,)
        Score of the best faulty state minus that of the healthy one, by what was known at each step.
    state : RowState
        For the next block.
    """
    y, status = samples.y, samples.status
    back = np.full((y.size, STATES), STAY, dtype=np.uint8)
    lead = np.zeros(y.size)
    score = state.score.copy()
    scan_rows(samples, _before(y, status, state.last), model.disturbance, model.grid_noise(), score, back, lead)
    known = y[(status == PAIR) | (status == BLIND)]
    return back, lead, RowState(score, float(known[-1]) if known.size else state.last)


def most_probable(samples: SpeedSamples, model: RowModel) -> tuple[NDArray[np.int64], Array]:
    """Row of every sample of a whole channel, and the causal lead of a fault; see `forward`. Both of shape (n,)."""
    back, lead, state = forward(samples, model, initial_state(model))
    return ROW[trace(back, int(np.argmax(state.score)))[0]], lead


def state_evidence(samples: SpeedSamples, model: RowModel, last: float) -> Array:
    """Log-likelihood of a segment in every state that holds for all of it, shape (states,); `last` is y before it."""
    out = np.zeros(STATES)
    before = _before(samples.y, samples.status, last)
    sum_states(samples, before, model.disturbance, model.grid_noise(), out)
    return out
