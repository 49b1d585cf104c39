"""Rows of the fault table as Kalman models of one channel; `diagnosis.mode_path` finds which of them holds when.

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

SKIP, PAIR, SILENT, BLIND = 0, 1, 2, 3
STAY = 255
_OUTLIER = -18.0
_SILENT_COST = -6.0
_MISMATCH_S = 0.05


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
    """

    noise: float
    constant_noise: float
    tolerance: float
    span: float
    switch_cost: float
    dt: float

    def packed(self) -> Array:
        """Parameters in the order of the compiled scan.

        The last one is what a drifting row must gain per sample to be preferred: as much as the mismatch model of
        healthy loses by its freedom, and a little more. Without it a fault row would follow any small mismatch.
        """
        f2 = np.exp(-2 * self.dt / _MISMATCH_S)
        p, r, q = self.tolerance**2, self.noise**2, (1 - f2) * self.tolerance**2
        for _ in range(200):  # Riccati recursion to its steady state
            p = f2 * p + q
            p = p * r / (p + r)
        occam = 0.5 * np.log(1 + (f2 * p + q) / r) + 0.02
        return np.array(
            [self.noise, self.constant_noise, self.span, self.dt, self.switch_cost, self.tolerance, float(occam)]
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
        mean[m, 0], cov[m, 2] = 1.0, p[5] ** 2
    elif m == 1:
        cov[m, 0] = span * span
    elif m == 3:
        mean[m, 0], cov[m, 0] = 0.5, 0.09
    elif m >= _FIRST_NOISY:
        mean[m, 0], cov[m, 0] = 0.6, 0.09
        cov[m, 2] = (0.3 * span) ** 2


@njit(cache=True)
def _step(m, y, x, p, noisy, mean, cov):  # type: ignore[no-untyped-def]
    """Kalman update of one model with y = H·[·,·] + n; returns the innovation's log-likelihood."""
    r = p[0] * p[0]
    h0, h1 = x, 0.0
    if m == _MISMATCH:
        h1 = 1.0
        f = np.exp(-p[3] / _MISMATCH_S)
        mean[m, 1] *= f
        cov[m, 2] = f * f * cov[m, 2] + (1 - f * f) * p[5] ** 2
    elif m == 1:
        h0, r = 1.0, p[1] * p[1]
    elif m == 2:
        h0, r = 0.0, p[1] * p[1]
    elif m >= _FIRST_NOISY:
        h1 = 1.0
        cov[m, 2] += (noisy[m - _FIRST_NOISY, 0] * p[2]) ** 2 * p[3]
        r *= noisy[m - _FIRST_NOISY, 1] ** 2
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
def likelihoods(y, x, status, quiet, p, noisy, mean, cov, out):  # type: ignore[no-untyped-def]
    """Log-likelihood of one sample under every model; where nothing moves, a zero reading speaks for no fault."""
    floor = _OUTLIER - np.log(p[2])
    for m in range(out.size):
        if status == SILENT:
            out[m] = 0.0 if m == 2 else _SILENT_COST
        elif status == BLIND:
            # x jumps about between samples: only a y that does not join in says something, at most one bit a sample
            out[m] = 0.0
            if m in (1, 2):
                level = mean[1, 0] if m == 1 and cov[1, 0] < p[2] ** 2 / 2 else (y if m == 1 else 0.0)
                if abs(y - level) > 3.5 * p[1]:
                    out[m] = -4.0
                elif abs(x - level) > 5 * p[0]:
                    out[m] = 0.69
                _step(m, y, x, p, noisy, mean, cov)
        else:
            out[m] = max(_step(m, y, x, p, noisy, mean, cov), floor)
            if m >= _FIRST_NOISY:
                out[m] -= p[6]
            elif m == 3:
                out[m] -= 0.02
    if quiet and status == PAIR:
        if abs(mean[1, 0]) < 3 * p[0]:
            out[1] = min(out[1], out[0])
        out[2] = min(out[2], out[0])


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
    by_model = _scan_evidence(y, x, status, quiet, model.packed(), NOISY_MODELS, MODELS)
    return np.array([by_model[i == ROW_OF_MODEL].max() for i in range(len(ROWS))])


@njit(cache=True)
def _scan_evidence(y, x, status, quiet, p, noisy, models):  # type: ignore[no-untyped-def]
    out, gain = np.zeros(models), np.zeros(models)
    mean, cov = np.zeros((models, 2)), np.zeros((models, 3))
    for m in range(models):
        enter(m, p, mean, cov)
    for k in range(y.size):
        if status[k] != SKIP:
            likelihoods(y[k], x[k], status[k], quiet[k], p, noisy, mean, cov, gain)
            out += gain
    return out
