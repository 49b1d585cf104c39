"""Which row of the fault table holds, sample by sample: mode-conditioned Kalman filters and the most probable path.

Every row of the two tables is a model of a measured y against a reference x (v against v_true by L4, u_applied against
u_a by L8):

healthy      y = x + n
stuck        y = c, a constant c
no_signal    y = 0
inefficient  y = δ·x + n, δ constant
noisy        y = δ·x + δ̄ + n, δ̄ drifting (random walk) or white with one of several powers

A Kalman filter per row starts when the row is entered and carries the row's unknowns [δ or c, δ̄]. Viterbi's recursion
over the rows keeps, for each row, the most probable entry (per-survivor processing), so that onsets come out at the
sampling rate. Between two samples of y nothing is updated; a y that is silent while its source lives speaks for
no_signal.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]

HEALTHY, STUCK, NO_SIGNAL, INEFFICIENT, NOISY = range(5)
ROWS = ("healthy", "stuck", "no_signal", "inefficient", "noisy")
WHITE_POWERS = (3.0, 8.0, 25.0, 80.0)
ROW_OF_MODEL = np.array([HEALTHY, STUCK, NO_SIGNAL, INEFFICIENT, NOISY] + [NOISY] * len(WHITE_POWERS))
MODELS = ROW_OF_MODEL.size

SKIP, PAIR, SILENT = 0, 1, 2
_STAY = 255
_OUTLIER = -18.0
_SILENT_COST = -6.0


@dataclass(frozen=True)
class ModeModel:
    """Noise and prior of one channel; all in the channel's unit.

    Attributes
    ----------
    noise : float
        Standard deviation of y − x while healthy.
    constant_noise : float
        Standard deviation of y while stuck: the rounding step of a sensor, the noise of a spool sensor.
    span : float
        Largest plausible magnitude of y.
    drift : float
        Random walk of δ̄ [unit/√s].
    switch_cost : float
        Minus the log-probability of entering a row at one sample.
    dt : float
        Step [s].
    """

    noise: float
    constant_noise: float
    span: float
    drift: float
    switch_cost: float
    dt: float

    def packed(self) -> Array:
        """Parameters in the order of the compiled scan."""
        return np.array([self.noise, self.constant_noise, self.span, self.drift**2 * self.dt, self.switch_cost])


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
        _enter(m, model.packed(), mean, cov)
    return ModeState(score, mean, cov)


@njit(cache=True)
def _enter(m, p, mean, cov):  # type: ignore[no-untyped-def]
    """Prior of a model's unknowns [δ or c, δ̄] at entry; cov = (P11, P12, P22)."""
    span = p[2]
    mean[m, 0], mean[m, 1] = 0.0, 0.0
    cov[m, 0], cov[m, 1], cov[m, 2] = 0.0, 0.0, 0.0
    if m == 0:
        mean[m, 0] = 1.0
    elif m == 1:
        cov[m, 0] = span * span
    elif m == 3:
        mean[m, 0], cov[m, 0] = 0.5, 0.09
    elif m >= 4:
        mean[m, 0], cov[m, 0] = 0.6, 0.09
        cov[m, 2] = (0.3 * span) ** 2


@njit(cache=True)
def _step(m, y, x, p, whites, mean, cov):  # type: ignore[no-untyped-def]
    """Kalman update of one model with y = H·[·,·] + n; returns the innovation's log-likelihood."""
    r = p[0] * p[0]
    h0, h1 = x, 0.0
    if m == 1:
        h0, r = 1.0, p[1] * p[1]
    elif m == 2:
        h0, r = 0.0, p[1] * p[1]
    elif m >= 4:
        h1 = 1.0
        if m == 4:
            cov[m, 2] += p[3]
        else:
            r *= whites[m - 5] ** 2
    a, b, c = cov[m, 0], cov[m, 1], cov[m, 2]
    # S = H P Hᵀ + R
    g0, g1 = a * h0 + b * h1, b * h0 + c * h1
    s = h0 * g0 + h1 * g1 + r
    innovation = y - h0 * mean[m, 0] - h1 * mean[m, 1]
    k0, k1 = g0 / s, g1 / s
    mean[m, 0] += k0 * innovation
    mean[m, 1] += k1 * innovation
    # P = (I − K H) P
    cov[m, 0] = a - k0 * g0
    cov[m, 1] = b - k0 * g1
    cov[m, 2] = c - k1 * g1
    return -0.5 * (innovation * innovation / s + np.log(2 * np.pi * s))


