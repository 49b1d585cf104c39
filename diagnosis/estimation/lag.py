"""Response of a first-order lag, over whole arrays or block by block."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from replay.arrays.compiling import njit

Array = NDArray[np.float64]


def low_passed(u: Array, tau: float, dt: float) -> Array:
    """Response of a first-order lag of tau [s], 0 for none, to u held over each step; it stays where u is NaN.

    Both of shape (n,).
    """
    return low_passed_on(u, tau, dt, None)[0] if u.size else u


def low_passed_on(u: Array, tau: float, dt: float, state: float | None) -> tuple[Array, float]:
    """`low_passed` of a block, with the state from the block before and for the next; None before the first.

    Both of shape (k,), in the unit of u; times in s.
    """
    a = np.exp(-dt / tau) if tau > 0 else 0.0
    out = np.empty(u.size)
    last = _scan_lag(np.ascontiguousarray(u), a, np.nan if state is None else state, out)
    return out, float(last)


@njit(cache=True)
def _scan_lag(u, a, x, out):  # type: ignore[no-untyped-def]
    """Write x and carry on with x ← a·x + (1 − a)·u; x stays where u is not known. NaN starts from the first finite u, else 0."""
    if x != x:
        x = 0.0
        for value in u:
            if np.isfinite(value):
                x = value
                break
    for k in range(u.size):
        out[k] = x
        if u[k] == u[k]:
            x = a * x + (1.0 - a) * u[k]
    return x
