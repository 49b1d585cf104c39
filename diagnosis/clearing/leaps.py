"""Single readings that leave those beside them, and where such events follow each other."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.clearing.cells import Array, Cells

_GAP_S = 5.0  # between leaps of one fault


def heights(before: Array, after: Array) -> Array:
    """By how much single readings leave both of their neighbours, shape (n,): 0 where they lie between them, as steps and ramps do.

    Parameters
    ----------
    before, after : Array, shape (n,)
        A reading less the one before it, and less the one after it, in its unit.
    """
    return np.where(before * after > 0.0, np.minimum(np.abs(before), np.abs(after)), 0.0)


def longest_series(wheel: str, cells: Cells, at: NDArray[np.intp], height: Array) -> tuple[NDArray[np.intp], Array]:
    """The series of most leaps, no fault of the wheel being stated there, none of which comes long after the one before it.

    Parameters
    ----------
    wheel : str
        The wheel.
    cells : Cells
        The mission.
    at, height : Array, shape (k,)
        Samples at which something leaps, and by how much.

    Returns
    -------
    at, height : Array, shape (j,)
        Of the series.
    """
    if not at.size:
        return at, height
    told = cells.told(wheel)[np.minimum(at // cells.width, cells.size - 1)]
    at, height = at[~told], height[~told]
    edges = np.flatnonzero(np.diff(at) * cells.timeline.dt > _GAP_S) + 1
    start, stop = max(zip([0, *edges], [*edges, at.size], strict=True), key=lambda s: s[1] - s[0])
    return at[start:stop], height[start:stop]