@njit(cache=True)
def _scan_modes(y, x, status, p, whites, row, score, mean, cov, back, filtered):  # type: ignore[no-untyped-def]
    """Viterbi over the models; writes back-pointers (n, models) and softmax of scores by row (n, rows)."""
    models = score.size
    floor = _OUTLIER - np.log(p[2])
    for k in range(y.size):
        best = 0
        for m in range(1, models):
            if score[m] > score[best]:
                best = m
        top = score[best]
        if status[k] != SKIP:
            for m in range(models):
                cost = p[4]
                if row[m] == row[best] and m != best:
                    cost = 3.0
                if top - cost > score[m]:
                    score[m] = top - cost
                    back[k, m] = best
                    _enter(m, p, mean, cov)
            for m in range(models):
                if status[k] == SILENT:
                    if m != 2:
                        score[m] += _SILENT_COST
                else:
                    score[m] += max(_step(m, y[k], x[k], p, whites, mean, cov), floor)
            top = score[0]
            for m in range(1, models):
                top = max(top, score[m])
            for m in range(models):
                score[m] -= top
        total = 0.0
        for m in range(models):
            w = np.exp(score[m])
            filtered[k, row[m]] += w
            total += w
        for i in range(filtered.shape[1]):
            filtered[k, i] /= total


@njit(cache=True)
def _trace(back, last):  # type: ignore[no-untyped-def]
    """Follow back-pointers from the last model; also marks samples at which a model was entered."""
    n = back.shape[0]
    path = np.empty(n, dtype=np.uint8)
    entered = np.zeros(n, dtype=np.bool_)
    m = last
    for k in range(n - 1, -1, -1):
        path[k] = m
        if back[k, m] != _STAY:
            entered[k] = True
            m = back[k, m]
    return path, entered


@dataclass(frozen=True)
class ModePath:
    """Most probable rows.

    Attributes
    ----------
    model : NDArray[np.uint8], shape (n,)
        Model per sample.
    entered : NDArray[np.bool_], shape (n,)
        Samples at which a model was entered.
    filtered : NDArray[np.float64], shape (n, 5)
        Causal probability of each row (softmax of the survivors' scores).
    """

    model: NDArray[np.uint8]
    entered: NDArray[np.bool_]
    filtered: Array

    @property
    def row(self) -> NDArray[np.int64]:
        """Row of the table per sample."""
        return np.asarray(ROW_OF_MODEL[self.model])


def forward(
    y: Array, x: Array, status: NDArray[np.int8], model: ModeModel, state: ModeState
) -> tuple[NDArray[np.uint8], Array, ModeState]:
    """Run the recursion over one block.

    Parameters
    ----------
    y, x : Array, shape (n,)
        Measured value and reference.
    status : NDArray[np.int8], shape (n,)
        `SKIP` (nothing new), `PAIR` (both valid) or `SILENT` (y silent while its source lives).
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
    back = np.full((y.size, MODELS), _STAY, dtype=np.uint8)
    filtered = np.zeros((y.size, len(ROWS)))
    score, mean, cov = state.score.copy(), state.mean.copy(), state.cov.copy()
    _scan_modes(y, x, status, model.packed(), np.array(WHITE_POWERS), ROW_OF_MODEL, score, mean, cov, back, filtered)
    return back, filtered, ModeState(score, mean, cov)


def most_probable(y: Array, x: Array, status: NDArray[np.int8], model: ModeModel) -> ModePath:
    """Most probable rows of a whole channel; see `forward` for the arguments."""
    back, filtered, state = forward(y, x, status, model, initial_state(model))
    path, entered = _trace(back, int(np.argmax(state.score)))
    return ModePath(path, entered, filtered)


def segment_evidence(y: Array, x: Array, status: NDArray[np.int8], model: ModeModel) -> Array:
    """Log-evidence of each row over one segment, its filter started at the segment's first sample.

    Returns
    -------
    Array, shape (5,)
        Natural log; the best of its models for each row.
    """
    by_model = _scan_evidence(y, x, status, model.packed(), np.array(WHITE_POWERS), MODELS)
    return np.array([by_model[ROW_OF_MODEL == i].max() for i in range(len(ROWS))])


@njit(cache=True)
def _scan_evidence(y, x, status, p, whites, models):  # type: ignore[no-untyped-def]
    out = np.zeros(models)
    mean, cov = np.zeros((models, 2)), np.zeros((models, 3))
    floor = _OUTLIER - np.log(p[2])
    for m in range(models):
        _enter(m, p, mean, cov)
        for k in range(y.size):
            if status[k] == SILENT:
                if m != 2:
                    out[m] += _SILENT_COST
            elif status[k] == PAIR:
                out[m] += max(_step(m, y[k], x[k], p, whites, mean, cov), floor)
    return out
