"""Response of a first-order lag, over whole arrays or block by block."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from replay.arrays.compiling import njit

Array = NDArray[np.float64]


def low_passed(u: Array, tau: float, dt: float) -> Array:
    """Response of a first-order lag of tau [s], 0 for none, to u held over each step; it stays where u is NaN.

    Both of shape (n,).
    """
    return low_passed_on(u, tau, dt, None)[0] if u.size else u


def low_passed_at(u: Array, taus: Sequence[float], dt: float, at: NDArray[np.intp]) -> Array:
    """`low_passed` for several lags at once, at some steps alone: to the last digit, in half of the time.

    Parameters
    ----------
    u : Array, shape (n,)
        What is held over each step.
    taus : Sequence[float]
        Lags [s], none of them 0.
    dt : float
        Step [s].
    at : NDArray[np.intp], shape (k,)
        Steps in increasing order.

    Returns
    -------
    Array, shape (lags, k)
        In the unit of u.
    """
    out = np.empty((at.size, len(taus)))
    if at.size:
        keep = np.array([np.exp(-dt / tau) for tau in taus])
        _scan_lags(np.ascontiguousarray(u), keep, np.ascontiguousarray(at), out)
    return np.ascontiguousarray(out.T)


def low_passed_on(u: Array, tau: float, dt: float, state: float | None) -> tuple[Array, float]:
    """`low_passed` of a block, with the state from the block before and for the next; None before the first.

    Both of shape (k,), in the unit of u; times in s.
    """
    a = np.exp(-dt / tau) if tau > 0 else 0.0
    out = np.empty(u.size)
    last = _scan_lag(np.ascontiguousarray(u), a, np.nan if state is None else state, out)
    return out, float(last)


@njit(cache=True, nogil=True)
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


@njit(cache=True, nogil=True)
def _scan_lags(u, keep, at, out):  # type: ignore[no-untyped-def]
    """The same from the first finite u for several shares that are kept; the lags wait for nothing but their own last value."""
    x = np.zeros(keep.size)
    for value in u:
        if np.isfinite(value):
            x[:] = value
            break
    j = 0
    for k in range(at[-1] + 1):
        while j < at.size and at[j] == k:
            for i in range(keep.size):
                out[j, i] = x[i]
            j += 1
        now = u[k]
        if now == now:
            for i in range(keep.size):
                x[i] = keep[i] * x[i] + (1.0 - keep[i]) * now
