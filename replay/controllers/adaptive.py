"""Adaptive control with a regressor and a robust term: the class of the paper's comparator "Yang 2022" (compiled).

A representative of the class, not those authors' controller (their gains and code are not public):

    u = −k e − θ̂ᵀφ − ρ̂ tanh(e/ε)                    φ = [v_c, tanh v_c, 1, v̇_c, y]
    θ̂_j' = γ_j (φ_j e − σ_j θ̂_j)                     |θ̂_j| ≤ bound (projection)
    ρ̂'  = γ_ρ (e tanh(e/ε) − σ_ρ ρ̂)                  0 ≤ ρ̂ ≤ bound
    v̇_c = (v_c − v_f)/τ_f,  τ_f v_f' = v_c − v_f     (reference filter)

16 parameters: k, γ₁…γ₅, σ₁…σ₅, γ_ρ, σ_ρ, ε, τ_f, bound. Explicit Euler; θ̂ and ρ̂ wait while the command is clipped
(`replay.controllers.limits.winds_up`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from replay.arrays.compiling import njit
from replay.controllers.limits import F, bounded, clipped, winds_up


class AdaptiveGains(NamedTuple):
    """16 parameters; speeds in m/s, u as a fraction of full opening."""

    k: float = 1.23  # [s/m]
    gamma_v: float = 63.4
    gamma_tanh: float = 8.52
    gamma_one: float = 24.1
    gamma_rate: float = 35.9
    gamma_y: float = 9.89
    sigma_v: float = 0.000791
    sigma_tanh: float = 0.000757
    sigma_one: float = 0.00185
    sigma_rate: float = 0.000665
    sigma_y: float = 0.0013
    gamma_rho: float = 4.82
    sigma_rho: float = 0.0143
    epsilon: float = 0.0593  # [m/s]
    tau_f: float = 0.0253  # [s]
    bound: float = 2.6


ADAPTIVE_STATES = 7  # θ̂ (5), ρ̂, v_f


@njit(cache=True, no_cpython_wrapper=True)
def adaptive_step(v_ref: F, y: F, dt: float, u_max: float, g: AdaptiveGains, s: F, u: F) -> None:
    """Command of every wheel into `u`, shape (wheels,); `s`, shape (wheels, ADAPTIVE_STATES), is advanced.

    Speeds in m/s, `dt` in s, u in fractions of full opening.
    """
    gamma = (g.gamma_v, g.gamma_tanh, g.gamma_one, g.gamma_rate, g.gamma_y)
    sigma = (g.sigma_v, g.sigma_tanh, g.sigma_one, g.sigma_rate, g.sigma_y)
    for i in range(y.size):
        e = y[i] - v_ref[i]
        rate = (v_ref[i] - s[i, 6]) / g.tau_f
        phi = (v_ref[i], np.tanh(v_ref[i]), 1.0, rate, y[i])
        soft = np.tanh(e / g.epsilon)
        raw = -g.k * e - s[i, 5] * soft
        for j in range(5):
            raw -= s[i, j] * phi[j]
        u[i] = clipped(raw, u_max)
        if not winds_up(raw, e, u_max):
            for j in range(5):
                s[i, j] = bounded(s[i, j] + dt * gamma[j] * (phi[j] * e - sigma[j] * s[i, j]), g.bound)
            s[i, 5] = max(bounded(s[i, 5] + dt * g.gamma_rho * (e * soft - g.sigma_rho * s[i, 5]), g.bound), 0.0)
        s[i, 6] += dt * rate
