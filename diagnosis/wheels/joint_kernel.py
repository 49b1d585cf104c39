"""Compiled forward recursion of all wheels together: Viterbi over each one's models, coupled by pump and body.

The pump's share of a demand depends on what the other valves take, and the load on a wheel on the speed of the body:
both are read off the other wheels' most probable models of the block before, so that no fault is explained by another
wheel's healthy valve, nor the reverse.
"""

from __future__ import annotations

# ruff: noqa: SIM109 (compiled: a tuple of constants costs a search)
import numpy as np
from numba import njit

from diagnosis.estimation.fault_models import PAIR, SILENT, SKIP, STAY
from diagnosis.wheels.step_kernel import (
    A_BIAS,
    A_GAIN,
    A_NONE,
    A_STUCK,
    HEALTHY,
    MODELS,
    S_GAIN,
    S_NONE,
    S_OU_LARGE,
    S_STUCK,
    S_WHITE_3,
    WheelInput,
    correct,
    enter,
    is_scaled,
    predict,
)
from replay.arrays.numeric import uncounted

_RECOVERY = 14.0  # minus the log-probability that a fault ends in one block
_LEARNING = 6.0  # by which a model with unknowns must beat the entry's cost
_OCCAM = 0.5  # what a row with unknowns must gain on healthy per second
_WORST = 30.0  # by which a block can speak against a model at most
_SILENT = -6.0
_REVERSED = 1.0  # what a block costs a gain below zero
_NO_LOSS = 0.9  # a gain above this is none


@njit(cache=True, error_model="numpy")
def advance(m_on, q, status, quiet, k, z, P, gain):  # type: ignore[no-untyped-def]
    """One block of all models of one wheel; writes each one's log-likelihood into `gain`."""
    top = -1e300
    for m in range(m_on):
        share = predict(m, q, k, z, P)
        gain[m] = 0.0
        if status == SILENT:
            gain[m] = 0.0 if m == S_NONE else _SILENT
        elif status == PAIR:
            gain[m] = correct(m, q, share, k, z, P)
        top = max(top, gain[m])
    if status != PAIR:
        return
    for m in range(m_on):
        gain[m] = max(gain[m], top - _WORST)
        if m >= S_GAIN and m != A_NONE:
            gain[m] -= _OCCAM * k.dt
    if quiet:
        if abs(z[S_STUCK, 3]) < 3.0 * k.noise:
            gain[S_STUCK] = min(gain[S_STUCK], gain[HEALTHY])
        gain[S_NONE] = min(gain[S_NONE], gain[HEALTHY])
        gain[S_GAIN] = min(gain[S_GAIN], gain[HEALTHY])
        for m in range(A_GAIN, m_on):
            if m != A_STUCK:
                gain[m] = min(gain[m], gain[HEALTHY])
    for m in (S_GAIN, A_GAIN):
        if m < m_on and z[m, 1] > _NO_LOSS:
            gain[m] = min(gain[m], gain[HEALTHY] - k.dt)
        elif m < m_on and z[m, 1] < 0.0:
            gain[m] -= _REVERSED


@njit(cache=True, error_model="numpy")
def taken(m, gain_m, bias, K, x):  # type: ignore[no-untyped-def]
    """Speed for which a valve in model m takes flow, at commanded opening x [m/s]."""
    if m == A_STUCK:
        return abs(bias)
    if m == A_NONE:
        return 0.0
    if m == A_BIAS:
        return abs(gain_m * K * x + bias)
    if m == A_GAIN:
        return abs(gain_m * K * x)
    return abs(K * x)


@njit(cache=True, error_model="numpy")
def weights(width, lag):  # type: ignore[no-untyped-def]
    """Weights with which an opening at place q of a block drives the mean speed of its own and of the next block."""
    here, after = np.zeros(width), np.zeros(width)
    a = np.exp(-lag / width)
    c = (1.0 - a) / (1.0 - np.exp(-lag)) / width
    for q in range(width):
        for n in range(q + 1, width):
            here[q] += c * a ** (n - 1 - q)
        for n in range(width, q + width + 1):
            after[q] += c * a ** (n - 1 - q)
    return here, after


