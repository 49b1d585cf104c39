"""The least value of a function by the simplex method of Nelder and Mead, in SciPy's steps."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class _Spent(Exception):
    """All calls have been made."""


def minimize(function: Callable[[Array], float], simplex: Array, *, calls: int, x_tol: float, f_tol: float) -> Array:
    """Search for the least value of a function.

    Every unit is that of the function or of its argument.

    Parameters
    ----------
    function : Callable
        Of a point, shape (k,).
    simplex : Array, shape (k + 1, k)
        Where to begin.
    calls : int
        Calls of the function at most.
    x_tol, f_tol : float
        Spread of the simplex and of its values at which to stop.

    Returns
    -------
    Array, shape (k,)
        The best point that was found.
    """
    left = calls

    def value(x: Array) -> float:
        nonlocal left
        if left <= 0:
            raise _Spent
        left -= 1
        return float(function(x))

    points, values = simplex.copy(), np.full(len(simplex), np.inf)
    try:
        for i, point in enumerate(points):
            values[i] = value(point)
        while left > 0:
            order = np.argsort(values, kind="stable")
            points, values = points[order], values[order]
            if np.abs(points[1:] - points[0]).max() <= x_tol and np.abs(values[1:] - values[0]).max() <= f_tol:
                break
            _step(points, values, value)
    except _Spent:
        pass
    return np.asarray(points[np.argmin(values)])


def _step(points: Array, values: Array, value: Callable[[Array], float]) -> None:
    """Reflect the worst point, then expand, contract or shrink; the points are in order, the best first."""
    middle, worst = points[:-1].sum(axis=0) / (len(points) - 1), points[-1].copy()

    def take(point: Array, found: float) -> None:
        points[-1], values[-1] = point, found

    mirrored = 2 * middle - worst
    reflected = value(mirrored)
    if reflected < values[0]:
        far = 3 * middle - 2 * worst
        expanded = value(far)
        take(*((far, expanded) if expanded < reflected else (mirrored, reflected)))
    elif reflected < values[-2]:
        take(mirrored, reflected)
    else:
        outside = reflected < values[-1]
        near = 1.5 * middle - 0.5 * worst if outside else 0.5 * middle + 0.5 * worst
        contracted = value(near)
        if contracted <= reflected if outside else contracted < values[-1]:
            take(near, contracted)
            return
        for i in range(1, len(points)):
            points[i] = points[0] + 0.5 * (points[i] - points[0])
            values[i] = value(points[i])
