"""The compiled recursions over the steering models: Viterbi's, and those along a given path."""

from __future__ import annotations

import numpy as np
from numba import njit

from diagnosis.estimation.fault_models import SKIP
from diagnosis.steering.model_bank import ACTUATOR, MODELS, NOISY, NONE, SENSOR, STATES, STUCK
from diagnosis.steering.step_kernel import advance, enter
from replay.arrays.numeric import uncounted

_LEARNING_COST = 8.0


@njit(cache=True, error_model="numpy")
def switch_cost(m, old, cost, second):  # type: ignore[no-untyped-def]
    """Minus the log-probability of going from model `old` to m within one block."""
    s, s0 = SENSOR[m], SENSOR[old]
    out = 0.0
    if s != s0:
        out += 3.0 if s >= NOISY and s0 >= NOISY else cost
    if ACTUATOR[m] != ACTUATOR[old]:
        out += 0.0 if s in (STUCK, NONE) and second == 0 else cost
    return out


@njit(cache=True, error_model="numpy")
def scan(y, power, count, driven, u, status, second, allowed, p, score, z, P, ig, row, back):  # type: ignore[no-untyped-def]
    """Viterbi over the models; writes back-pointers (n, models); `row` (3, states) is room to work in."""
    second, p, z, P, ig, row = (
        uncounted(second),
        uncounted(p),
        uncounted(z),
        uncounted(P),
        uncounted(ig),
        uncounted(row),
    )
    for k in range(y.size):
        best = 0
        for m in range(1, MODELS):
            if score[m] > score[best]:
                best = m
        top = score[best]
        if status[k] != SKIP:
            for m in range(MODELS):
                if m == best or not allowed[m]:
                    continue
                cost = switch_cost(m, best, p[15], p[20])
                learning = 0.0 if m == 0 or m == 2 else _LEARNING_COST
                if top - cost - learning > score[m]:
                    score[m] = top - cost
                    back[k, m] = best
                    enter(m, best, p, z, P, ig)
        top = -1e300
        for m in range(MODELS):
            if allowed[m]:
                score[m] += advance(
                    m, y[k], power[k], count[k], driven[k], u[k], status[k], second[k], p, z, P, ig, row
                )
                top = max(top, score[m])
        for m in range(MODELS):
            score[m] -= top


@njit(cache=True, error_model="numpy")
def follow(y, power, count, driven, u, status, second, path, p, z, P, ig, row, Z, C, G):  # type: ignore[no-untyped-def]
    """Run only the model that `path` names in each block; writes its mean, covariance and noise after each block.

    z, P and `ig` hold the first model as `started` gives it; `row` (3, states) is room to work in.
    """
    second, p, z, P, ig, row = (
        uncounted(second),
        uncounted(p),
        uncounted(z),
        uncounted(P),
        uncounted(ig),
        uncounted(row),
    )
    for k in range(y.size):
        m = path[k]
        if k > 0 and m != path[k - 1]:
            enter(m, path[k - 1], p, z, P, ig)
        advance(m, y[k], power[k], count[k], driven[k], u[k], status[k], second[k], p, z, P, ig, row)
        Z[k], C[k], G[k] = z[m], P[m], ig[m]


@njit(cache=True, error_model="numpy")
def started(m, first, p):  # type: ignore[no-untyped-def]
    """States in which model m has just begun at the measured angle `first`."""
    z, P, ig = np.zeros((MODELS, STATES)), np.zeros((MODELS, STATES, STATES)), np.ones((MODELS, 2))
    z[m, 0] = min(max(first, -p[4]), p[4])
    P[m, 0, 0], P[m, 1, 1] = p[4] ** 2, (0.2 * p[3]) ** 2
    enter(m, m, p, z, P, ig)
    return z, P, ig


@njit(cache=True, error_model="numpy")
def path_evidence(y, power, count, driven, u, status, second, path, a, b, known, p, Z, C, G):  # type: ignore[no-untyped-def]
    """Log-evidence of blocks a…b of a path, less the price of its switches, and [φ, r, a, b, d, c] at the end.

    The states before block a are those of `follow` on the path `known`.
    """
    if a > 0:
        z, P, ig = np.zeros((MODELS, STATES)), np.zeros((MODELS, STATES, STATES)), np.ones((MODELS, 2))
        before = known[a - 1]
        z[before], P[before], ig[before] = Z[a - 1], C[a - 1], G[a - 1]
    else:
        before = path[0]
        z, P, ig = started(before, y[0], p)
    row = np.zeros((3, STATES))
    total = 0.0
    for k in range(a, b):
        m = path[k]
        if m != before:
            enter(m, before, p, z, P, ig)
            total -= switch_cost(m, before, p[15], p[20])
            before = m
        total += advance(m, y[k], power[k], count[k], driven[k], u[k], status[k], second[k], p, z, P, ig, row)
    return total, z[before].copy()
