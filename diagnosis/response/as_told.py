"""Whether a wheel does what it is told after all: as another one that is told the same, or by a share of it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.inputs import cells
from diagnosis.response.machine import Judged

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_TOLD_ALIKE, _CLOSER = 0.02, 0.5  # of the top speed; of the misfit beside the command


def in_share(y: Array, asked: Array, gain: float) -> bool:
    """Whether a share of what is asked explains a speed better than one value does. Both of shape (k,)."""
    return bool(np.sum((y - gain * asked) ** 2) < np.sum((y - np.median(y)) ** 2))


def with_another(one: Judged, others: Sequence[Judged], off: Array, top: float) -> Flags:
    """Blocks in which a wheel does what another one does that is told the same and follows: its own command makes it no other speed.

    `off`: how far it is from what its command seems to make of it [m/s], shape (b,); `top` in m/s.
    """
    width = int(one.wheel.blocks.start[1]) if one.wheel.blocks.start.size > 1 else 1
    asked = cells(one.data.asked, width)
    out = np.zeros(off.size, np.bool_)
    for other in others:
        told = np.abs(asked - cells(other.data.asked, width)) < _TOLD_ALIKE * top
        apart = np.abs(one.wheel.blocks.mean - other.wheel.blocks.mean)
        out |= told & (np.nan_to_num(apart, nan=np.inf) < _CLOSER * off)
    return out
