"""How a drive follows its commands: limits, dead time, lag and acceleration, of the whole or of driving and turning each for itself."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.kernel import follow, target

Array = NDArray[np.float64]


def target_of(commands: Array, parts: tuple[Array, Array], limit: float, delay: float) -> Array:
    """Speed that commands ask for [m/s], shape (cells,).

    Parameters
    ----------
    commands : Array, shape (cells, k)
        What the target is put together from, without NaN.
    parts : tuple[Array, Array], each of shape (k,)
        Weight of each column, and the largest part of the target that it makes [m/s].
    limit : float
        Largest speed [m/s].
    delay : float
        Dead time [cells].
    """
    weights, bounds = parts
    return np.asarray(target(commands, weights, bounds, limit, delay))


def followed(
    commands: Array, parts: tuple[Array, Array, Array], limit: float, delay: float, pace: tuple[float, float], h: float
) -> Array:
    """Speed that follows its target [m/s], shape (cells,).

    Where columns have limits of their own each is followed for itself, as a controller does that limits driving and turning.

    Parameters
    ----------
    commands : Array, shape (cells, k)
        Without NaN.
    parts : tuple[Array, Array, Array], each of shape (k,)
        Weight, bound [m/s] and largest acceleration [m/s²] of each column.
    limit, delay : float
        As for `target_of`.
    pace : tuple[float, float]
        Lag [s] and largest acceleration [m/s²] where no column has its own.
    h : float
        Length of a cell [s].
    """
    weights, bounds, rates = parts
    lag, rate = pace
    gain = -np.expm1(-h / max(lag, 1e-3))
    if not np.isfinite(bounds).any():
        asked = target_of(commands, (weights, bounds), limit, delay)
        return np.asarray(follow(asked, float(asked[0]), gain, rate * h))
    columns = by_column(commands, (weights, bounds, rates), delay, gain, h)
    return np.asarray(np.clip(columns.sum(axis=1), -limit, limit))


def by_column(commands: Array, parts: tuple[Array, Array, Array], delay: float, gain: float, h: float) -> Array:
    """What each column, followed for itself, makes of the speed [m/s], shape (cells, k).

    Parameters
    ----------
    commands, parts, delay, h
        As for `followed`.
    gain : float
        Share of what is missing that a cell makes up for.
    """
    out = np.zeros(commands.shape)
    weights, bounds, rates = parts
    for k, rate in enumerate(rates):
        one = slice(k, k + 1)
        asked = target_of(np.ascontiguousarray(commands[:, one]), (weights[one], bounds[one]), np.inf, delay)
        out[:, k] = follow(asked, float(asked[0]), gain, rate * h)
    return out
