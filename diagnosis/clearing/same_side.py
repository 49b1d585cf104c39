"""Speed per opening of the two wheels of one side beside each other: they roll alike in turns, which those of two sides do not."""

from __future__ import annotations

import numpy as np

from diagnosis.clearing.cells import Array, Cells
from diagnosis.clearing.measure import alone
from diagnosis.clearing.responses import Responses, largest

_PAIR = 2  # wheels of a side, and sides
_LEAST_WINDOWS = 5  # of one way, from which on it has a usual one
#: From here on a pair that deviates counts [ln], and from so many times the other side's pair: of 4000 logs with faults this alone kept in none that was less
#: than 1.8 times beyond 3.5 times. Healthy machines that are cleared had 0.07 where
#: the other side had 0.011, else 2.2 times as much (14 machines, 56 tuning missions; of those that are not cleared 4 times).
_LEAST, _ALONE = 0.1, 4.2


def beside_its_side(cells: Cells, responses: Responses) -> dict[int, tuple[Array, float]]:
    """By how much each wheel's speed per opening departs from that of the other wheel of its side, as it usually is, and the limit [ln].

    By the wheel's place among the machine's wheels, arrays of shape (windows,); empty where a side has not two wheels.

    Parameters
    ----------
    cells : Cells
        The mission.
    responses : Responses
        Of all wheels.
    """
    geometry = cells.machine.geometry
    if geometry is None:
        return {}
    wheels = [geometry.wheels[w] for w in cells.machine.wheels]
    places = [w.y + w.offset for w in wheels]  # turntables have all joints in the middle
    sides = [[i for i, y in enumerate(places) if (y > 0.0) is left and y != 0.0] for left in (True, False)]
    if any(len(side) != _PAIR for side in sides):
        return {}
    departs = np.column_stack([_departs(responses, *side) for side in sides])
    most = [float(x) for x in largest(departs)]
    return {
        i: (departs[:, k], alone(most, k, np.inf, _LEAST, _ALONE, others=1))
        for k, side in enumerate(sides)
        if np.isfinite(most[1 - k])
        for i in side
    }


def _departs(responses: Responses, i: int, j: int) -> Array:
    """Difference of two wheels' speeds per opening from its median of driving forward, or back, shape (windows,)."""
    apart, ahead = responses.own[:, i] - responses.own[:, j], responses.ahead[:, i]
    out = np.full(apart.shape, np.nan)
    for way in (ahead, ~ahead):
        known = way & np.isfinite(apart)
        if np.count_nonzero(known) >= _LEAST_WINDOWS:
            out[known] = np.abs(apart[known] - np.median(apart[known]))
    return out
