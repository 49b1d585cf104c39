"""Noise of a channel that lasts for a good part of a mission: no other wheel need show what is usual, for the mission has two levels in time.

What a channel changes by from sample to sample depends on speed and ground, by far less than a fault's noise makes of it; that begins at one
moment, and ends at one or never. So the quieter of two levels is the usual one where each has long times of its own.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.models import Blocks
from replay.arrays.sliding import median_within

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_LOUDER = 4.0  # times the quiet level: more than ground and speed make of it
_LEAST_S, _LEAST = 8.0, 0.15  # of moving in each level, and of all of it
_LIKEWISE = 2.0  # times the quiet level: so much louder another wheel is meanwhile where ground or speed make it
_SWITCHES = 2  # a spell of noise has a beginning and an end
_APART = 0.1  # of the blocks of a level may be at the other one
_MEDIAN = 9  # blocks, of which the median is looked at


def quiet_level(blocks: Blocks, driving: Flags, block_s: float, others: Sequence[Array] = ()) -> Array:
    """What usually changes from sample to sample in a channel [m/s], shape (b,): as before, or less where a mission has two levels that no other wheel has.

    Parameters
    ----------
    blocks : Blocks
        Of the channel.
    driving : Flags, shape (b,)
        Where it drives.
    block_s : float
        Length of a block [s].
    others : Sequence[Array], each of shape (b,)
        The same of other wheels, whatever is usual in them: what changes from sample to sample [m/s].
    """
    use = np.flatnonzero(
        driving & (blocks.readings > 2) & (blocks.rough > 0.0) & ~blocks.held & (blocks.zero < blocks.readings)
    )
    least = max(round(_LEAST_S / block_s), round(_LEAST * use.size))
    if use.size < 2 * least or least < _MEDIAN:
        return blocks.usual
    level = np.log(blocks.rough[use])
    loud = _split(level, least)
    if loud is None:
        return blocks.usual
    quiet, noisy = (float(np.median(level[x])) for x in (~loud, loud))
    middle = 0.5 * (quiet + noisy)
    astray = max(float(np.mean(level[~loud] > middle)), float(np.mean(level[loud] < middle)))
    if noisy - quiet < np.log(_LOUDER) or astray > _APART:
        return blocks.usual
    if any(np.median(x[use][loud]) > _LIKEWISE * np.median(x[use][~loud]) for x in others):
        return blocks.usual  # ground, or speed
    ceiling = float(np.quantile(blocks.rough[use][~loud], 0.9))
    return np.minimum(blocks.usual, ceiling)


def _split(level: Array, least: int) -> Flags | None:
    """Blocks of the louder level by one beginning and one end at most, shape (m,); None where a level is too short for it."""
    smooth = median_within(level, _MEDIAN // 2)
    low, high = (float(np.quantile(smooth, q)) for q in (_LEAST / 2, 1.0 - _LEAST / 2))
    loud = _without_short(smooth > 0.5 * (low + high))
    if np.count_nonzero(np.diff(loud.astype(np.int8))) > _SWITCHES:
        return None
    number = int(np.count_nonzero(loud))
    return loud if least <= number <= level.size - least else None


def _without_short(loud: Flags) -> Flags:
    """Flags, shape (m,), without runs of fewer than `_MEDIAN` blocks, the shortest first: a second at the end of a mission is no level."""
    out = loud.copy()
    while True:
        edges = np.flatnonzero(np.diff(out.astype(np.int8))) + 1
        bounds = np.r_[0, edges, out.size]
        lengths = np.diff(bounds)
        shortest = int(np.argmin(lengths))
        if lengths.size < 2 or lengths[shortest] >= _MEDIAN:
            return out
        part = slice(int(bounds[shortest]), int(bounds[shortest + 1]))
        out[part] = ~out[part]
