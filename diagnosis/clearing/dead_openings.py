"""Opening below which no drive of a machine moves, as far as its wheels' speeds per opening agree better beyond it.

Valves with open centres, and such as overlap, give a multiple not of their opening but of what it is beyond some dead part. In a turn the
wheels of two sides then differ per opening although all are sound, and a loss hides among such differences.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.clearing.cells import Array, Cells
from replay.arrays.quantiles import median_known, median_of, quantile_known, quantile_of

_STEP = 0.02  # of full opening
#: The dead part is at most this share of the openings that the machine drives with, so that a speed goes by no more than the third power of them.
_MOST, _LOW = 2.0 / 3.0, 0.02
_LEAST_WINDOWS = 20
#: Wheels that agree within this need none [ln], and it must leave no more than this share of what they differ by.
_AGREE, _BETTER = 0.03, 0.75
_OFTEN = 0.95  # of the windows: turns are few


def dead_opening(cells: Cells, moved: Array, opened: Array, count: Array, ahead: NDArray[np.bool_]) -> float:
    """Opening below which no drive moves [1]; 0 where wheels agree as well without it.

    Once for a mission, and of what most wheels have in common: a fault of one wheel is in the median of none of its windows.

    Parameters
    ----------
    cells : Cells
        The mission.
    moved, opened : Array, shape (windows, wheels)
        Sums of speed [m/s] and of opening [1] over the settled cells of each window; NaN where too little is known.
    count : Array, shape (windows, wheels)
        Such cells.
    ahead : NDArray[np.bool_], shape (windows, wheels)
        Whether a wheel drives forward.
    """
    return cells.once("dead opening", lambda: _searched(moved, opened, count, ahead))


def beyond(opened: Array, count: Array, dead: float) -> Array:
    """What sums of openings are beyond a dead part, with at least a share of themselves left; all of shape (windows, wheels) [1]."""
    return np.asarray(np.maximum(opened - dead * count, (1.0 - _MOST) * opened)) if dead > 0.0 else opened


def _searched(moved: Array, opened: Array, count: Array, ahead: NDArray[np.bool_]) -> float:
    known = np.isfinite(moved) & np.isfinite(opened) & (opened > 0.0) & (count > 0.0) & (moved > 0.0)
    rows = known.sum(axis=1) > 2
    if np.count_nonzero(rows) < _LEAST_WINDOWS:
        return 0.0
    v, u, n = (x[rows] for x in (np.where(known, moved, np.nan), np.where(known, opened, np.nan), count))
    most = _MOST * float(quantile_known(u / n, _LOW))
    tried = np.arange(0.0, most, _STEP)
    if not tried.size:
        return 0.0
    apart = [_apart(v, beyond(u, n, float(d)), ahead[rows]) for d in tried]
    best = int(np.argmin(apart))
    return float(tried[best]) if apart[0] >= _AGREE and apart[best] <= _BETTER * apart[0] else 0.0


def _apart(moved: Array, opened: Array, ahead: NDArray[np.bool_]) -> float:
    """By how much wheels usually differ per opening at one time, beside how each usually differs that way [ln]."""
    log = np.log(moved / opened)
    log = log - median_known(log, axis=1, keepdims=True)
    for way in (ahead, ~ahead):
        some = np.isfinite(log) & way
        usual = [float(median_of(x[k])) if k.any() else 0.0 for x, k in zip(log.T, some.T, strict=True)]
        log = np.where(some, log - np.array(usual), log)
    return float(quantile_of(median_known(np.abs(log), axis=1), _OFTEN))
