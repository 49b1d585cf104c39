"""Back-pointers of a most probable path, and the way back along them."""

from __future__ import annotations

import numpy as np

from replay.arrays.compiling import njit

#: Back-pointer of a model that goes on.
STAY = 255


@njit(cache=True)
def trace(back, last):  # type: ignore[no-untyped-def]
    """Follow back-pointers from the last model; also marks samples at which a model was entered."""
    n = back.shape[0]
    path = np.empty(n, dtype=np.uint8)
    entered = np.zeros(n, dtype=np.bool_)
    m = last
    for k in range(n - 1, -1, -1):
        path[k] = m
        if back[k, m] != STAY:
            entered[k] = True
            m = back[k, m]
    return path, entered
