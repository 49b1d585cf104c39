"""Whether a wheel that reads something stands nevertheless: its position says so, or its readings cancel each other."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.channels.standstill import STILL
from diagnosis.response.inputs import FollowerData

Array = NDArray[np.float64]

_PIECE_S, _LEAST = 1.0, 4  # over which readings are put together, and readings that it takes
_ERRORS = 3.0  # standard errors of a median
_OF_MEDIAN = 1.25  # its standard error by that of a mean
_ASKED = 0.3  # of what is asked: what is left open by the noise must be less
_SAME, _MOVES = (0.8, 1.25), 1.0  # of a speed that is its position's slope, where it moves: driving speeds
_LEAST_MOVING_S = 10.0
_MOSTLY = 0.8  # of the pieces


def goes_nowhere(data: FollowerData, part: slice, driving_speed: float, dt: float) -> bool:
    """Whether a wheel makes no way in some steps, although its command asks for it.

    Its position stands, or the median of its readings differs from 0 by no more than their own noise allows, second by second: noise,
    wild readings and counts that flicker come to nothing, a share of a speed does not.

    Parameters
    ----------
    data : FollowerData
        The wheel.
    part : slice
        The steps.
    driving_speed : float
        Commanded speed from which a drive is driving [m/s].
    dt : float
        Step [s].
    """
    least, piece = STILL * driving_speed, max(1, round(_PIECE_S / dt))
    by_position = _position_is_right(data, part, driving_speed, dt)
    stands, known = 0, 0
    for start in range(part.start, part.stop - piece // 2, piece):
        now = slice(start, min(start + piece, part.stop))
        asked = float(np.nanmedian(np.abs(data.asked[now]))) if np.isfinite(data.asked[now]).any() else 0.0
        known += 1
        if by_position and data.rolled is not None:
            stands += bool(np.nanmedian(np.abs(data.rolled[now])) <= least)
            continue
        y = data.y[now][data.fresh[now] & np.isfinite(data.y[now])]
        if y.size < _LEAST:
            continue
        white = (y[2:] - 2.0 * y[1:-1] + y[:-2]) / np.sqrt(6.0)
        open_ = _ERRORS * _OF_MEDIAN * float(np.sqrt(np.mean(white**2) / y.size))
        stands += abs(float(np.median(y))) <= min(least + open_, max(_ASKED * asked, least))
    return known > 0 and stands >= _MOSTLY * known


def _position_is_right(data: FollowerData, part: slice, driving_speed: float, dt: float) -> bool:
    """Whether a wheel's position shows its motion at other times, and what it does in these."""
    if data.rolled is None or not np.isfinite(data.rolled[part]).any():
        return False
    moves = np.abs(np.nan_to_num(data.y)) > _MOVES * driving_speed
    moves[part] = False
    moves &= np.isfinite(data.rolled)
    if np.count_nonzero(moves) * dt < _LEAST_MOVING_S:
        return False
    share = float(np.median(np.abs(data.rolled[moves]))) / float(np.median(np.abs(data.y[moves])))
    return _SAME[0] < share < _SAME[1]
