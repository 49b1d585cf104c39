"""The compiled recursion of `wheel_filter`: entry, prediction and update of every model, and Viterbi's step.

The state of a model is z = [ν, g, b, c] with covariance P; p holds the constants in the order of
`WheelFilterModel.packed`.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from diagnosis.modes import PAIR, SILENT, SKIP

HEALTHY, S_STUCK, S_NONE, S_GAIN, S_DRIFT, S_WHITE_3, S_WHITE_8, S_WHITE_25, A_GAIN, A_STUCK, A_NONE, A_BIAS = range(12)
MODELS = 12
NAMES = (
    ("none", "healthy"),
    ("sensor", "stuck"),
    ("sensor", "no_signal"),
    ("sensor", "inefficient"),
    ("sensor", "noisy"),
    ("sensor", "noisy"),
    ("sensor", "noisy"),
    ("sensor", "noisy"),
    ("actuator", "inefficient"),
    ("actuator", "stuck"),
    ("actuator", "no_signal"),
    ("actuator", "noisy"),
)
ROW = np.array([0, 1, 2, 3, 4, 4, 4, 4, 5, 6, 7, 8])
WHITE = np.array([1.0, 3.0, 8.0, 25.0])
_OUTLIER = -18.0
_LEARNING_COST = 10.0
_OCCAM = 0.5  # what a row with an unknown gain or opening must gain on healthy per second
_SILENT_COST = -6.0


@njit(cache=True)
def enter(m, old, p, z, P):  # type: ignore[no-untyped-def]
    """Start model m from the state of model `old`: speed and load are carried over, the unknowns get their priors."""
    v, var = z[old, 0], P[old, 0, 0]
    load, load_var = z[old, 2], P[old, 2, 2]
    if old == S_GAIN:
        g = max(z[old, 1], 0.05)
        v, var = v / g, var / (g * g) + (v / g) ** 2 * P[old, 1, 1] / (g * g)
        load, load_var = load / g, load_var / (g * g)
    elif old in (S_STUCK, S_NONE):
        var += (0.1 * p[6]) ** 2  # the model alone has carried the speed
    elif old in (A_STUCK, A_BIAS):
        load, load_var = 0.0, p[4] ** 2
    load_var = min(load_var, p[4] ** 2)
    for i in range(4):
        z[m, i] = 0.0
        for j in range(4):
            P[m, i, j] = 0.0
    z[m, 0], P[m, 0, 0] = v, var
    z[m, 1] = 1.0
    z[m, 2], P[m, 2, 2] = load, load_var
    if m == S_STUCK:
        P[m, 3, 3] = p[6] ** 2
    elif m >= S_DRIFT and m <= S_WHITE_25:
        P[m, 3, 3] = (0.3 * p[6]) ** 2
    elif m == S_GAIN:
        z[m, 0], z[m, 1], z[m, 2] = 0.5 * v, 0.5, 0.5 * load
        P[m, 0, 0], P[m, 1, 1] = 0.09 * v * v + 0.34 * var, 0.09
        P[m, 0, 1] = P[m, 1, 0] = 0.09 * v
        P[m, 2, 2] = 0.34 * load_var
    elif m == A_GAIN:
        z[m, 1], P[m, 1, 1] = 0.5, 0.09
    elif m == A_NONE:
        z[m, 1] = 0.0
    elif m == A_STUCK:
        z[m, 1], z[m, 2], P[m, 2, 2] = 0.0, 0.0, p[7] ** 2
    elif m == A_BIAS:
        z[m, 1], P[m, 1, 1] = 0.6, 0.09
        z[m, 2], P[m, 2, 2] = 0.0, (0.5 * p[7]) ** 2


@njit(cache=True)
def predict(m, u, common, p, z, P):  # type: ignore[no-untyped-def]
    """z = F z, P = F P Fᵀ + Q of one model over one step with valve command u and common load."""
    a, dt = p[1], p[9]
    f_b, q_b = p[5], (1 - p[5] * p[5]) * p[4] ** 2
    if m == A_STUCK:
        f_b, q_b = 1.0, (0.02 * p[7]) ** 2 * dt
    elif m == A_BIAS:
        f_b = np.exp(-dt / 0.8)
        q_b = (1 - f_b * f_b) * (0.5 * p[7]) ** 2
    k_u = (1 - a) * p[0] * u
    if m == S_GAIN:  # ν is in the sensor's scale, and so is the shared load
        k_u += (1 - a) * common
        common = 0.0
    # row of ν: [a, (1−a)K u, 1−a, 0]
    v = a * z[m, 0] + k_u * z[m, 1] + (1 - a) * (z[m, 2] + common)
    r0 = np.empty(4)
    for j in range(4):
        r0[j] = a * P[m, 0, j] + k_u * P[m, 1, j] + (1 - a) * P[m, 2, j]
    p00 = a * r0[0] + k_u * r0[1] + (1 - a) * r0[2] + p[2] ** 2 * dt * 0.05
    z[m, 0] = v
    z[m, 2] *= f_b
    P[m, 0, 0] = p00
    P[m, 0, 1] = P[m, 1, 0] = r0[1]
    P[m, 0, 2] = P[m, 2, 0] = f_b * r0[2]
    P[m, 0, 3] = P[m, 3, 0] = r0[3]
    P[m, 1, 2] = P[m, 2, 1] = f_b * P[m, 1, 2]
    P[m, 2, 2] = f_b * f_b * P[m, 2, 2] + q_b
    P[m, 2, 3] = P[m, 3, 2] = f_b * P[m, 2, 3]
    if m >= S_DRIFT and m <= S_WHITE_25:
        P[m, 3, 3] += (0.06 * p[6]) ** 2 * dt


@njit(cache=True)
def update(m, y, p, white, z, P):  # type: ignore[no-untyped-def]
    """Kalman update of one model with the measured speed; returns the innovation's log-likelihood."""
    h0, h3, r = 1.0, 0.0, p[2] ** 2
    if m == S_STUCK:
        h0, h3, r = 0.0, 1.0, p[3] ** 2
    elif m == S_NONE:
        h0, r = 0.0, p[3] ** 2
    elif m >= S_DRIFT and m <= S_WHITE_25:
        h3, r = 1.0, r * white[m - S_DRIFT] ** 2
    # S = H P Hᵀ + R, K = P Hᵀ / S, P = P − K S Kᵀ
    g = np.empty(4)
    for i in range(4):
        g[i] = P[m, i, 0] * h0 + P[m, i, 3] * h3
    s = h0 * g[0] + h3 * g[3] + r
    innovation = y - h0 * z[m, 0] - h3 * z[m, 3]
    for i in range(4):
        z[m, i] += g[i] * innovation / s
        for j in range(4):
            P[m, i, j] -= g[i] * g[j] / s
    return -0.5 * (innovation * innovation / s + np.log(2 * np.pi * s))


