"""Short spells in which a channel repeats one reading although its noise would have changed it: stuck at the raw rate.

A reading of a living sensor is its value plus noise, rounded. Even where the value rests in the middle of a rounding
step, the next reading is the same with probability p = erf(lsb / (√8·noise)) at most, and m readings in a row are with
p^(m−1). A spell counts where that is below `FALSE_SPELLS` for all readings of the mission together. Where the noise lies
below the rounding step a healthy sensor may rest for long, and nothing is told.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

FALSE_SPELLS = 1e-6  # expected number of spells in a healthy mission, at most
_LEAST = 5  # readings; fewer may be a recorder that wrote one twice
_GAP = 10  # times the usual distance of readings: what lies beyond is another spell


def shortest_spell(noise: float, lsb: float, readings: int) -> int | None:
    """Number of equal readings in a row that the noise of a healthy sensor does not explain.

    Parameters
    ----------
    noise, lsb : float
        Standard deviation of the noise before rounding, and the rounding step; in the channel's unit.
    readings : int
        Readings of the mission.

    Returns
    -------
    int or None
        None where the noise does not exceed the rounding step, so that no number does.
    """
    if noise <= lsb or readings < 1:
        return None
    same = math.erf(lsb / (math.sqrt(8.0) * noise))
    if same <= 0.0:
        return _LEAST
    return max(_LEAST, 1 + math.ceil(math.log(FALSE_SPELLS / readings) / math.log(same)))


def constant_spells(
    y: Array, fresh: NDArray[np.bool_], noise: float, lsb: float, dt: float, moving: NDArray[np.bool_]
) -> list[tuple[int, int, float]]:
    """Spells in which a moving machine's channel repeats one reading for longer than its noise allows.

    A sensor that updates more slowly than it is logged repeats every reading; a spell must then hold as many updates. It
    is found where it lasts longer than `shortest_spell` updates; shorter ones are neither found nor ruled out.

    Parameters
    ----------
    y : Array, shape (n,)
        Readings; NaN where there is none.
    fresh : NDArray[np.bool_], shape (n,)
        Steps with a new reading.
    noise, lsb : float
        Standard deviation of a healthy reading's noise, and the rounding step (0 for none); in the unit of y.
    dt : float
        Step [s].
    moving : NDArray[np.bool_], shape (n,)
        Where a healthy reading has its noise; a machine at rest may well read exactly 0.

    Returns
    -------
    list[tuple[int, int, float]]
        First sample, the one after the last, and the repeated reading, in order of time. Beyond the last reading a spell
        lasts one usual distance of readings, or to the next one.

    Raises
    ------
    ValueError
        Where the shapes differ, or noise, lsb or dt is negative or not finite.
    """
    if not y.shape == fresh.shape == moving.shape or y.ndim != 1:
        raise ValueError(f"y, fresh and moving have shapes {y.shape}, {fresh.shape}, {moving.shape}; expected one (n,)")
    if not (math.isfinite(noise) and math.isfinite(lsb) and noise >= 0 and lsb >= 0 and dt > 0):
        raise ValueError(f"noise {noise}, lsb {lsb} and dt {dt} must be finite, not negative, and dt above 0")
    place = np.flatnonzero(fresh & np.isfinite(y))
    if place.size < 2:
        return []
    apart = np.diff(place)
    usual = float(np.median(apart))
    value, live = y[place], moving[place]
    changed = (np.abs(np.diff(value)) > 0.5 * lsb) | (apart > _GAP * usual) | (live[1:] != live[:-1])
    first = np.flatnonzero(np.r_[True, changed])
    count = np.diff(np.r_[first, place.size])
    kept = live[first]
    first, count = first[kept], count[kept]
    if not first.size:
        return []
    # readings per update, as most runs have it; noise alone repeats a reading now and then
    hold = max(1, int(np.median(count)))
    least = shortest_spell(noise, lsb, int(count.sum()) // hold)
    if least is None:
        return []
    long = count >= least * hold
    last = first[long] + count[long] - 1
    following = np.r_[place[1:], place[-1] + max(1, round(usual))]
    stop = np.minimum(following[last], np.minimum(place[last] + max(1, round(usual)), y.size))
    return [(int(a), int(b), float(v)) for a, b, v in zip(place[first[long]], stop, value[first[long]], strict=True)]
