"""Most probable rows of the sensor's table for a speed beside an independent reading of it: a hidden Markov model.

Unlike `diagnosis.estimation.viterbi`, which estimates gain and bias as it goes, the unknowns lie on a grid here: every state has
its own ε, or its own bias and power. Nothing has to be learned after an onset, so that a few samples decide, onsets stay
sharp, and noise with heavy tails does no harm.

healthy      y = x + n
stuck        y as one sample before
no_signal    y = 0
inefficient  y = (1 − ε)·x + n
noisy        y = x + m + n + w, bias m, noise w

A reading of the speed that rests on another channel is exact for most samples and a step late for the rest, so n is
small with probability q and large otherwise; a few samples are larger still.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from diagnosis.estimation.fault_models import (
    BLIND,
    HEALTHY,
    INEFFICIENT,
    NO_SIGNAL,
    NOISY,
    PAIR,
    SILENT,
    SKIP,
    STAY,
    STUCK,
)

Array = NDArray[np.float64]

_EPSILONS = np.r_[np.arange(3, 10), np.arange(10, 97, 2)] / 100
_HALF_STEPS = np.where(_EPSILONS < 0.1, 0.005, 0.01)
_POWERS = np.array([0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0])  # of the added noise [healthy noise]
_BIASES = np.arange(-3.0, 3.5)  # of the noisy row [its noise]
_TAIL_SHARE, _TAIL_SIZE = 0.01, 3.0
_WITHIN_NOISY = 4.0  # cost of another bias or power within the noisy row
_SILENT_COST = -6.0
_OUTLIER = -18.0


@dataclass(frozen=True)
class RowModel:
    """Noise and prior of a speed.

    Attributes
    ----------
    noise : float
        Root mean square of y − x while healthy [m/s].
    core, exact : float
        Standard deviation of the samples that are exact [m/s], and their share [1].
    constant_noise : float
        Standard deviation of y while stuck [m/s].
    span : float
        Largest plausible speed [m/s].
    switch_cost : float
        Minus the log-probability of entering a row at one sample.
    """

    noise: float
    core: float
    exact: float
    constant_noise: float
    span: float
    switch_cost: float

    @property
    def added(self) -> Array:
        """Noise w of each state [m/s]; 0 outside the noisy row."""
        out: Array = np.r_[np.zeros(3 + _EPSILONS.size), np.repeat(_POWERS * self.noise, _BIASES.size)]
        return out

    @property
    def bias(self) -> Array:
        """Bias m of each state [m/s]; 0 outside the noisy row."""
        out: Array = np.r_[np.zeros(3 + _EPSILONS.size), (_POWERS[:, None] * self.noise * _BIASES).ravel()]
        return out

    def packed(self) -> Array:
        """Parameters in the order of the compiled scan."""
        rest = (self.noise**2 - self.exact * self.core**2) / max(1 - self.exact, 1e-3)
        late = np.sqrt(max(rest, self.core**2))
        return np.array([self.core, late, self.exact, self.constant_noise, self.span, self.switch_cost])


EPSILON = np.r_[np.zeros(3), _EPSILONS, np.zeros(_POWERS.size * _BIASES.size)]
HALF_STEP = np.r_[np.zeros(3), _HALF_STEPS, np.zeros(_POWERS.size * _BIASES.size)]
ROW = np.r_[
    HEALTHY, STUCK, NO_SIGNAL, np.full(_EPSILONS.size, INEFFICIENT), np.full(_POWERS.size * _BIASES.size, NOISY)
].astype(np.int64)
STATES = ROW.size


@njit(cache=True)
def emission(m, y, x, slack, last, status, quiet, row, eps, half, bias, added, p):  # type: ignore[no-untyped-def]
    """Log-likelihood of one sample in state m; `last` is the sample of y before, NaN for none, `slack` what x may be off."""
    core, late, exact, constant, span = p[0], p[1], p[2], p[3], p[4]
    if status == SILENT:
        return 0.0 if row[m] == NO_SIGNAL else _SILENT_COST
    if row[m] == STUCK or row[m] == NO_SIGNAL:
        level = last if row[m] == STUCK else 0.0
        if quiet and abs(y) < 3 * late:
            level = np.nan  # standing still, nothing says that a constant reading is wrong
        if np.isnan(level):
            return -np.log(2 * span)
        z = (y - level) / constant
        return max(-0.5 * z * z - np.log(constant * np.sqrt(2 * np.pi)), _OUTLIER - np.log(span))
    if status == BLIND:  # only whether y changes from sample to sample says something
        step = 0.0 if np.isnan(last) else min(abs(y - last) / late, 2.0)
        return -0.5 * step * step - np.log(late * np.sqrt(2 * np.pi))
    width = slack * slack + (half[m] * x) ** 2 / 3 + (added[m] * added[m] * (1 + 1 / 12) if added[m] > 0 else 0.0)
    d = y - (1 - eps[m]) * x - bias[m]
    out = 1e-300
    s = np.sqrt(core * core + width)
    out += exact * np.exp(-0.5 * (d / s) ** 2) / s
    s = np.sqrt(late * late + width)
    out += (1 - exact - _TAIL_SHARE) * np.exp(-0.5 * (d / s) ** 2) / s
    s = _TAIL_SIZE * s
    out += _TAIL_SHARE * np.exp(-0.5 * (d / s) ** 2) / s
    return np.log(out) - 0.5 * np.log(2 * np.pi)


@njit(cache=True)
def _scan_rows(y, x, slack, last, status, quiet, row, eps, half, bias, added, p, score, back, lead):  # type: ignore[no-untyped-def]
    """Viterbi over the states; `back` holds where a state was entered from, `STAY` where it went on; `lead` fault − healthy."""
    states = score.size
    for k in range(y.size):
        if status[k] == SKIP:
            lead[k] = lead[k - 1] if k > 0 else 0.0
            continue
        best, noisy = 0, -1
        for m in range(1, states):
            if score[m] > score[best]:
                best = m
        for m in range(states):
            if row[m] == NOISY and (noisy < 0 or score[m] > score[noisy]):
                noisy = m
        top, drift = score[best] - p[5], score[noisy] - _WITHIN_NOISY
        for m in range(states):
            if top > score[m] and best != m:
                score[m] = top
                back[k, m] = best
            if row[m] == NOISY and drift > score[m] and noisy != m:
                score[m] = drift
                back[k, m] = noisy
            score[m] += emission(m, y[k], x[k], slack[k], last[k], status[k], quiet[k], row, eps, half, bias, added, p)
        fault = score[1]
        for m in range(2, states):
            fault = max(fault, score[m])
        lead[k] = fault - score[0]
        peak = max(fault, score[0])
        for m in range(states):
            score[m] -= peak


@njit(cache=True)
def _trace(back, state):  # type: ignore[no-untyped-def]
    path = np.empty(back.shape[0], dtype=np.int16)
    for k in range(back.shape[0] - 1, -1, -1):
        path[k] = state
        if back[k, state] != STAY:
            state = back[k, state]
    return path


@njit(cache=True)
def _sum_states(y, x, slack, last, status, quiet, row, eps, half, bias, added, p, out):  # type: ignore[no-untyped-def]
    for k in range(y.size):
        if status[k] != SKIP:
            for m in range(out.size):
                out[m] += emission(
                    m, y[k], x[k], slack[k], last[k], status[k], quiet[k], row, eps, half, bias, added, p
                )


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


def forward(
    y: Array,
    x: Array,
    slack: Array,
    status: NDArray[np.int8],
    quiet: NDArray[np.bool_],
    model: RowModel,
    state: RowState,
) -> tuple[NDArray[np.uint8], Array, RowState]:
    """Run the recursion over one block.

    Parameters
    ----------
    y, x : Array, shape (n,)
        Measured speed and the independent reading of it [m/s].
    slack : Array, shape (n,)
        Standard deviation of what that reading may be off for long [m/s].
    status : NDArray[np.int8], shape (n,)
        As in `diagnosis.estimation.fault_models`; `BLIND` where y has no x beside it.
    quiet : NDArray[np.bool_], shape (n,)
        Where the drive is neither commanded nor moving.
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
    back = np.full((y.size, STATES), STAY, dtype=np.uint8)
    lead = np.zeros(y.size)
    score = state.score.copy()
    last = _before(y, status, state.last)
    _scan_rows(
        y,
        x,
        slack,
        last,
        status,
        quiet,
        ROW,
        EPSILON,
        HALF_STEP,
        model.bias,
        model.added,
        model.packed(),
        score,
        back,
        lead,
    )
    known = y[(status == PAIR) | (status == BLIND)]
    return back, lead, RowState(score, float(known[-1]) if known.size else state.last)


def most_probable(
    y: Array, x: Array, slack: Array, status: NDArray[np.int8], quiet: NDArray[np.bool_], model: RowModel
) -> tuple[NDArray[np.int64], Array]:
    """Row of every sample of a whole channel, and the causal lead of a fault; see `forward`."""
    back, lead, state = forward(y, x, slack, status, quiet, model, initial_state(model))
    return ROW[_trace(back, int(np.argmax(state.score)))], lead


def state_evidence(
    y: Array, x: Array, slack: Array, status: NDArray[np.int8], quiet: NDArray[np.bool_], model: RowModel, last: float
) -> Array:
    """Log-likelihood of a segment in every state that holds for all of it, shape (states,); `last` is y before it."""
    out = np.zeros(STATES)
    _sum_states(
        y,
        x,
        slack,
        _before(y, status, last),
        status,
        quiet,
        ROW,
        EPSILON,
        HALF_STEP,
        model.bias,
        model.added,
        model.packed(),
        out,
    )
    return out