@njit(cache=True)
def advance(y, u, common, slack, status, quiet, p, white, z, P, gain):  # type: ignore[no-untyped-def]
    """One step of all models; writes each one's log-likelihood into `gain`."""
    floor = _OUTLIER - np.log(p[6])
    for m in range(MODELS):
        if slack > 0.0 and m != A_STUCK and m != A_BIAS:
            # while the wheel model is in doubt, the load is as wide as the doubt and changes within half a second
            f = np.exp(-p[9] / 0.5)
            z[m, 2] *= f
            for j in range(4):
                P[m, 2, j] *= f
                P[m, j, 2] *= f
            P[m, 2, 2] += (1 - f * f) * (slack * slack + p[4] * p[4])
        predict(m, u, common, p, z, P)
        gain[m] = 0.0
        if status == SILENT:
            gain[m] = 0.0 if m == S_NONE else _SILENT_COST
        elif status == PAIR:
            gain[m] = max(update(m, y, p, white, z, P), floor)
            if m >= S_DRIFT and m <= S_WHITE_25:
                gain[m] -= 0.05
            elif m >= S_GAIN:
                gain[m] -= _OCCAM * p[9]
    if quiet and status == PAIR:
        if abs(z[S_STUCK, 3]) < 3 * p[2]:
            gain[S_STUCK] = min(gain[S_STUCK], gain[HEALTHY])
        gain[S_NONE] = min(gain[S_NONE], gain[HEALTHY])


@njit(cache=True)
def scan(y, u, common, slack, status, quiet, p, white, score, z, P, back, track):  # type: ignore[no-untyped-def]
    """Viterbi over the models; writes back-pointers (n, models) and the series of `WheelPath.track`."""
    gain = np.zeros(MODELS)
    for k in range(y.size):
        best = 0
        for m in range(1, MODELS):
            if score[m] > score[best]:
                best = m
        top = score[best]
        if status[k] != SKIP:
            for m in range(MODELS):
                if m == best:
                    continue
                cost = p[8]
                if m >= S_DRIFT and m <= S_WHITE_25 and best >= S_DRIFT and best <= S_WHITE_25:
                    cost = 3.0
                if m not in (HEALTHY, S_NONE, A_NONE):
                    cost += _LEARNING_COST
                if top - cost > score[m]:
                    score[m] = top - cost
                    if m not in (HEALTHY, S_NONE, A_NONE):
                        score[m] += _LEARNING_COST
                    back[k, m] = best
                    enter(m, best, p, z, P)
        advance(y[k], u[k], common[k], slack[k], status[k], quiet[k], p, white, z, P, gain)
        top = -1e300
        for m in range(MODELS):
            score[m] += gain[m]
            top = max(top, score[m])
        best = 0
        for m in range(MODELS):
            score[m] -= top
            if score[m] > score[best]:
                best = m
        track[0, k] = z[HEALTHY, 0]
        track[1, k] = P[HEALTHY, 0, 0]
        track[2, k] = z[best, 1]
        track[3, k] = P[best, 1, 1]
        track[4, k] = z[best, 2] if best >= A_GAIN else z[best, 3]
        track[5, k] = P[best, 2, 2] if best >= A_GAIN else P[best, 3, 3]


@njit(cache=True)
def scan_evidence(y, u, common, slack, status, quiet, begin, p, white, z, P):  # type: ignore[no-untyped-def]
    """Run healthy up to `begin`, enter every model there, and sum their log-likelihoods to the end."""
    gain, out = np.zeros(MODELS), np.zeros(MODELS)
    for k in range(y.size):
        if k == begin:
            for m in range(1, MODELS):
                enter(m, HEALTHY, p, z, P)
        advance(y[k], u[k], common[k], slack[k], status[k], quiet[k], p, white, z, P, gain)
        if k >= begin:
            out += gain
    return out, z, P