@njit(cache=True, error_model="numpy")
def forward(  # type: ignore[no-untyped-def]
    u,
    y,
    count,
    jitter,
    chatter,
    wander,
    ratio,
    turn,
    status,
    quiet,
    known,
    given,
    m_on,
    flow,
    cost,
    constants,
    score,
    z,
    P,
    spill,
    back,
    best,
    fault,
    inputs,
):
    """Run all wheels over the blocks; see `wheel_filter.forward` for the arguments."""
    blocks, wheels = y.shape
    z, P = uncounted(z), uncounted(P)
    width = u.shape[0] // blocks
    gain = np.zeros(MODELS)
    took, roll, trust = np.zeros(wheels), np.zeros(wheels), np.zeros(wheels)
    now, here, after = np.zeros((wheels, 5)), np.zeros((wheels, width)), np.zeros((wheels, width))
    top, seen = np.zeros(wheels, dtype=np.int64), np.zeros(wheels, dtype=np.int64)
    for i in range(wheels):
        here[i], after[i] = weights(width, constants[i].lag)
    for n in range(blocks):
        for i in range(wheels):
            m = int(np.argmax(score[i, : m_on[i]]))
            top[i] = m
            if given[n, i] != STAY:
                m = int(given[n, i])
            seen[i] = m
            v = z[i, m, 0] / max(z[i, m, 1], 0.1) if is_scaled(m) else z[i, m, 0]
            k = constants[i]
            if k.grip_most > 0.0:  # a driven wheel that the body holds back runs a little off it
                v += min(max((v - spill[i, 3]) / k.grip, -0.5 * k.grip_most), 0.5 * k.grip_most)
            roll[i] = (v + turn[n, i]) / ratio[n, i]
            trust[i] = 1.0
            if m >= A_GAIN:
                trust[i] = 0.7
            elif m == S_GAIN:
                trust[i] = 0.4
            elif m != HEALTHY:
                trust[i] = 0.15
            if not known[i] or roll[i] != roll[i]:
                trust[i], roll[i] = 0.0, 0.0
            now[i, :3] = spill[i, :3]
            now[i, 3:] = 0.0
            spill[i, :3] = 0.0
        for q in range(width):
            total = 0.0
            for j in range(wheels):
                took[j] = (
                    taken(seen[j], z[j, seen[j], 1], z[j, seen[j], 3], constants[j].K, u[n * width + q, j])
                    if known[j]
                    else 0.0
                )
                total += took[j]
            for i in range(wheels):
                if not known[i]:
                    continue
                x, others = u[n * width + q, i], total - took[i]
                own = constants[i].K * abs(x)
                full, half, idle, some = x, x, 1.0, 1.0
                if others + max(own, 0.15 * constants[i].K) > flow:  # the pump cannot feed all
                    full *= min(1.0, flow / max(others + own, 1e-9))
                    half *= min(1.0, flow / max(others + 0.5 * own, 1e-9))
                    idle = min(1.0, flow / max(others, 1e-9))
                    some = min(1.0, flow / max(others + 0.15 * constants[i].K, 1e-9))
                now[i, 0] += here[i, q] * full
                now[i, 1] += here[i, q] * half
                now[i, 2] += here[i, q] * x * idle
                now[i, 3] += idle / width
                now[i, 4] += some / width
                spill[i, 0] += after[i, q] * full
                spill[i, 1] += after[i, q] * half
                spill[i, 2] += after[i, q] * x * idle
        for i in range(wheels):
            if not known[i]:
                continue
            k = constants[i]
            body, doubt = np.nan, 0.0
            total = trust.sum() - trust[i]
            if total > 0.0:  # weighted median of the other wheels
                least = 1e300
                for j in range(wheels):
                    if j == i or trust[j] == 0.0:
                        continue
                    far = 0.0
                    for h in range(wheels):
                        if h != i:
                            far += trust[h] * abs(roll[h] - roll[j])
                    if far < least:
                        least, body = far, roll[j] * ratio[n, i] - turn[n, i]
                doubt = least / total
            m = seen[i]
            takes = now[i, 0]
            if m == A_GAIN or m == A_BIAS:
                takes *= z[i, m, 1]
            elif m == A_STUCK or m == A_NONE:
                takes = 0.0
            asked = k.K * takes + (z[i, m, 3] * now[i, 4] if m == A_STUCK or m == A_BIAS else 0.0)
            a = np.exp(-k.lag)
            spill[i, 3] = a * spill[i, 3] + (1.0 - a) * asked
            block = WheelInput(
                y[n, i], count[n, i], jitter[n, i], now[i, 0], now[i, 1], now[i, 2], now[i, 3], now[i, 4],
                chatter[n, i], wander[n, i], body, doubt,
            )  # fmt: skip
            for c in range(5):
                inputs[n, i, c] = now[i, c]
            inputs[n, i, 5], inputs[n, i, 6] = body, doubt
            if status[n, i] != SKIP:
                for m in range(m_on[i]):
                    if m == top[i]:
                        continue
                    price = cost if m != HEALTHY else _RECOVERY
                    if m >= S_WHITE_3 and m <= S_OU_LARGE and top[i] >= S_WHITE_3 and top[i] <= S_OU_LARGE:
                        price = 4.0
                    learning = 0.0 if m == HEALTHY or m == S_NONE or m == A_NONE else _LEARNING
                    if score[i, top[i]] - price - learning > score[i, m]:
                        score[i, m] = score[i, top[i]] - price
                        back[n, i, m] = top[i]
                        enter(m, top[i], k, z[i], P[i])
            advance(m_on[i], block, status[n, i], quiet[n, i], k, z[i], P[i], gain)
            most = -1e300
            for m in range(m_on[i]):
                score[i, m] += gain[m]
                most = max(most, score[i, m])
            total_p, lead = 0.0, 0
            for m in range(m_on[i]):
                score[i, m] -= most
                if score[i, m] > score[i, lead]:
                    lead = m
                total_p += np.exp(max(score[i, m], -600.0))
            best[n, i] = lead
            fault[n, i] = 1.0 - np.exp(max(score[i, HEALTHY], -600.0)) / total_p
            inputs[n, i, 7] = most


