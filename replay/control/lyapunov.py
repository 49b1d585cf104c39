"""Quantities of the paper's stability proof along a mission: lumped terms of L13 (10), L12 (11), and V of L14 (12).

A wheel τ v' = −v + K·(δ_a u + b_a) + d gives, with e = v_a − v_c and faults of the sensor in the measurement alone,

    e' = a u + F + D         a = K δ_a/τ,  F = −v_a/τ,  D = (K b_a + d)/τ − v_c'

    V = e²/(2ā) + Ψ̂²/2       ā = K/τ, the largest a; with ½ on e², as L18 (16) and L26 (24) have it

    V' ≤ −λ (a/ā) e² + |e| (F* + D* + λξ) − β Ψ̂²                     L22 (20), F* and D* the largest |F|/ā and |D|/ā

The bound that follows from it (L33 (31)) is so wide with the paper's parameters that no mission leaves it; what can fail on the way
is L22 itself, as where Ψ̂ is driven by something that L16 does not have, and its premise a > 0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True)
class ProofTerms:
    """Along a mission, shape (n, wheels); means over a window, NaN where it is not whole.

    Attributes
    ----------
    F, D : Array
        Lumped terms [m/s²].
    V : Array
        Lyapunov function of each wheel at each sample [m], Ψ̂² counted as m; the sum over the wheels is L26 (24).
    rate, bound : Array
        V' and the right side of L22 (20) [m/s].
    broken : NDArray[np.bool_]
        Where V' exceeds the bound.
    uncontrolled : NDArray[np.bool_]
        Where a = 0: a stuck or silent valve, for which the proof has nothing to say.
    """

    F: Array
    D: Array
    V: Array
    rate: Array
    bound: Array
    broken: Flags
    uncontrolled: Flags


@dataclass(frozen=True)
class ProofConstants:
    """Gain [m/s] and lag [s] of each wheel, shape (wheels,); λ [s/m], ξ and β [1/s]; λξ counts ξ as a speed, as L21 (19) does."""

    K: Array
    tau: Array
    lambda_: float
    xi: float
    beta: float


def proof_terms(
    v: Array,
    v_c: Array,
    u: Array,
    psi: Array,
    let_valve: Array,
    constants: ProofConstants,
    dt: float,
    window_s: float = 0.25,
) -> ProofTerms:
    """Terms of the proof along a mission.

    Parameters
    ----------
    v, v_c : Array, shape (n, wheels)
        True and commanded speed [m/s]; NaN in v where it is not known.
    u, psi : Array, shape (n, wheels)
        Valve command [fraction] and Ψ̂.
    let_valve : Array, shape (n, wheels)
        δ_a = 1 − ε_a [1].
    constants : ProofConstants
        Of the wheels and the law.
    dt : float
        Step [s].
    window_s : float
        Over which derivatives and means are taken [s]: noise and rounding of v spoil derivatives from sample to sample.
    """
    most = constants.K / constants.tau
    half = max(1, round(window_s / 2 / dt))
    e = v - v_c
    V = e * e / (2.0 * most) + 0.5 * psi * psi
    F = _mean(-v / constants.tau, half)
    D = _slope(e, half, dt) - F - _mean(most * let_valve * u, half)
    F_most, D_most = _largest(F / most), _largest(D / most)
    right = (
        -constants.lambda_ * let_valve * e * e
        + np.abs(e) * (F_most + D_most + constants.lambda_ * constants.xi)
        - constants.beta * psi * psi
    )
    rate, bound = _slope(V, half, dt), _mean(right, half)
    with np.errstate(invalid="ignore"):
        broken = np.asarray(rate > bound)
    return ProofTerms(F, D, V, rate, bound, broken, np.asarray(let_valve <= 0.0))


def _largest(x: Array) -> Array:
    """Largest size in each column, 0 where nothing is known, shape (wheels,)."""
    return np.asarray(np.max(np.abs(np.nan_to_num(x)), axis=0, initial=0.0))


def _slope(x: Array, half: int, dt: float) -> Array:
    """Derivative over a window of 2·half steps."""
    out = np.full(x.shape, np.nan)
    if len(x) > 2 * half:
        out[half:-half] = (x[2 * half :] - x[: -2 * half]) / (2 * half * dt)
    return out


def _mean(x: Array, half: int) -> Array:
    """Mean over a window of 2·half steps; NaN where a value in it is missing."""
    out = np.full(x.shape, np.nan)
    if len(x) > 2 * half:
        start = np.zeros((1, x.shape[1]))
        total = np.cumsum(np.vstack([start, np.nan_to_num(x)]), axis=0)
        missing = np.cumsum(np.vstack([start, ~np.isfinite(x)]), axis=0)
        gap = missing[2 * half : -1] - missing[: -2 * half - 1]
        mean = (total[2 * half : -1] - total[: -2 * half - 1]) / (2 * half)
        out[half:-half] = np.where(gap == 0, mean, np.nan)
    return out
