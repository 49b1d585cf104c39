"""Stretches of a channel that nothing but healthy explains: the path through the rows need not weigh the others there."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from diagnosis.estimation.fault_models import CLEAR, PAIR, SKIP

Array = NDArray[np.float64]

_BLOCK = 32
_MARGIN = 2  # blocks beside one that stands out
_SIGMAS = 3.0
_SAME = 0.6


@njit(cache=True)
def _calm(y, x, status, noise, block, out):  # type: ignore[no-untyped-def]
    """Whether each block's residual is as white noise is: mean, share of x, power, and values that change."""
    for i in range(out.size):
        n, same = 0, 0
        sd = sdd = sdx = sxx = 0.0
        last = np.nan
        good = True
        for k in range(i * block, min(y.size, (i + 1) * block)):
            if status[k] == PAIR:
                d = y[k] - x[k]
                n += 1
                sd += d
                sdd += d * d
                sdx += d * x[k]
                sxx += x[k] * x[k]
                if y[k] == last:
                    same += 1
                last = y[k]
            elif status[k] != SKIP:
                good = False
        out[i] = (
            good
            and sd * sd <= _SIGMAS**2 * noise**2 * n
            and sdx * sdx <= _SIGMAS**2 * noise**2 * sxx
            and sdd <= noise**2 * (n + _SIGMAS * np.sqrt(2.0 * n))
            and same <= _SAME * n
        )


def screened(y: Array, x: Array, status: NDArray[np.int8], noise: float) -> NDArray[np.int8]:
    """Status of every sample with `CLEAR` for pairs in stretches that look like healthy noise and nothing else.

    Parameters
    ----------
    y, x : Array, shape (n,)
        Measured value and reference.
    status : NDArray[np.int8], shape (n,)
        See `diagnosis.estimation.viterbi.forward`.
    noise : float
        Standard deviation of y − x while healthy.
    """
    calm = np.zeros(-(-y.size // _BLOCK), dtype=np.bool_)
    _calm(y, x, status, noise, _BLOCK, calm)
    odd = np.flatnonzero(~calm)
    for step in range(1, _MARGIN + 1):
        calm[np.maximum(odd - step, 0)] = False
        calm[np.minimum(odd + step, calm.size - 1)] = False
    out = status.copy()
    out[np.repeat(calm, _BLOCK)[: y.size] & (status == PAIR)] = CLEAR
    return out
