"""A drive keeps to its command, but other channels show another speed: one of them is wrong, or tyres slip, and nothing says which."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.machine import Judged

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_MISFITS, _SHARE = 3.0, 0.2  # usual misfits, and share of the speed, from which on two speeds are two
_NOBODY = 0.3  # of a misfit
_AROUND_S, _MOSTLY = 2.0, 0.5  # over which, and in how much of that


def disputed(one: Judged, block_s: float) -> Flags:
    """Blocks in which a drive reads another speed than the channels beside it, for which nobody is to blame, shape (b,): it is not healthy there.

    For the only drive these are sensors of the body, for others the other wheels. A loop around a wrong encoder holds the reading at its command, so that the command does not tell which of the two is right.

    Parameters
    ----------
    one : Judged
        The wheel.
    block_s : float
        Length of a block [s].
    """
    y = one.wheel.blocks.mean
    if one.view is None or (one.view.nobody is None and not one.alone):
        return np.zeros(y.size, np.bool_)
    apart = np.nan_to_num(np.abs(y - one.view.speed))
    larger = np.maximum(np.abs(np.nan_to_num(y)), np.abs(np.nan_to_num(one.view.speed)))
    off = (apart > _MISFITS * np.nan_to_num(one.view.noise, nan=np.inf)) & (apart > _SHARE * larger)
    if one.view.nobody is not None:
        off &= one.view.nobody > _NOBODY
    width = max(1, round(_AROUND_S / block_s))
    return np.asarray(np.convolve(off, np.ones(width) / width, mode="same") > _MOSTLY)
