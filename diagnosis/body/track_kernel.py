"""Compiled Kalman smoother of what a sensor of the body says beyond the speed that the wheels have in common.

State x = [e, β, a, c]: e the way by the sensor beyond that by the wheels [m], s·β the body's speed beyond the common one,
s how far the wheels let it be off at that moment [m/s], a how far the sensor is mounted to the left [m], c the share by
which the wheels count the way short [1].

    ė = s·β + c·m + w_e,   β̇ = −β/T + w_β (of variance 1),   ȧ = ċ = 0,   measured  z = h·x + n
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from replay.arrays.compiling import njit
from replay.arrays.copying import put, put_rows

Array = NDArray[np.float64]

STATES = 4
_JUMP = 6.0  # standard deviations beyond which a position has jumped


class TrackModel(NamedTuple):
    """Constants of the smoother. SI units."""

    wander: float  # process noise of the sensor's own position [m/√s]
    memory: float  # correlation time T of β [s]
    mount: float  # standard deviation of a [m]
    scale: float  # standard deviation of c [1]


class TrackInput(NamedTuple):
    """What is measured, per cell of `dt`."""

    z: Array  # (n,) NaN: nothing
    noise: Array  # (n,) its standard deviation
    rows: Array  # (n, 4) h
    moved: Array  # (n,) way by the wheels since the cell before [m]
    off: Array  # (n,) s
    dt: float


class TrackOutput(NamedTuple):
    """What the filter leaves for the smoother, per cell."""

    before: Array  # (n, 4) predicted
    before_cov: Array  # (n, 4, 4)
    mean: Array  # (n, 4) filtered
    cov: Array  # (n, 4, 4)
    misfit: Array  # (n,) squared innovation over its variance; NaN without a sample
    jumped: NDArray[np.bool_]  # (n,)


@njit(cache=True, error_model="numpy", no_cpython_wrapper=True)
def _predict(x: Array, P: Array, off: float, moved: float, keep: float) -> None:
    """State and covariance one cell later, in place: x₀ += off·x₁ + moved·x₃, x₁ ·= keep. Products of matrices take seconds to compile."""
    x[0] += off * x[1] + moved * x[3]
    x[1] *= keep
    for j in range(STATES):
        P[0, j] += off * P[1, j] + moved * P[3, j]
        P[1, j] *= keep
    for i in range(STATES):
        P[i, 0] += off * P[i, 1] + moved * P[i, 3]
        P[i, 1] *= keep


@njit(cache=True, error_model="numpy")
def filter_track(seen: TrackInput, k: TrackModel, out: TrackOutput) -> float:
    """Run the filter over cells, filling `out`; the log-likelihood of the samples."""
    x, P, gain = np.zeros(STATES), np.zeros((STATES, STATES)), np.zeros(STATES)
    P[0, 0], P[1, 1], P[2, 2], P[3, 3] = 1e4, 1.0, k.mount**2, k.scale**2
    keep = np.exp(-seen.dt / k.memory)
    likelihood, first = 0.0, True
    for n in range(seen.z.size):
        if n > 0:
            _predict(x, P, seen.off[n] * seen.dt, seen.moved[n], keep)
            P[0, 0] += k.wander**2 * seen.dt
            P[1, 1] += 1.0 - keep * keep
        known = seen.z[n] == seen.z[n]
        h = seen.rows[n]
        out.jumped[n], out.misfit[n] = False, np.nan
        innovation, s = 0.0, 1.0
        if known:
            innovation, s = seen.z[n], seen.noise[n] ** 2
            for i in range(STATES):
                innovation -= h[i] * x[i]
                for j in range(STATES):
                    s += h[i] * P[i, j] * h[j]
            if innovation * innovation > _JUMP**2 * s and h[0] != 0.0 and not first:
                out.jumped[n] = True
                P[0, 0] += innovation * innovation
                s += innovation * innovation
        put(out.before[n], x)
        put_rows(out.before_cov[n], P)
        if known:
            share = innovation * innovation / s
            for i in range(STATES):
                gain[i] = 0.0
                for j in range(STATES):
                    gain[i] += P[i, j] * h[j] / s
            for i in range(STATES):
                x[i] += gain[i] * innovation
                for j in range(STATES):
                    P[i, j] -= gain[i] * gain[j] * s
            if not first:
                likelihood -= 0.5 * (share + np.log(s))
                out.misfit[n] = share
            first = False
        put(out.mean[n], x)
        put_rows(out.cov[n], P)
    return likelihood


def smooth_track(seen: TrackInput, k: TrackModel, out: TrackOutput) -> tuple[Array, Array]:
    """Rauch-Tung-Striebel smoothing of what `filter_track` left: means (n, 4) and covariances (n, 4, 4)."""
    F = np.zeros((seen.z[1:].size, STATES, STATES))
    F[:] = np.eye(STATES)
    F[:, 0, 1], F[:, 0, 3], F[:, 1, 1] = seen.off[1:] * seen.dt, seen.moved[1:], np.exp(-seen.dt / k.memory)
    gains = np.linalg.solve(out.before_cov[1:], F @ out.cov[:-1])
    mean, cov = out.mean.copy(), out.cov.copy()
    _smooth(np.ascontiguousarray(gains.transpose(0, 2, 1)), out, mean, cov)
    return mean, cov


@njit(cache=True, error_model="numpy")
def _smooth(gains: Array, out: TrackOutput, mean: Array, cov: Array) -> None:
    """Go back over the cells with their gains, (n − 1, 4, 4), from the last filtered one."""
    part = np.zeros((STATES, STATES))  # gain · (covariance of the next cell, less what was predicted)
    for n in range(gains.shape[0] - 1, -1, -1):
        gain = gains[n]
        for i in range(STATES):
            mean[n, i] = out.mean[n, i]
            for j in range(STATES):
                mean[n, i] += gain[i, j] * (mean[n + 1, j] - out.before[n + 1, j])
                part[i, j] = 0.0
                for k in range(STATES):
                    part[i, j] += gain[i, k] * (cov[n + 1, k, j] - out.before_cov[n + 1, k, j])
        for i in range(STATES):
            for j in range(STATES):
                cov[n, i, j] = out.cov[n, i, j]
                for k in range(STATES):
                    cov[n, i, j] += part[i, k] * gain[j, k]
