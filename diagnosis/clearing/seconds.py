"""Speeds beside their second measurements: of two healthy instruments one is evened more and comes later, on all wheels of a machine alike."""

from __future__ import annotations

import numpy as np

from diagnosis.clearing.cells import Array, Cells
from diagnosis.clearing.measure import behind, compared

_LAGS_S = (0.0, 0.05, 0.1, 0.15, 0.2, 0.3)  # of one instrument behind the other
_FOLLOWED = 0.8  # quantile of the windows: lag shows where speeds change
_WHEELS = 2  # fewer do not tell a lag of the machine's from one of a part


def off_second(cells: Cells, speed: Array, second: Array, floor: float) -> Array:
    """How far speeds are off their second measurements in each window, as `Compared.off` has it, behind the lag that all wheels share.

    That lag, of either instrument, is the one by which most wheels are off least; a wheel that is later than the others stays off.

    Parameters
    ----------
    cells : Cells
        The mission.
    speed, second : Array, shape (cells, wheels)
        Both measurements [m/s]; NaN where unknown.
    floor : float
        As of `compared`.

    Returns
    -------
    Array, shape (windows, wheels)
    """
    count = speed.shape[1]
    if not count:
        return np.zeros((cells.frame.starts.size, 0))
    tried = [(lag, 0.0) for lag in _LAGS_S] + [(0.0, lag) for lag in _LAGS_S[1:]]
    both = (np.isfinite(speed) & np.isfinite(second)).any(axis=0)
    if np.count_nonzero(both) < _WHEELS:
        tried = tried[:1]
    best, least = np.zeros((cells.frame.starts.size, count)), np.inf
    for of_second, of_speed in tried:
        y, x = behind(speed, cells.dt, of_speed), behind(second, cells.dt, of_second)
        off = np.column_stack([compared(cells, y[:, i], x[:, i], floor).off for i in range(count)])
        known = [float(np.nanquantile(z, _FOLLOWED)) for z in off[:, both].T if np.isfinite(z).any()]
        left = float(np.median(known)) if known else np.inf
        if left < least or not (of_second or of_speed):
            best, least = off, left
    return best
