"""What a step of a channel brings: a new sample beside its reference, silence, or nothing new."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Status = NDArray[np.int8]

#: Nothing new; both valid; y silent while its source lives; both valid, but x changes faster than the log resolves or is
#: missing beside y; a pair that is consistent with a healthy channel, so that no other model need be weighed.
SKIP, PAIR, SILENT, BLIND, CLEAR = range(5)

_EDGE_S = 0.1


def sample_status(y: Array, x: Array, fresh: NDArray[np.bool_], alive: NDArray[np.bool_], dt: float) -> Status:
    """Status of every step: `PAIR`, `SILENT` (a silent y beside living siblings), or `SKIP`.

    Parameters
    ----------
    y, x : Array, shape (n,)
        Measured value and reference; NaN where not valid.
    fresh : NDArray[np.bool_], shape (n,)
        Steps with a new sample of y.
    alive : NDArray[np.bool_], shape (n,)
        Whether another channel of y's source delivers.
    dt : float
        Step [s].
    """
    status = np.full(y.size, SKIP, dtype=np.int8)
    known = np.isfinite(y)
    status[fresh & known & np.isfinite(x)] = PAIR
    silent = ~known & alive
    edge = round(_EDGE_S / dt)
    for part in (slice(0, edge), slice(max(0, y.size - edge), y.size)):
        if not silent[part].all() or edge * 2 < y.size:
            silent[part] &= False
    status[silent] = SILENT
    return status
