"""Debouncing of flags that noise makes flicker."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Flags = NDArray[np.bool_]

FLICKER_S = 0.1  # neither standstill nor slip is a state of milliseconds


def debounced(flags: Flags, gap: int, least: int) -> Flags:
    """Flags without short gaps and, after that, without short runs.

    Parameters
    ----------
    flags : NDArray[np.bool_], shape (n,)
        What flickers with the noise.
    gap : int
        Gaps between two runs that are shorter [samples] are filled.
    least : int
        Runs that are shorter [samples] are dropped.
    """
    edge = np.flatnonzero(np.diff(np.concatenate([[0], flags.view(np.int8), [0]])))
    start, stop = edge[::2], edge[1::2]
    apart = start[1:] - stop[:-1] >= gap
    start, stop = start[np.r_[True, apart][: start.size]], stop[np.r_[apart, True][: stop.size]]
    long = stop - start >= least
    change = np.zeros(flags.size + 1, np.int8)
    change[start[long]] += 1
    change[stop[long]] -= 1
    return np.asarray(np.cumsum(change[:-1], dtype=np.int8).view(np.bool_))
