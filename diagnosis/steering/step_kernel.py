"""One block of every steering model (compiled): entry, prediction, update.

Every model is an extended Kalman filter on x = [φ, r, a, b, d, c]: angle φ and rate r of the axle, gain a and rate b
that a valve fault adds, gain d and offset c of the sensor:

    ṙ = (sat(g·a·u + b) − r)/τ,  φ̇ = r (with end stops),  y = d·φ + c + n,  variance of n known or learned

A row of either table frees some of them. Blocks of samples come as their mean and the power of their white part, which
tells how much noise the sensor still shows. p holds the constants in the order of `SteeringModel.packed`.
"""

from __future__ import annotations

from math import lgamma, log, pi

import numpy as np
from numba import njit

from diagnosis.estimation.fault_models import PAIR, SILENT
from diagnosis.steering.model_bank import ACTIVE, ACTUATOR, DRIFT, FREE, GAIN, NOISY, NONE, OK, SENSOR, STATES, STUCK

_SILENT_COST = -6.0
_OUTLIER = -18.0
DISTURBANCE_S = 0.8  # how fast a valve's disturbance and a sensor's coloured noise change
SENSOR_DRIFT_S = 0.08
_LEAST_GAIN, _MOST_GAIN = 0.1, 0.92  # of an inefficient part


@njit(cache=True, error_model="numpy")
def enter(m, old, p, z, P, ig):  # type: ignore[no-untyped-def]
    """Start model m from model `old`: the axle is carried over, a side that changes gets its prior."""
    stop, lift, load, white = p[4], p[3], p[5], p[7]
    if m != old:
        for i in range(STATES):
            z[m, i] = z[old, i]
            for j in range(STATES):
                P[m, i, j] = P[old, i, j]
        ig[m, 0], ig[m, 1] = ig[old, 0], ig[old, 1]
    s, a = SENSOR[m], ACTUATOR[m]
    fresh_s, fresh_a = m == old or s != SENSOR[old], m == old or a != ACTUATOR[old]
    for i in range(2, STATES):
        if (i < 4 and fresh_a) or (i >= 4 and fresh_s):
            for j in range(STATES):
                P[m, i, j] = P[m, j, i] = 0.0
            z[m, i] = 0.0
    if fresh_a:
        z[m, 2] = 1.0
        P[m, 3, 3] = load * load
        if a == GAIN:
            z[m, 2], P[m, 2, 2] = 0.5, 0.0625
        elif a == STUCK:
            z[m, 2], P[m, 3, 3] = 0.0, lift * lift
        elif a == NONE:
            z[m, 2] = 0.0
        elif a == NOISY:
            z[m, 2], P[m, 2, 2], P[m, 3, 3] = 0.6, 0.0225, (0.6 * lift) ** 2
    if fresh_s:
        z[m, 4] = 1.0
        if s == STUCK:
            z[m, 4], P[m, 5, 5] = 0.0, stop * stop
        elif s == NONE:
            z[m, 4] = 0.0
        elif s == GAIN:
            z[m, 4], P[m, 4, 4] = 0.5, 0.0625
        elif s == NOISY:
            z[m, 4], P[m, 4, 4], P[m, 5, 5] = 0.65, 0.0225, (0.06 * stop) ** 2
            ig[m, 0], ig[m, 1] = 0.5, 50.0 * white
        elif s == DRIFT:
            z[m, 4], P[m, 4, 4], P[m, 5, 5] = 0.65, 0.0225, (0.1 * stop) ** 2
            ig[m, 0], ig[m, 1] = 0.5, 5.0 * white
        if m != old and SENSOR[old] != OK:
            # how the axle stood behind a faulty sensor was guessed by the model alone
            lost = SENSOR[old] == STUCK or SENSOR[old] == NONE
            P[m, 0, 0] += ((1.0 if lost else 0.2) * stop) ** 2
            P[m, 1, 1] += (0.3 * lift) ** 2


