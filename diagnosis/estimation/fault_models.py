"""Rows of the fault table as Kalman models of one channel; `diagnosis.estimation.viterbi` finds which of them holds when.

Every row of the two tables is a model of a measured y against a reference x (v against v_true by L4, u_applied against
u_a by L8):

healthy      y = x + n, or y = x + b + n with a small passing mismatch b of the two instruments
stuck        y = c, a constant c
no_signal    y = 0
inefficient  y = δ·x + n, δ constant
noisy        y = δ·x + δ̄ + n, δ̄ drifting (random walk) or white with one of several powers

A Kalman filter per row starts when the row is entered and carries the row's unknowns [δ or c, δ̄]. Between two samples
of y nothing is updated; a y that is silent while its source lives speaks for no_signal.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]

HEALTHY, STUCK, NO_SIGNAL, INEFFICIENT, NOISY = range(5)
ROWS = ("healthy", "stuck", "no_signal", "inefficient", "noisy")
# models of the last row: random walk of δ̄ [span/√s] and white noise [healthy noise]
NOISY_MODELS = np.array([[0.3, 1.0], [0.06, 1.0], [0.012, 1.0], [0.06, 3.0], [0.06, 8.0], [0.06, 25.0], [0.06, 80.0]])
ROW_OF_MODEL = np.array([HEALTHY, STUCK, NO_SIGNAL, INEFFICIENT, HEALTHY] + [NOISY] * len(NOISY_MODELS))
_MISMATCH, _FIRST_NOISY = 4, 5
MODELS = ROW_OF_MODEL.size

SKIP, PAIR, SILENT, BLIND, CLEAR = range(5)
STAY = 255
_OUTLIER = -18.0
_SILENT_COST = -6.0
_MISMATCH_S = 0.05  # correlation time of a passing mismatch of two healthy instruments
_FAULT_COST, DRIFT_COST = 0.02, 0.04  # what a faulty row must gain per sample to be preferred


@dataclass(frozen=True)
class ModeModel:
    """Noise and prior of one channel; all in the channel's unit.

    Attributes
    ----------
    noise : float
        Standard deviation of y − x while healthy.
    constant_noise : float
        Standard deviation of y while stuck: the rounding step of a sensor, the noise of a spool sensor.
    tolerance : float
        Standard deviation of the slow mismatch between y and x while healthy.
    span : float
        Largest plausible magnitude of y.
    switch_cost : float
        Minus the log-probability of entering a row at one sample.
    dt : float
        Step [s].
    drift_cost : float
        What the noisy row must gain per sample to be preferred.
    own_cost : float
        What the noisy row gains per sample at most by explaining x's own noise away, which says nothing about y.
    """

    noise: float
    constant_noise: float
    tolerance: float
    span: float
    switch_cost: float
    dt: float
    drift_cost: float = DRIFT_COST
    own_cost: float = 0.0

    def packed(self) -> Array:
        """Parameters in the order of the compiled scan; the first three are r, r of a constant, and span."""
        r, constant = self.noise**2, self.constant_noise**2
        log_r, log_constant = (float(np.log(2 * np.pi * v)) for v in (r, constant))
        floor = _OUTLIER - float(np.log(self.span))
        decay = float(np.exp(-self.dt / _MISMATCH_S))
        cost = self.drift_cost + self.own_cost
        return np.array(
            [
                r,
                constant,
                self.span,
                self.dt,
                self.switch_cost,
                self.tolerance**2,
                log_r,
                log_constant,
                floor,
                decay,
                cost,
            ]
        )


@njit(cache=True)
def enter(m, p, mean, cov):  # type: ignore[no-untyped-def]
    """Prior of a model's unknowns [δ or c, δ̄] at entry; cov = (P11, P12, P22)."""
    span = p[2]
    mean[m, 0], mean[m, 1] = 0.0, 0.0
    cov[m, 0], cov[m, 1], cov[m, 2] = 0.0, 0.0, 0.0
    if m == 0:
        mean[m, 0] = 1.0
    elif m == _MISMATCH:
        mean[m, 0], cov[m, 2] = 1.0, p[5]
    elif m == 1:
        cov[m, 0] = span * span
    elif m == 3:
        mean[m, 0], cov[m, 0] = 0.5, 0.09
    elif m >= _FIRST_NOISY:
        mean[m, 0], cov[m, 0] = 0.6, 0.09
        cov[m, 2] = (0.3 * span) ** 2


