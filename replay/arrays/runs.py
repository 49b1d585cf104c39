"""Runs of flags: stretches of neighbours for which something holds."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

Place = TypeVar("Place", int, float)


def runs_of(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First place of each run of true flags, and the place behind its last one, in order.

    Parameters
    ----------
    flags : NDArray[np.bool_], shape (n,)
        For each place, whether it holds.
    """
    edges = np.flatnonzero(np.diff(np.r_[False, flags, False].astype(np.int8))).tolist()
    return list(zip(edges[::2], edges[1::2], strict=True))


def united(spans: Iterable[tuple[Place, Place]]) -> list[tuple[Place, Place]]:
    """Spans in their order, those that touch or overlap as one.

    Parameters
    ----------
    spans : Iterable[tuple[Place, Place]]
        Start and stop of each, in any one unit.
    """
    out: list[tuple[Place, Place]] = []
    for start, stop in sorted(spans):
        if out and start <= out[-1][1]:
            out[-1] = out[-1][0], max(stop, out[-1][1])
        else:
            out.append((start, stop))
    return out
