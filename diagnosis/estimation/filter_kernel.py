"""Kalman filters of the fault rows of one channel, sample by sample (compiled).

A filter per model starts when the model is entered and carries its unknowns [δ or c, δ̄]. Between two samples of y
nothing is updated; a y that is silent while its source lives speaks for no_signal.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.sample_status import BLIND, SILENT, SKIP
from diagnosis.estimation.fault_models import (
    CONSTANT,
    EXACT,
    FIRST_NOISY,
    GAIN,
    HEALTHY,
    MISMATCH,
    MODELS,
    NOISY,
    NOISY_MODELS,
    ROW_OF_MODEL,
    ZERO,
    ModeModel,
)
from diagnosis.estimation.samples import Samples
from diagnosis.results.fault_rows import ROWS
from replay.arrays.compiling import njit

Array = NDArray[np.float64]

_SILENT_COST = -6.0
_BEYOND, _LARGE = 0.2, 4.0  # cost of a mismatch per squared deviation beyond so many
_FAULT_COST = 0.02  # what a faulty row must gain per sample to be preferred


class FilterState(NamedTuple):
    """What the recursions carry from sample to sample and from block to block; written in place by them.

    Attributes
    ----------
    score : Array, shape (models,)
        Log-probability of the best path to each model, or its log-evidence.
    mean : Array, shape (models, 2)
        Mean of the unknowns [δ or c, δ̄]; beside a stuck channel's c what x was of late.
    cov : Array, shape (models, 3)
        Their covariance (P11, P12, P22).
    """

    score: Array
    mean: Array
    cov: Array

    def copied(self) -> FilterState:
        """The same in arrays of its own."""
        return FilterState(*(column.copy() for column in self))


def entered_state(model: ModeModel) -> FilterState:
    """Every model of the channel's table entered at the first sample, none more probable than another."""
    state = FilterState(np.zeros(MODELS), np.zeros((MODELS, 2)), np.zeros((MODELS, 3)))
    bank = model.bank()
    for m in range(MODELS):
        enter(m, bank, state.mean, state.cov)
    state.score[~bank.admitted] = -np.inf
    return state


@njit(cache=True)
def enter(m, bank, mean, cov):  # type: ignore[no-untyped-def]
    """Prior of a model's unknowns [δ or c, δ̄] at entry; cov = (P11, P12, P22)."""
    span = bank.span
    mean[m, 0], mean[m, 1] = 0.0, 0.0
    cov[m, 0], cov[m, 1], cov[m, 2] = 0.0, 0.0, 0.0
    if m == EXACT:
        mean[m, 0] = 1.0
    elif m == MISMATCH:
        mean[m, 0], cov[m, 2] = 1.0, bank.mismatch_r
    elif m == CONSTANT:
        cov[m, 0] = span * span
    elif m == GAIN:
        mean[m, 0], cov[m, 0] = 0.5, 0.09
    elif m >= FIRST_NOISY:
        mean[m, 0], cov[m, 0] = 0.6, 0.09
        cov[m, 2] = (0.3 * span) ** 2


@njit(cache=True, no_cpython_wrapper=True)
def _beyond(b, power, passing):  # type: ignore[no-untyped-def]
    """What a sample costs a mismatch that is larger than two instruments have; the usual one is held small by its walk."""
    return _BEYOND * max(b * b / (power * passing) - _LARGE, 0.0) if passing > 1.0 else 0.0


@njit(cache=True, no_cpython_wrapper=True)
def _update(y, x, white, passing, constant, bank, mean, cov, out):  # type: ignore[no-untyped-def]
    """Kalman update of every model with y = H·[·,·] + n; writes the innovations' log-likelihoods."""
    own = bank.r * white
    e = y - x
    out[EXACT] = -0.5 * (e * e / own + (bank.log_r if white == 1.0 else np.log(2 * np.pi * own)))
    out[ZERO] = -0.5 * (y * y / bank.constant_r + bank.log_constant_r)
    # one unknown: H = 1, P = (I − K H) P
    m, r = CONSTANT, bank.constant_r * constant
    s = cov[m, 0] + r
    i = 1.0 / s
    e = y - mean[m, 0]
    mean[m, 0] += cov[m, 0] * i * e
    cov[m, 0] *= r * i
    out[m] = -0.5 * (e * e * i + np.log(2 * np.pi * s))
    # gain, and what of the passing mismatch comes to the usual one
    m, f, r = GAIN, bank.decay, own
    if bank.r > 4.0 * bank.constant_r:  # a sensor's noise comes before its gain, that of a valve's feedback after it
        r *= max(1.0, mean[m, 0] ** 2)
    mean[m, 1] *= f
    a, b = cov[m, 0], f * cov[m, 1]
    c = f * f * cov[m, 2] + (1 - f * f) * bank.mismatch_r * (passing - 1.0)
    g0, g1 = a * x + b, b * x + c
    s = x * g0 + g1 + r
    i = 1.0 / s
    e = y - x * mean[m, 0] - mean[m, 1]
    mean[m, 0] += g0 * i * e
    mean[m, 1] += g1 * i * e
    cov[m, 0], cov[m, 1], cov[m, 2] = a - g0 * i * g0, b - g0 * i * g1, c - g1 * i * g1
    out[m] = -0.5 * (e * e * i + np.log(2 * np.pi * s)) - _beyond(mean[m, 1], bank.mismatch_r, passing)
    m = MISMATCH
    c = f * f * cov[m, 2] + (1 - f * f) * bank.mismatch_r * passing
    s = c + own
    e = y - x - f * mean[m, 1]
    mean[m, 1] = f * mean[m, 1] + c / s * e
    cov[m, 2] = c * own / s
    out[m] = -0.5 * (e * e / s + np.log(2 * np.pi * s)) - _beyond(mean[m, 1], bank.mismatch_r, passing)
    for m in range(FIRST_NOISY, out.size):
        j = m - FIRST_NOISY
        a, b = cov[m, 0], cov[m, 1]
        c = cov[m, 2] + (NOISY_MODELS[j, 0] * bank.span) ** 2 * bank.dt
        # S = H P Hᵀ + R
        g0, g1 = a * x + b, b * x + c
        s = x * g0 + g1 + own * NOISY_MODELS[j, 1] ** 2
        i = 1.0 / s
        e = y - x * mean[m, 0] - mean[m, 1]
        k0, k1 = g0 * i, g1 * i
        mean[m, 0] += k0 * e
        mean[m, 1] += k1 * e
        # P = (I − K H) P
        cov[m, 0] = a - k0 * g0
        cov[m, 1] = b - k0 * g1
        cov[m, 2] = c - k1 * g1
        out[m] = -0.5 * (e * e * i + np.log(2 * np.pi * s))


