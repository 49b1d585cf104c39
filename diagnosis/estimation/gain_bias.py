"""Kalman tracking of [δ, δ̄] in y = δ·x + δ̄ + n: filterpy holds the model, a compiled scan runs it.

`gain_bias_filter` is the model and the oracle; `track_gain_bias` gives the same numbers for whole columns.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

if TYPE_CHECKING:
    from filterpy.kalman import KalmanFilter

Array = NDArray[np.float64]


@dataclass(frozen=True)
class GainBiasModel:
    """Random-walk model of [δ, δ̄].

    Attributes
    ----------
    noise : float
        Standard deviation of n [unit of y].
    gain_walk : float
        Random walk of δ [1/√s].
    bias_walk : float
        Random walk of δ̄ [unit/√s].
    gain_std, bias_std : float
        Standard deviation of [δ, δ̄] at the start around [1, 0]; also what they relax to.
    relax_s : float
        Time in which [δ, δ̄] relax to [1, 0] without evidence [s].
    dt : float
        Step [s].
    """

    noise: float
    gain_walk: float
    bias_walk: float
    gain_std: float
    bias_std: float
    relax_s: float
    dt: float


def gain_bias_filter(model: GainBiasModel) -> KalmanFilter:
    """Build the filter of [δ − 1, δ̄] with filterpy; the caller sets ``H = [[x, 1]]`` and updates with ``y − x``."""
    from filterpy.kalman import KalmanFilter

    kf = KalmanFilter(dim_x=2, dim_z=1)
    kf.x = np.zeros((2, 1))
    kf.P = np.diag([model.gain_std**2, model.bias_std**2])
    kf.F = np.eye(2) * np.exp(-model.dt / model.relax_s)
    kf.Q = np.diag([model.gain_walk**2 * model.dt, model.bias_walk**2 * model.dt])
    kf.R = np.array([[model.noise**2]])
    return kf


@dataclass(frozen=True)
class GainBiasTrack:
    """Filtered [δ, δ̄].

    Attributes
    ----------
    delta, delta_std : Array, shape (n,)
        δ̂ and its standard deviation [1].
    bias, bias_std : Array, shape (n,)
        δ̄̂ and its standard deviation [unit of y].
    innovation, innovation_std : Array, shape (n,)
        y minus its prediction, and what is expected of it; NaN where y was not used.
    state : Array, shape (5,)
        Mean and covariance to carry on with.
    """

    delta: Array
    delta_std: Array
    bias: Array
    bias_std: Array
    innovation: Array
    innovation_std: Array
    state: Array


class RandomWalk(NamedTuple):
    """Constants of one step for the compiled scan: F and Q of [δ − 1, δ̄], and R."""

    decay: float
    gain_q: float
    bias_q: float
    r: float


@njit(cache=True)
def _scan_gain_bias(y, x, use, walk, state, out):  # type: ignore[no-untyped-def]
    """Predict and update sample by sample; writes the six columns of `GainBiasTrack` and returns the last state."""
    f, q0, q1, r = walk.decay, walk.gain_q, walk.bias_q, walk.r
    m0, m1, a, b, c = state
    for k in range(y.size):
        # x = F x, P = F P Fᵀ + Q
        m0, m1 = f * m0, f * m1
        a, b, c = f * f * a + q0, f * f * b, f * f * c + q1
        if use[k]:
            h = x[k]
            g0, g1 = a * h + b, b * h + c
            s = h * g0 + g1 + r
            innovation = y[k] - h - h * m0 - m1
            k0, k1 = g0 / s, g1 / s
            m0 += k0 * innovation
            m1 += k1 * innovation
            # P = (I − K H) P
            a, b, c = a - k0 * g0, b - k0 * g1, c - k1 * g1
            out[4, k], out[5, k] = innovation, np.sqrt(s)
        else:
            out[4, k] = out[5, k] = np.nan
        out[0, k], out[1, k], out[2, k], out[3, k] = 1.0 + m0, np.sqrt(a), m1, np.sqrt(c)
    return np.array([m0, m1, a, b, c])


def track_gain_bias(
    y: Array, x: Array, use: NDArray[np.bool_], model: GainBiasModel, state: Array | None = None
) -> GainBiasTrack:
    """Track [δ, δ̄] over a block.

    Parameters
    ----------
    y, x : Array, shape (n,)
        Measured value and reference; values where `use` is False do not count.
    use : NDArray[np.bool_], shape (n,)
        Samples to update with; the others only predict (filterpy's ``update(None)``).
    model : GainBiasModel
        Noise and random walks.
    state : Array, shape (5,), or None
        ``state`` of the block before.
    """
    if state is None:
        state = np.array([0.0, 0.0, model.gain_std**2, 0.0, model.bias_std**2])
    walk = RandomWalk(
        decay=float(np.exp(-model.dt / model.relax_s)),
        gain_q=float(model.gain_walk**2 * model.dt),
        bias_q=float(model.bias_walk**2 * model.dt),
        r=float(model.noise**2),
    )
    out = np.empty((6, y.size))
    last = _scan_gain_bias(y, x, use, walk, tuple(state), out)
    return GainBiasTrack(out[0], out[1], out[2], out[3], out[4], out[5], np.asarray(last))