@njit(cache=True, error_model="numpy")
def predict(m, driven, u, p, z, P, row):  # type: ignore[no-untyped-def]
    """x = f(x, u), P = F P Fᵀ + Q over one block; `driven` is the mean of sat(g·u) over the block's samples."""
    dt, fade, g, lift, stop, load = p[0], p[1], p[2], p[3], p[4], p[5]
    a = ACTUATOR[m]
    by_a, by_b = 0.0, 1.0
    if a == OK:
        f = driven + z[m, 3]
    else:
        f = g * z[m, 2] * u + z[m, 3]
        by_a = g * u
        if abs(f) > lift:
            f = lift if f > 0 else -lift
            by_a = by_b = 0.0
    # r' = fade·r + (1 − fade)·f,  φ' = φ + τ(1 − fade)·r + (dt − τ(1 − fade))·f
    k_r = p[11] * (1 - fade)
    k_f = dt - k_r
    r = z[m, 1]
    z[m, 0] += k_r * r + k_f * f
    z[m, 1] = fade * r + (1 - fade) * f
    for n in range(FREE[m]):
        j = ACTIVE[m, n]
        force = by_a * P[m, 2, j] + by_b * P[m, 3, j]
        row[0, j] = P[m, 0, j] + k_r * P[m, 1, j] + k_f * force
        row[1, j] = fade * P[m, 1, j] + (1 - fade) * force
    for n in range(FREE[m]):
        j = ACTIVE[m, n]
        P[m, 0, j], P[m, 1, j] = row[0, j], row[1, j]
    for n in range(FREE[m]):
        i = ACTIVE[m, n]
        force = by_a * P[m, i, 2] + by_b * P[m, i, 3]
        p0 = P[m, i, 0] + k_r * P[m, i, 1] + k_f * force
        P[m, i, 1] = fade * P[m, i, 1] + (1 - fade) * force
        P[m, i, 0] = p0
    P[m, 0, 0] += p[12]
    if a in (OK, GAIN, NONE):
        f_b = p[6]
        # the valve's characteristic is known to a share only: the error grows with the rate
        q_b = (1 - f_b * f_b) * (load * load + p[17] * driven * driven * (a != NONE))
    elif a == STUCK:
        f_b, q_b = 1.0, (0.02 * lift) ** 2 * dt
    else:
        f_b = p[21]
        q_b = (1 - f_b * f_b) * (0.6 * lift) ** 2
    _relax(m, 3, f_b, q_b, z, P)
    if SENSOR[m] == NOISY:
        P[m, 5, 5] += (0.02 * stop) ** 2 * dt
    elif SENSOR[m] == DRIFT:
        f_c = p[22]
        _relax(m, 5, f_c, (1 - f_c * f_c) * (0.1 * stop) ** 2, z, P)
    if abs(z[m, 0]) > stop:
        # an end stop holds the axle
        z[m, 0], z[m, 1] = (stop if z[m, 0] > 0 else -stop), 0.0
        for j in range(STATES):
            P[m, 0, j] = P[m, j, 0] = P[m, 1, j] = P[m, j, 1] = 0.0
        P[m, 0, 0], P[m, 1, 1] = p[13], (0.02 * lift) ** 2


@njit(cache=True, error_model="numpy")
def _relax(m, i, f, q, z, P):  # type: ignore[no-untyped-def]
    """One step of x_i' = f·x_i + noise of variance q."""
    z[m, i] *= f
    for n in range(FREE[m]):
        P[m, i, ACTIVE[m, n]] *= f
    for n in range(FREE[m]):
        P[m, ACTIVE[m, n], i] *= f
    P[m, i, i] += q


