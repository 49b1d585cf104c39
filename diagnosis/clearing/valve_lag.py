"""How late the axles of a machine answer their openings: what a command lets them do, in time with what they do."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.clearing.cells import Array
from diagnosis.estimation.lag import low_passed

Flags = NDArray[np.bool_]

_DELAYS_S, _LAGS_S = (0.0, 0.05, 0.1, 0.15, 0.2, 0.3), (0.0, 0.1, 0.2)  # of valve, cylinder and sensor together
_DEAD = np.linspace(0.0, 0.18, 10)  # openings that may move nothing [1]
_KNOWN = 0.5  # of what makes a delayed opening


def in_time(rate: Array, opening: Array, use: Flags, dt: float) -> Array:
    """Openings as late as the axles of the machine answer them: by one delay and one first-order lag for all, those that fit best.

    An axle that is steered in short strokes is still turning when its command has gone already, by which its rate per opening seems to
    change from stroke to stroke. One lag for all axles: a valve that has grown slow is not made the usual one.

    Parameters
    ----------
    rate, opening : Array, shape (cells, axles)
        [rad/s] and of full opening [1].
    use : Flags, shape (cells, axles)
        What counts.
    dt : float
        Length of a cell [s].

    Returns
    -------
    Array, shape (cells, axles)
        NaN where the opening is, and after a gap of it.
    """
    tried = [(delay, lag) for delay in _DELAYS_S for lag in _LAGS_S]
    late = (delayed(opening, dt, *one) for one in tried)
    best = min(((misfit(rate, x, use & np.isfinite(x)), k) for k, x in enumerate(late)), default=(0.0, 0))[1]
    return delayed(opening, dt, *tried[best])


def delayed(opening: Array, dt: float, delay_s: float, lag_s: float) -> Array:
    """Openings `delay_s` later and behind a first-order lag of `lag_s`, shape (cells, axles); NaN where the opening is, and after a gap of it."""
    known = np.isfinite(opening)
    value, share = (_delayed(x, dt, delay_s, lag_s) for x in (np.where(known, opening, 0.0), known.astype(np.float64)))
    return np.where(known & (share >= _KNOWN), value / np.maximum(share, _KNOWN), np.nan)


def misfit(rate: Array, opening: Array, use: Flags) -> float:
    """Mean share of their rates that the openings of all axles leave unexplained [1], by the best dead band and gain of each; infinite of none.

    Rates [rad/s], openings [1] and what counts, of shape (cells, axles).
    """
    left = []
    for r, u, some in zip(rate.T, opening.T, use.T, strict=True):
        past = np.sign(u[some]) * np.maximum(np.abs(u[some]) - _DEAD[:, np.newaxis], 0.0)
        power = (past**2).sum(axis=1)
        turned = float(np.abs(r[some]).sum())
        if not power.any() or turned <= 0.0:
            continue
        past, power = past[power > 0.0], power[power > 0.0]
        off = np.abs(r[some] - (past @ r[some] / power)[:, np.newaxis] * past).sum(axis=1)
        left.append(float(off.min()) / turned)
    return float(np.mean(left)) if left else np.inf


def _delayed(x: Array, dt: float, delay_s: float, lag_s: float) -> Array:
    """`x` of shape (cells, axles) later, between cells by shares of two of them; what was before is as the first cell."""
    if lag_s > 0.0:
        late = [low_passed(np.append(axle, 0.0), lag_s, dt)[1:] for axle in x.T]
        x = np.array(late).reshape(x.shape[::-1]).T  # also of no axle
    whole, share = divmod(delay_s / dt, 1.0)
    early = [np.concatenate([np.repeat(x[:1], k, axis=0), x])[: len(x)] for k in (int(whole), int(whole) + 1)]
    return np.asarray((1.0 - share) * early[0] + share * early[1])
