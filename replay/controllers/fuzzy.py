"""Fuzzy adaptive control: the class of the paper's comparator "Sun 2020" (compiled).

A representative of the class, not those authors' controller (their gains and code are not public):

    u = −k e − k_i ∫e − g_u ξᵀ(g_v v_c, g_d e_f') θ̂ − k_r tanh(e/ε)
    θ̂' = γ (ξ e − σ θ̂)
    e_f' = (e − e_f)/τ_f
    ξ: products of Gaussian memberships about −1, 0, 1 of both inputs (widths w_v, w_d), divided by their sum: 3 × 3 rules

12 parameters: k, k_i, γ, σ, k_r, ε, g_v, g_d, g_u, w_v, w_d, τ_f. Explicit Euler; ∫e and θ̂ wait while the command is clipped
(`replay.controllers.limits.winds_up`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from replay.arrays.compiling import njit
from replay.controllers.limits import F, clipped, winds_up


class FuzzyGains(NamedTuple):
    """12 parameters; speeds in m/s, u as a fraction of full opening."""

    k: float = 2.52  # [s/m]
    k_i: float = 7.11  # [1/m]
    gamma: float = 37.7
    sigma: float = 0.000953
    k_r: float = 0.0102
    epsilon: float = 0.0386  # [m/s]
    g_v: float = 13.0  # [s/m]
    g_d: float = 0.871  # [s²/m]
    g_u: float = 0.96
    w_v: float = 0.203
    w_d: float = 0.306
    tau_f: float = 0.0605  # [s]


FUZZY_STATES = 11  # θ̂ (9), ∫e, e_f


@njit(cache=True, no_cpython_wrapper=True)
def fuzzy_step(v_ref: F, y: F, dt: float, u_max: float, g: FuzzyGains, s: F, u: F) -> None:
    """Command of every wheel into `u`, shape (wheels,); `s`, shape (wheels, FUZZY_STATES), is advanced.

    Speeds in m/s, `dt` in s, u in fractions of full opening.
    """
    rule = np.empty(9)
    for i in range(y.size):
        e = y[i] - v_ref[i]
        rate = (e - s[i, 10]) / g.tau_f
        # beyond the outer rules the inputs count as at them, so that the sum of the memberships never vanishes
        speed, change = min(max(g.g_v * v_ref[i], -1.0), 1.0), min(max(g.g_d * rate, -1.0), 1.0)
        total = 0.0
        for j in range(9):
            a, b = (speed - (j // 3 - 1.0)) / g.w_v, (change - (j % 3 - 1.0)) / g.w_d
            rule[j] = np.exp(-(a * a) - b * b)
            total += rule[j]
        raw = -g.k * e - g.k_i * s[i, 9] - g.k_r * np.tanh(e / g.epsilon)
        for j in range(9):
            rule[j] /= total
            raw -= g.g_u * rule[j] * s[i, j]
        u[i] = clipped(raw, u_max)
        if not winds_up(raw, e, u_max):
            s[i, 9] += dt * e
            for j in range(9):
                s[i, j] += dt * g.gamma * (rule[j] * e - g.sigma * s[i, j])
        s[i, 10] += dt * rate