@njit(cache=True, error_model="numpy")
def update(m, y, power, count, p, z, P, ig, gain):  # type: ignore[no-untyped-def]
    """Kalman update with a block's mean, and the evidence of mean and white power; returns the log-likelihood.

    A block that the model cannot explain costs it a fixed amount and teaches it nothing but that its constant was wrong.
    """
    s = SENSOR[m]
    white, constant = p[7], p[8]
    nu = p[9] * count
    nu = nu / (1 + 0.5 * nu * p[10])
    alpha, beta = ig[m, 0], ig[m, 1]
    after, scaled = alpha + 0.5 * nu, beta + 0.5 * nu * power
    if s in (STUCK, NONE):
        told = -0.5 * nu * (log(constant) + power / constant)
        r = constant
        if p[9] < 0.1:  # rounding hides the noise: an axle at rest reads as constant as a stuck sensor
            told = -0.5 * nu * (log(white) + power / white) - p[19]
            r = white / count + p[14]
    elif s == OK:
        told = -0.5 * nu * (log(white) + power / white)
        r = white / count + p[14]
    elif s == GAIN:
        # the sensor scales its noise before it rounds
        v = z[m, 4] * z[m, 4] * max(white - p[18], 0.0) + p[18]
        v = max(v, constant)
        if p[9] < 0.1:
            v = white
        told = -0.5 * nu * (log(v) + power / v)
        r = v / count + p[14]
    else:
        # V ~ inverse gamma (α, β): p(power) = Γ(α+ν/2)/Γ(α) · β^α/(β+ν·power/2)^(α+ν/2)
        if alpha > 10.0:  # Γ(α+h)/Γ(α) ≈ (α + (h−1)/2)^h
            told = 0.5 * nu * log((alpha + 0.25 * nu - 0.5) / scaled) + alpha * log(beta / scaled)
        else:
            told = lgamma(after) - lgamma(alpha) + alpha * log(beta) - after * log(scaled)
        r = max(scaled / after, constant) / count + p[14]
    d, phi = z[m, 4], z[m, 0]
    # S = H P Hᵀ + R with H = [d, 0, 0, 0, φ, 1]
    total = r
    gain[:] = 0.0
    for n in range(FREE[m]):
        i = ACTIVE[m, n]
        gain[i] = P[m, i, 0] * d + P[m, i, 4] * phi + P[m, i, 5]
    total += gain[0] * d + gain[4] * phi + gain[5]
    innovation = y - d * phi - z[m, 5]
    told -= 0.5 * (innovation * innovation / total + log(2 * pi * total))
    floor = _OUTLIER - log(p[4]) - 0.5 * nu * (1 + log(max(power, constant)))
    if told < floor:
        if s == STUCK:
            _forget(m, 5, p[4], z, P)
        return floor
    ig[m, 0], ig[m, 1] = after, scaled
    for n in range(FREE[m]):
        i = ACTIVE[m, n]
        share = gain[i] / total
        z[m, i] += share * innovation
        for k in range(FREE[m]):
            P[m, i, ACTIVE[m, k]] -= share * gain[ACTIVE[m, k]]
    if s == GAIN and p[9] > 0.1:
        # the sensor scales its noise too: √((power − rounding)/σ²) measures d
        seen = (max(power - p[18], 0.0) / max(white - p[18], 1e-30)) ** 0.5
        _learn_gain(m, seen, (0.5 / nu + 0.25 * p[10]) * (seen * seen + 0.05), z, P, gain)
    if s == GAIN:
        z[m, 4] = min(max(z[m, 4], _LEAST_GAIN), _MOST_GAIN)
    if ACTUATOR[m] == GAIN or ACTUATOR[m] == NOISY:
        z[m, 2] = min(max(z[m, 2], _LEAST_GAIN), _MOST_GAIN)
    return told


@njit(cache=True, error_model="numpy")
def _learn_gain(m, seen, var, z, P, gain):  # type: ignore[no-untyped-def]
    """Kalman update of the sensor's gain d with a direct measurement of it."""
    for i in range(STATES):
        gain[i] = P[m, i, 4]
    total = gain[4] + var
    innovation = seen - z[m, 4]
    for i in range(STATES):
        z[m, i] += gain[i] * innovation / total
        for j in range(STATES):
            P[m, i, j] -= gain[i] * gain[j] / total