@njit(cache=True, no_cpython_wrapper=True)
def _blind(y, x, bank, mean, cov, out):  # type: ignore[no-untyped-def]
    """Log-likelihood of one sample where x jumps about: only a y that does not join in says something, one bit at most."""
    noise, constant = np.sqrt(bank.r), np.sqrt(bank.constant_r)
    level = mean[CONSTANT, 0] if cov[CONSTANT, 0] < bank.span**2 / 2 else y
    out[:] = 0.0
    for m, value in ((CONSTANT, level), (ZERO, 0.0)):
        if abs(y - value) > 3.5 * constant:
            out[m] = -4.0
        elif abs(x - value) > 5 * noise:
            out[m] = 0.69
    s = cov[CONSTANT, 0] + bank.constant_r
    mean[CONSTANT, 0] += cov[CONSTANT, 0] / s * (y - mean[CONSTANT, 0])
    cov[CONSTANT, 0] *= bank.constant_r / s


@njit(cache=True, no_cpython_wrapper=True)
def _stands_beside(y, x, white, bank, mean, out):  # type: ignore[no-untyped-def]
    """Healthy is as well who stands while a steady x jitters, rather than joining in: `mean[CONSTANT, 1]` is what x was of late."""
    late = mean[CONSTANT, 1]
    if abs(x - late) < bank.jitter and abs(y - late) < bank.jitter:
        r = bank.r * white
        out[EXACT] = max(out[EXACT], -0.5 * ((y - late) ** 2 / r + np.log(2 * np.pi * r)))


@njit(cache=True, no_cpython_wrapper=True)
def likelihoods(k, samples, bank, mean, cov, out):  # type: ignore[no-untyped-def]
    """Log-likelihood of sample k under every model; where nothing moves, a zero reading speaks for no fault."""
    y, x, status, quiet = samples.y[k], samples.x[k], samples.status[k], samples.quiet[k]
    if status == SILENT:
        out[:] = _SILENT_COST
        out[ZERO] = 0.0
        return
    if status == BLIND:
        _blind(y, x, bank, mean, cov, out)
        return
    mean[CONSTANT, 1] = x + (mean[CONSTANT, 1] - x) * bank.recent if cov[CONSTANT, 0] < bank.span**2 / 2 else x
    _update(y, x, samples.white[k], samples.passing[k], samples.constant[k], bank, mean, cov, out)
    _stands_beside(y, x, samples.white[k], bank, mean, out)
    for m in range(out.size):
        out[m] = max(out[m], bank.floor)
        if ROW_OF_MODEL[m] == NOISY:
            out[m] -= bank.drift_cost
        elif ROW_OF_MODEL[m] != HEALTHY:
            out[m] -= _FAULT_COST
    if quiet:
        # a reading of zero says as much for no signal as for none wanted
        most = max(out[EXACT], out[MISMATCH])
        zero = abs(y) < 3.5 * np.sqrt(bank.constant_r)
        if abs(mean[CONSTANT, 0]) < 3 * np.sqrt(bank.r):
            out[CONSTANT] = most if zero else min(out[CONSTANT], most)
        out[ZERO] = most if zero else min(out[ZERO], most)
        for m in range(GAIN, out.size):
            if ROW_OF_MODEL[m] != HEALTHY and abs(mean[m, 0]) < 0.1:
                out[m] = min(out[m], most)


@njit(cache=True, nogil=True)
def _scan_evidence(samples, bank, state):  # type: ignore[no-untyped-def]
    """Add up the log-likelihoods of all samples in `state.score`."""
    status = samples.status
    score, mean, cov = state
    gain = np.zeros(score.size)
    for k in range(status.size):
        if status[k] != SKIP:
            likelihoods(k, samples, bank, mean, cov, gain)
            score += gain


def segment_evidence(samples: Samples, model: ModeModel) -> Array:
    """Log-evidence of each row over one segment, its filter started at the segment's first sample.

    A row that the channel's table lacks, or that no model stands for, has −∞.

    Returns
    -------
    Array, shape (rows,)
        Natural log; the best of its models for each row.
    """
    state = entered_state(model)
    _scan_evidence(samples, model.bank(), state)
    return np.array([state.score[i == ROW_OF_MODEL].max(initial=-np.inf) for i in range(len(ROWS))])
