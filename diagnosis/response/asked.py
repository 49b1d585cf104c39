"""Where a wheel must move, by its command or by what else shows its speed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.answering import MOVES
from diagnosis.response.machine import Judged
from replay.machine.config import Limits

Flags = NDArray[np.bool_]


def asked_of(one: Judged, limits: Limits) -> Flags:
    """Blocks in which the wheel must move, by its command or by another view, shape (b,).

    Where it has a command only a view of this very wheel counts beside it: one that stands as it is told does nothing wrong.

    Parameters
    ----------
    one : Judged
        The wheel.
    limits : Limits
        ``driving_speed``.
    """
    blocks, least = one.wheel.blocks, MOVES * limits.driving_speed
    asked = (blocks.low > least) | (blocks.high < -least)
    if one.speed is None or (one.response.answered and not one.wheel.own):
        return asked
    return asked | (np.abs(np.nan_to_num(one.speed)) > least)