@njit(cache=True, error_model="numpy")
def _forget(m, i, std, z, P):  # type: ignore[no-untyped-def]
    """Give the constant x_i its prior again: it was learned from a block that a fault entered halfway."""
    for j in range(STATES):
        P[m, i, j] = P[m, j, i] = 0.0
    P[m, i, i] = std * std


@njit(cache=True, error_model="numpy")
def measure(m, second, p, z, P, row):  # type: ignore[no-untyped-def]
    """Update with what is measured twice.

    `second` holds [angle, variance, opening, variance, share of the
    command in it, variance, command].
    """
    told = 0.0
    h = row[0]
    g, a = p[2], ACTUATOR[m]
    for which in range(3):
        y, r = second[2 * which], second[2 * which + 1]
        if np.isnan(y):
            continue
        expected = 0.0
        h[:] = 0.0
        if which == 0:
            h[0], expected = 1.0, z[m, 0]
        elif a == OK:
            expected = second[6] if which == 1 else 1.0
        elif a != NONE:
            level = second[6] if which == 1 else 1.0
            if a != STUCK:
                h[2] = level
                expected += z[m, 2] * level
            if which == 1 and a != GAIN:
                h[3] = 1 / g
                expected += z[m, 3] / g
        one = _linear(m, y - expected, r, h, z, P, row[1])
        if one == _OUTLIER and a == STUCK and which == 1:
            _forget(m, 3, p[3], z, P)
        told += one
    if a in (GAIN, NOISY):
        z[m, 2] = min(max(z[m, 2], _LEAST_GAIN), _MOST_GAIN)
    return told


@njit(cache=True, error_model="numpy")
def _linear(m, innovation, r, h, z, P, gain):  # type: ignore[no-untyped-def]
    """Kalman update with one linear measurement H = h; an outlier teaches nothing. Returns the log-likelihood."""
    total = r
    for i in range(STATES):
        gain[i] = 0.0
        for j in range(STATES):
            gain[i] += P[m, i, j] * h[j]
    for i in range(STATES):
        total += h[i] * gain[i]
    # relative to what the measurement's own noise gives
    told = -0.5 * (innovation * innovation / total + log(total / r))
    if told < _OUTLIER:
        return _OUTLIER
    for i in range(STATES):
        z[m, i] += gain[i] * innovation / total
        for j in range(STATES):
            P[m, i, j] -= gain[i] * gain[j] / total
    return told


@njit(cache=True, error_model="numpy")
def advance(m, y, power, count, driven, u, status, second, p, z, P, ig, row):  # type: ignore[no-untyped-def]
    """One block of one model: prediction, update, log-likelihood; `driven` is NaN where nobody knows the opening."""
    blind = np.isnan(driven)
    if blind:
        predict(m, 0.0, 0.0, p, z, P, row)
        # the axle may turn either way at its full rate; without a sample to follow it, to anywhere
        P[m, 1, 1] = max(P[m, 1, 1], p[3] ** 2)
        reach = (p[3] * p[0]) ** 2 + ((0.2 * p[4]) ** 2 if status != PAIR else 0.0)
        P[m, 0, 0] = max(P[m, 0, 0], min(P[m, 0, 0] + reach, p[4] ** 2))
    else:
        predict(m, driven, u, p, z, P, row)
    seen = measure(m, second, p, z, P, row) if p[20] > 0 else 0.0
    if status == SILENT:
        return seen if SENSOR[m] == NONE else seen + _SILENT_COST
    if status != PAIR:
        return seen
    told = update(m, y, power, count, p, z, P, ig, row[2])
    if blind:  # a free angle fits everything; a smaller gain would only seem surer of it
        return seen
    out = seen + told
    if SENSOR[m] >= GAIN or ACTUATOR[m] == GAIN or ACTUATOR[m] == NOISY:
        out -= p[16]
    return out