@njit(cache=True, error_model="numpy")
def along_runs(  # type: ignore[no-untyped-def]
    y,
    count,
    jitter,
    chatter,
    wander,
    inputs,
    status,
    quiet,
    m_on,
    k,
    entry,
    stop,
    model,
    first,
    var,
    z,
    P,
    evidence,
    mean,
    cov,
    expected,
    spread,
):
    """Follow one wheel's path run by run: every model is entered at the run's start, and its log-likelihoods summed.

    z (models, 4) and P (models, 4, 4) are zeros to work in. `expected` is what a healthy wheel would read: carried on by the model alone during faults.
    """
    z, P, gain = uncounted(z), uncounted(P), np.zeros(MODELS)
    z[HEALTHY, 0], z[HEALTHY, 1], P[HEALTHY, 0, 0], P[HEALTHY, 2, 2] = first, 1.0, var, 1.0
    old = HEALTHY
    for m in range(1, m_on):
        enter(m, HEALTHY, k, z, P)
    free_z, free_P = z[:1].copy(), P[:1].copy()
    fresh_z, fresh_P, hold_z, hold_P = z.copy(), P.copy(), z[0].copy(), P[0].copy()
    for r in range(model.size):
        if r > 0:
            fresh_z[:], fresh_P[:] = z, P
            hold_z[:], hold_P[:] = z[old], P[old]
            for m in range(m_on):
                enter(m, old, k, fresh_z, fresh_P)
                z[m], P[m] = fresh_z[m], fresh_P[m]
                fresh_z[old], fresh_P[old] = hold_z, hold_P
        last = entry[r + 1] if r + 1 < model.size else y.size
        for n in range(entry[r] if r > 0 else 0, last):
            q = inputs[n]
            block = WheelInput(
                y[n], count[n], jitter[n], q[0], q[1], q[2], q[3], q[4], chatter[n], wander[n], q[5], q[6]
            )
            predict(HEALTHY, block, k, free_z, free_P)
            expected[n], spread[n] = free_z[HEALTHY, 0], free_P[HEALTHY, 0, 0]
            advance(m_on, block, status[n], quiet[n], k, z, P, gain)
            if n < stop[r]:
                for m in range(m_on):
                    evidence[r, m] += gain[m]
                mean[r], cov[r] = z, P
            if model[r] == HEALTHY and n < stop[r]:  # a fault leaves the expectation alone
                free_z[0], free_P[0] = z[HEALTHY], P[HEALTHY]
        old = model[r]
