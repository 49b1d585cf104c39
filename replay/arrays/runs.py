"""Runs of flags: stretches of neighbours for which something holds."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def runs_of(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First place of each run of true flags, and the place behind its last one, in order.

    Parameters
    ----------
    flags : NDArray[np.bool_], shape (n,)
        For each place, whether it holds.
    """
    edges = np.flatnonzero(np.diff(np.r_[False, flags, False].astype(np.int8))).tolist()
    return list(zip(edges[::2], edges[1::2], strict=True))
