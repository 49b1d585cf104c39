"""The only drive keeps to its command, but a sensor of the body shows another speed: one of the two is wrong, and nothing says which."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.machine import Judged

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_MISFITS, _SHARE = 3.0, 0.2  # usual misfits, and share of the speed, from which on two speeds are two
_AROUND_S, _MOSTLY = 2.0, 0.5  # over which, and in how much of that


def disputed(one: Judged, block_s: float) -> Flags:
    """Blocks in which the only drive reads another speed than a sensor of the body, shape (b,): it is not called healthy there.

    A loop around a wrong encoder holds the reading at its command, so that the command does not tell which of the two is right.

    Parameters
    ----------
    one : Judged
        The wheel.
    block_s : float
        Length of a block [s].
    """
    y = one.wheel.blocks.mean
    if not one.alone or one.view is None:
        return np.zeros(y.size, np.bool_)
    apart = np.nan_to_num(np.abs(y - one.view.speed))
    larger = np.maximum(np.abs(np.nan_to_num(y)), np.abs(np.nan_to_num(one.view.speed)))
    off = (apart > _MISFITS * np.nan_to_num(one.view.noise, nan=np.inf)) & (apart > _SHARE * larger)
    width = max(1, round(_AROUND_S / block_s))
    return np.asarray(np.convolve(off, np.ones(width) / width, mode="same") > _MOSTLY)
