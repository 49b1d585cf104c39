"""Finite-time sliding control: the class of the paper's comparator "Wang 2021" (compiled).

A representative of the class, not those authors' controller (their gains and code are not public):

    s = e + c ∫|e|^α sgn e
    u = −k₁ s − k₂ |s|^β sgn s − ρ̂ tanh(s/ε₀)
    ρ̂' = γ (|s| − σ ρ̂)

7 parameters: c, α, k₁, k₂, β, γ, σ; ε₀ = 0.02 m/s is fixed. Explicit Euler; integral and ρ̂ wait while the command is clipped
(`replay.controllers.limits.winds_up`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from replay.arrays.compiling import njit
from replay.controllers.limits import F, clipped, winds_up

LAYER = 0.02  # ε₀ [m/s]


class FiniteTimeGains(NamedTuple):
    """7 parameters; speeds in m/s, u as a fraction of full opening."""

    c: float = 5.73
    alpha: float = 0.789
    k1: float = 2.01  # [s/m]
    k2: float = 0.0126
    beta: float = 0.26
    gamma: float = 1.85
    sigma: float = 0.971


FINITE_TIME_STATES = 2  # ∫|e|^α sgn e, ρ̂


@njit(cache=True, no_cpython_wrapper=True)
def finite_time_step(v_ref: F, y: F, dt: float, u_max: float, g: FiniteTimeGains, s: F, u: F) -> None:
    """Command of every wheel into `u`, shape (wheels,); `s`, shape (wheels, FINITE_TIME_STATES), is advanced.

    Speeds in m/s, `dt` in s, u in fractions of full opening.
    """
    for i in range(y.size):
        e = y[i] - v_ref[i]
        surface = e + g.c * s[i, 0]
        size = abs(surface)
        raw = -g.k1 * surface - g.k2 * size**g.beta * np.sign(surface) - s[i, 1] * np.tanh(surface / LAYER)
        u[i] = clipped(raw, u_max)
        if not winds_up(raw, e, u_max):
            s[i, 0] += dt * abs(e) ** g.alpha * np.sign(e)
            s[i, 1] += dt * g.gamma * (size - g.sigma * s[i, 1])
