"""Robust regression over windows, and honest standard deviations by leaving out groups of windows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_SUBSETS = 400
_ROUNDS = 20
_TUKEY = 4.685
_CUT = 4.0
_TINY = 1e-12  # a scale of zero would leave nothing to divide by


@dataclass(frozen=True)
class Estimate:
    """A constant with its standard deviation; NaN where not known, `why` then says why."""

    value: float
    std: float
    why: str = ""


UNKNOWN = Estimate(float("nan"), float("nan"))


def weighted_median(x: Array, weight: Array) -> float:
    """Value below which half of the weight lies; NaN where there is none.

    Both of shape (n,); the result in the unit of x.
    """
    if not x.size:
        return float("nan")
    order = np.argsort(x)
    total = np.cumsum(weight[order])
    return float(x[order][min(int(np.searchsorted(total, 0.5 * total[-1])), x.size - 1)])


def equal_weights(group: NDArray[np.int64], full: int) -> Array:
    """Weights that count every group alike, one with fewer than `full` members in proportion; shape (n,)."""
    _, index, count = np.unique(group, return_inverse=True, return_counts=True)
    return np.asarray((np.minimum(count, full) / full / count)[index])


def robust_solve(regressors: Array, instruments: Array, y: Array, weight: Array, floor: float) -> tuple[Array, Array]:
    """Solve y = X·β by instruments, windows that disagree with the majority left out.

    The start is the smallest median residual over small subsets, which holds while fewer than half of the weight
    disagrees; Tukey's weights refine it.

    Units are those of the equation; weights and their sum are plain numbers [1].

    Parameters
    ----------
    regressors, instruments : Array, shape (n, k)
        X and Z of Z'X β = Z'y; the same where no instruments are known.
    y, weight : Array, shape (n,)
        Response, and how much each window counts.
    floor : float
        Smallest standard deviation that the residuals are taken to have.

    Returns
    -------
    beta : Array, shape (k,)
        NaN where the regressors do not fix it.
    agree : Array, shape (n,)
        Weight of each window with those that disagree at 0.
    """
    n, k = regressors.shape
    nothing = np.full(k, np.nan), np.zeros(n)
    if n < k + 2 or np.linalg.matrix_rank(regressors) < k:
        return nothing
    rows = _subsets(weight, k)
    starts = np.einsum("mij,mj->mi", np.linalg.pinv(regressors[rows], rcond=1e-6), y[rows])
    misfits = [weighted_median(np.abs(y - regressors @ b), weight) for b in starts]
    beta = starts[int(np.argmin(misfits))]
    scale = max(1.4826 * min(misfits), floor, _TINY)
    for _ in range(_ROUNDS):
        x = np.clip((y - regressors @ beta) / (_TUKEY * scale), -1, 1)
        w = weight * (1 - x**2) ** 2
        left = (instruments * w[:, None]).T @ regressors
        if np.linalg.matrix_rank(left) < k:
            return nothing
        before, beta = beta, np.linalg.solve(left, (instruments * w[:, None]).T @ y)
        residual = np.abs(y - regressors @ beta)
        scale = max(1.4826 * weighted_median(residual, weight), floor, _TINY)
        if np.allclose(before, beta, rtol=1e-6, atol=1e-12):
            break
    return beta, np.where(np.abs(y - regressors @ beta) <= _CUT * scale, weight, 0.0)


def _subsets(weight: Array, k: int) -> NDArray[np.intp]:
    """Subsets of k windows each, drawn by their weight and the same in every run; shape (_SUBSETS, k)."""
    rng, total = np.random.default_rng(weight.size), np.cumsum(weight)
    rows = np.empty((0, k), dtype=np.intp)
    while len(rows) < _SUBSETS:
        drawn = np.searchsorted(total[:-1], total[-1] * rng.random((_SUBSETS, k)), side="right")
        different = (np.diff(np.sort(drawn, axis=1), axis=1) > 0).all(axis=1)
        rows = np.concatenate([rows, drawn[different]])
    return rows[:_SUBSETS]


def solve(regressors: Array, instruments: Array, y: Array, weight: Array) -> Array:
    """β of Z'WX β = Z'Wy; NaN where it is not fixed.

    `regressors` and `instruments` of shape (n, k), `y` and `weight` of shape (n,), β of shape (k,).
    """
    left = (instruments * weight[:, None]).T @ regressors
    if np.linalg.matrix_rank(left) < left.shape[0]:
        return np.full(left.shape[0], np.nan)
    return np.asarray(np.linalg.solve(left, (instruments * weight[:, None]).T @ y))


def jackknife(groups: NDArray[np.int64], estimate: Callable[[NDArray[np.bool_]], Array]) -> Array:
    """Standard deviation of an estimate from leaving out one group of windows at a time.

    Parameters
    ----------
    groups : NDArray[np.int64], shape (n,)
        Group of each window: its mission, or its part of the only mission.
    estimate : callable
        Estimate, shape (k,), from the windows that a mask keeps.

    Returns
    -------
    Array, shape (k,)
        NaN with fewer than three groups.
    """
    names = np.unique(groups)
    if names.size < 3:
        return np.full_like(estimate(np.ones(groups.size, dtype=np.bool_)), np.nan)
    values = np.array([estimate(groups != g) for g in names])
    count = names.size
    return np.asarray(np.sqrt((count - 1) / count * ((values - values.mean(axis=0)) ** 2).sum(axis=0)))
