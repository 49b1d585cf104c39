"""Recursions over the states of `diagnosis.drives.models` (compiled)."""

from __future__ import annotations

import numpy as np

from diagnosis.channels.sample_status import BLIND, SILENT, SKIP
from diagnosis.drives.models import EPSILON, HALF_STEP, ROW
from diagnosis.estimation.fault_models import NO_SIGNAL, NOISY, STUCK
from replay.arrays.compiling import njit

_TAIL_SHARE, _TAIL_SIZE = 0.01, 3.0
_WITHIN_NOISY = 4.0  # cost of another bias or power within the noisy row
_SILENT_COST = -6.0
_OUTLIER = -18.0


@njit(cache=True)
def emission(m, y, x, slack, last, status, quiet, disturbance, noise):  # type: ignore[no-untyped-def]
    """Log-likelihood of one sample in state m; `last` is the sample of y before, NaN for none, `slack` how far x may be out."""
    core, late, exact, constant, span, _ = noise
    if status == SILENT:
        return 0.0 if ROW[m] == NO_SIGNAL else _SILENT_COST
    if ROW[m] == STUCK or ROW[m] == NO_SIGNAL:
        level = last if ROW[m] == STUCK else 0.0
        if quiet and abs(y) < 3 * late:
            level = np.nan  # standing still, nothing says that a constant reading is wrong
        if np.isnan(level):
            return -np.log(2 * span)
        z = (y - level) / constant
        return max(-0.5 * z * z - np.log(constant * np.sqrt(2 * np.pi)), _OUTLIER - np.log(span))
    if status == BLIND:  # only whether y changes from sample to sample says something
        step = 0.0 if np.isnan(last) else min(abs(y - last) / late, 2.0)
        return -0.5 * step * step - np.log(late * np.sqrt(2 * np.pi))
    bias, added = disturbance
    width = slack * slack + (HALF_STEP[m] * x) ** 2 / 3 + (added[m] * added[m] * (1 + 1 / 12) if added[m] > 0 else 0.0)
    d = y - (1 - EPSILON[m]) * x - bias[m]
    out = 1e-300
    s = np.sqrt(core * core + width)
    out += exact * np.exp(-0.5 * (d / s) ** 2) / s
    s = np.sqrt(late * late + width)
    out += (1 - exact - _TAIL_SHARE) * np.exp(-0.5 * (d / s) ** 2) / s
    s = _TAIL_SIZE * s
    out += _TAIL_SHARE * np.exp(-0.5 * (d / s) ** 2) / s
    return np.log(out) - 0.5 * np.log(2 * np.pi)


@njit(cache=True)
def scan_rows(samples, last, disturbance, noise, score, back, lead):  # type: ignore[no-untyped-def]
    """Viterbi over the states; `back` holds where a state was entered from, `STAY` where it went on; `lead` fault − healthy."""
    y, x, slack, status, quiet = samples
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
            if ROW[m] == NOISY and (noisy < 0 or score[m] > score[noisy]):
                noisy = m
        top, drift = score[best] - noise.switch_cost, score[noisy] - _WITHIN_NOISY
        for m in range(states):
            if top > score[m] and best != m:
                score[m] = top
                back[k, m] = best
            if ROW[m] == NOISY and drift > score[m] and noisy != m:
                score[m] = drift
                back[k, m] = noisy
            score[m] += emission(m, y[k], x[k], slack[k], last[k], status[k], quiet[k], disturbance, noise)
        fault = score[1]
        for m in range(2, states):
            fault = max(fault, score[m])
        lead[k] = fault - score[0]
        peak = max(fault, score[0])
        for m in range(states):
            score[m] -= peak


@njit(cache=True)
def sum_states(samples, last, disturbance, noise, out):  # type: ignore[no-untyped-def]
    """Add up the log-likelihoods of all samples in each state."""
    y, x, slack, status, quiet = samples
    for k in range(y.size):
        if status[k] != SKIP:
            for m in range(out.size):
                out[m] += emission(m, y[k], x[k], slack[k], last[k], status[k], quiet[k], disturbance, noise)