@njit(cache=True)
def _update(y, x, p, noisy, mean, cov, out):  # type: ignore[no-untyped-def]
    """Kalman update of every model with y = H·[·,·] + n; writes the innovations' log-likelihoods."""
    e = y - x
    out[0] = -0.5 * (e * e / p[0] + p[6])
    out[2] = -0.5 * (y * y / p[1] + p[7])
    # one unknown: H = 1 or x, P = (I − K H) P
    for m in (1, 3):
        h, r = (1.0, p[1]) if m == 1 else (x, p[0])
        if m == 3 and p[0] > 4.0 * p[1]:  # a sensor's noise comes before its gain, that of a valve's feedback after it
            r *= max(1.0, mean[m, 0] ** 2)
        s = h * h * cov[m, 0] + r
        i = 1.0 / s
        e = y - h * mean[m, 0]
        mean[m, 0] += h * cov[m, 0] * i * e
        cov[m, 0] *= r * i
        out[m] = -0.5 * (e * e * i + np.log(2 * np.pi * s))
    m, f = _MISMATCH, p[9]
    c = f * f * cov[m, 2] + (1 - f * f) * p[5]
    s = c + p[0]
    e = y - x - f * mean[m, 1]
    mean[m, 1] = f * mean[m, 1] + c / s * e
    cov[m, 2] = c * p[0] / s
    out[m] = -0.5 * (e * e / s + np.log(2 * np.pi * s))
    for m in range(_FIRST_NOISY, out.size):
        j = m - _FIRST_NOISY
        a, b = cov[m, 0], cov[m, 1]
        c = cov[m, 2] + (noisy[j, 0] * p[2]) ** 2 * p[3]
        # S = H P Hᵀ + R
        g0, g1 = a * x + b, b * x + c
        s = x * g0 + g1 + p[0] * noisy[j, 1] ** 2
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


@njit(cache=True)
def _blind(y, x, p, mean, cov, out):  # type: ignore[no-untyped-def]
    """Log-likelihood of one sample where x jumps about: only a y that does not join in says something, one bit at most."""
    noise, constant = np.sqrt(p[0]), np.sqrt(p[1])
    level = mean[1, 0] if cov[1, 0] < p[2] ** 2 / 2 else y
    out[:] = 0.0
    for m, value in ((1, level), (2, 0.0)):
        if abs(y - value) > 3.5 * constant:
            out[m] = -4.0
        elif abs(x - value) > 5 * noise:
            out[m] = 0.69
    s = cov[1, 0] + p[1]
    mean[1, 0] += cov[1, 0] / s * (y - mean[1, 0])
    cov[1, 0] *= p[1] / s


@njit(cache=True)
def likelihoods(y, x, status, quiet, p, noisy, row, mean, cov, out):  # type: ignore[no-untyped-def]
    """Log-likelihood of one sample under every model; where nothing moves, a zero reading speaks for no fault."""
    if status == SILENT:
        out[:] = _SILENT_COST
        out[2] = 0.0
        return
    if status == BLIND:
        _blind(y, x, p, mean, cov, out)
        return
    _update(y, x, p, noisy, mean, cov, out)
    for m in range(out.size):
        out[m] = max(out[m], p[8])
        if row[m] == NOISY:
            out[m] -= p[10]
        elif row[m] != HEALTHY:
            out[m] -= _FAULT_COST
    if quiet:
        # a reading of zero says as much for no signal as for none wanted
        most = max(out[0], out[_MISMATCH])
        zero = abs(y) < 3.5 * np.sqrt(p[1])
        if abs(mean[1, 0]) < 3 * np.sqrt(p[0]):
            out[1] = most if zero else min(out[1], most)
        out[2] = most if zero else min(out[2], most)
        for m in range(3, out.size):
            if row[m] != HEALTHY and abs(mean[m, 0]) < 0.1:
                out[m] = min(out[m], most)


@njit(cache=True)
def trace(back, last):  # type: ignore[no-untyped-def]
    """Follow back-pointers from the last model; also marks samples at which a model was entered."""
    n = back.shape[0]
    path = np.empty(n, dtype=np.uint8)
    entered = np.zeros(n, dtype=np.bool_)
    m = last
    for k in range(n - 1, -1, -1):
        path[k] = m
        if back[k, m] != STAY:
            entered[k] = True
            m = back[k, m]
    return path, entered


def segment_evidence(y: Array, x: Array, status: NDArray[np.int8], quiet: NDArray[np.bool_], model: ModeModel) -> Array:
    """Log-evidence of each row over one segment, its filter started at the segment's first sample.

    Returns
    -------
    Array, shape (5,)
        Natural log; the best of its models for each row.
    """
    by_model = _scan_evidence(y, x, status, quiet, model.packed(), NOISY_MODELS, ROW_OF_MODEL)
    return np.array([by_model[i == ROW_OF_MODEL].max() for i in range(len(ROWS))])


@njit(cache=True)
def _scan_evidence(y, x, status, quiet, p, noisy, row):  # type: ignore[no-untyped-def]
    models = row.size
    out, gain = np.zeros(models), np.zeros(models)
    mean, cov = np.zeros((models, 2)), np.zeros((models, 3))
    for m in range(models):
        enter(m, p, mean, cov)
    for k in range(y.size):
        if status[k] != SKIP:
            likelihoods(y[k], x[k], status[k], quiet[k], p, noisy, row, mean, cov, gain)
            out += gain
    return out
