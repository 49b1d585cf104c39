"""The static map of a valve: speed over opening, with dead band, a gain of each direction, saturation and hysteresis.

A map is a sum of ramps between fixed openings with slopes that are not negative, so that it is monotone; hysteresis is the
play of the spool before it (Prandtl–Ishlinskii with one operator).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from replay.arrays.compiling import njit
from replay.arrays.copying import put
from replay.arrays.numeric import without_nan
from replay.machine.config import WheelPlant

Array = NDArray[np.float64]

#: Openings between which the map is linear, the same in reverse [fraction].
KNOTS: Array = np.array([0.0, 0.02, 0.04, 0.07, 0.12, 0.2, 0.4, 0.7, 1.0])
RAMPS = 2 * (KNOTS.size - 1)


@njit(cache=True)
def _play(u: Array, half: float, held: float, out: Array) -> float:
    """Spool behind a play of 2·half; returns where it stands at the end."""
    for k in range(u.size):
        held = min(max(held, u[k] - half), u[k] + half)
        out[k] = held
    return float(held)


def played(u: Array, hysteresis: float, held: float | None = None) -> tuple[Array, float]:
    """Spool position behind its play, shape (n,), and where it stands at the end; `held` is where it stood before.

    Parameters
    ----------
    u : Array, shape (n,)
        Commanded opening [fraction]; NaN counts as 0.
    hysteresis : float
        Width of the play [fraction].
    """
    filled = np.ascontiguousarray(without_nan(u), np.float64)
    start = (float(filled[0]) if filled.size else 0.0) if held is None else held
    if hysteresis <= 0:
        return filled, float(filled[-1]) if filled.size else start
    out = np.empty_like(filled)
    return out, float(_play(filled, hysteresis / 2, start, out))


@njit(cache=True)
def lagged_ramps(u: Array, knots: Array, fade: float, every: int, out: Array) -> None:
    """Responses of a first-order lag to every ramp of the opening; writes each `every`-th one into `out` (m, ramps).

    `u` of shape (n,) and `knots` in fractions of full opening; `fade` is the lag's factor per step [1].
    """
    half = knots.size - 1
    state = np.zeros(2 * half)
    for k in range(u.size):
        x = u[k]
        if k % every == 0 and k // every < out.shape[0]:
            put(out[k // every], state)
        for j in range(half):
            high = knots[j + 1] - knots[j]
            forward = min(max(x - knots[j], 0.0), high)
            reverse = -min(max(-x - knots[j], 0.0), high)
            if k == 0:
                state[j], state[half + j] = forward, reverse
            else:
                state[j] = fade * state[j] + (1.0 - fade) * forward
                state[half + j] = fade * state[half + j] + (1.0 - fade) * reverse


def effective(u: Array, plant: WheelPlant, held: float | None = None) -> tuple[Array, Array, float]:
    """Opening that a linear valve of gain K would need for the same speed, and how far that may lie too low.

    Parameters
    ----------
    u : Array, shape (n,)
        Commanded opening [fraction]; NaN counts as 0.
    plant : WheelPlant
        The wheel; one without a map has a dead zone alone.
    held : float or None
        Where the spool stood before.

    Returns
    -------
    opening, unseen : Array, shape (n,)
        Effective opening [fraction], and by how much more it may be where no healthy wheel was seen [fraction].
    held : float
        Where the spool stands at the end.
    """
    if not plant.openings:
        filled = without_nan(u)
        opening = np.sign(filled) * np.maximum(np.abs(filled) - plant.dead, 0.0)
        return opening, np.zeros(opening.size), 0.0
    spool, held = played(u, plant.hysteresis, held)
    opening = np.interp(spool, plant.openings, plant.speeds) / plant.K
    unseen = np.interp(spool, plant.openings, plant.unseen) / plant.K if plant.unseen else np.zeros(opening.size)
    return opening, unseen, held
