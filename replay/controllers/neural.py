"""Neural fault-tolerant control with radial basis functions: the class of the paper's comparator "Yu 2020" (compiled).

A representative of the class, not those authors' controller (their gains and code are not public):

    u = −k e − Ŵᵀ S(v_c) − k_r tanh(e/ε₀)
    Ŵ' = γ (S e − σ Ŵ)
    S_j = exp(−(v_c − c_j)²/width²), nine centres c_j evenly from −range to +range

6 parameters: k, γ, σ, width, range, k_r; ε₀ = 0.02 m/s is fixed. Explicit Euler; Ŵ waits while the command is clipped
(`replay.controllers.limits.winds_up`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from replay.arrays.compiling import njit
from replay.controllers.limits import F, clipped, winds_up

LAYER = 0.02  # ε₀ [m/s]
NODES = 9


class NeuralGains(NamedTuple):
    """6 parameters; speeds in m/s, u as a fraction of full opening."""

    k: float = 2.09  # [s/m]
    gamma: float = 4.68
    sigma: float = 0.000954
    width: float = 2.96  # [m/s]
    range: float = 0.687  # [m/s]
    k_r: float = 0.00369


NEURAL_STATES = NODES  # Ŵ


@njit(cache=True, no_cpython_wrapper=True)
def neural_step(v_ref: F, y: F, dt: float, u_max: float, g: NeuralGains, s: F, u: F) -> None:
    """Command of every wheel into `u`, shape (wheels,); `s`, shape (wheels, NEURAL_STATES), is advanced.

    Speeds in m/s, `dt` in s, u in fractions of full opening.
    """
    basis = np.empty(NODES)
    for i in range(y.size):
        e = y[i] - v_ref[i]
        raw = -g.k * e - g.k_r * np.tanh(e / LAYER)
        for j in range(NODES):
            centre = g.range * (2.0 * j / (NODES - 1) - 1.0)
            basis[j] = np.exp(-(((v_ref[i] - centre) / g.width) ** 2))
            raw -= s[i, j] * basis[j]
        u[i] = clipped(raw, u_max)
        if not winds_up(raw, e, u_max):
            for j in range(NODES):
                s[i, j] += dt * g.gamma * (basis[j] * e - g.sigma * s[i, j])
