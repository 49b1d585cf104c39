"""When a wheel reads as usual, where for a good part of the mission, or for most of it, it does not: what lasts longest is no norm by that.

A speed is the slope of its own joint's position, and a wheel makes of its command what the others make of theirs. Where one stretch of the
mission has it so, and another one has another share, that other one is what has changed; constants are found with its readings brought back.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.identification import as_another
from diagnosis.response.inputs import FollowerData, cells
from diagnosis.response.machine import Judged, unlike_others
from diagnosis.response.models import BLOCK_S

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_LEAST_BLOCKS, _LEAST_SOUND = 80, 40  # of driving in all, and where the share is 1
_LEAST_PART = 0.35  # of the driving that is odd: robust fits outvote less
_MOVES = 0.3  # of the usual speed
_SOUND, _OTHER = 0.05, 0.1  # by which a share may differ from 1, and must at least where it is another one
_NEAR = 0.1  # of that other share
_MOSTLY = 0.8  # of the driving that the two explain
_SMOOTH_BLOCKS, _FEW = 21, 6  # of driving, whose majority counts; changes from one to the other
_CALM = 0.15  # of the speed that a command may leave open where it is held against a reading


def shares_by_positions(data: Mapping[str, FollowerData], dt: float) -> dict[str, Array]:
    """Share of its joint's position that a speed is [1], 1 where it is as usual, of wheels of which that is 1 only for a time.

    Parameters
    ----------
    data : Mapping[str, FollowerData]
        All drives.
    dt : float
        Step [s].

    Returns
    -------
    dict[str, Array], each of shape (n,)
    """
    width = max(1, round(BLOCK_S / dt))
    out = {}
    for w, d in data.items():
        share = None if d.rolled is None else _shares(cells(d.y, width), cells(d.rolled, width))
        if share is not None:
            out[w] = np.repeat(share, width)[: d.y.size]
    return out


def shares_by_commands(found: Mapping[str, Judged], width: int) -> dict[str, Array]:
    """Share of what the others make of their commands that a wheel makes of its own [1], of wheels of which that is 1 only for a time.

    Parameters
    ----------
    found : Mapping[str, Judged]
        All wheels, each with the response that explains most of its mission.
    width : int
        Steps of a block.

    Returns
    -------
    dict[str, Array], each of shape (n,)
    """
    out = {}
    unlike = unlike_others(found)
    for w in unlike:
        one, size = found[w], found[w].data.y.size
        cell = -(-size // len(one.data.commands))
        others = sorted((o for o in found if o != w), key=lambda o: o in unlike)
        for other in (found[o].response for o in others):
            if other.weights.size != one.response.weights.size:
                continue
            way = np.sign(one.response.weights * other.weights)
            made = as_another(other, one.data.commands, way, cell * one.wheel.dt)
            low, high = (cells(np.repeat(x, cell)[:size], width) for x in (made.low, made.high))
            calm = high - low < _CALM * np.abs(high + low)
            share = _shares(one.wheel.blocks.mean, np.where(calm, 0.5 * (low + high), np.nan))
            if share is not None:
                out[w] = np.repeat(share, width)[:size]
            break
    return out


def as_usual(mean: Array, share: Array | None, width: int) -> Array:
    """Readings of blocks as they would be were they as usual [m/s], shape (b,).

    Parameters
    ----------
    mean : Array, shape (b,)
        As they are [m/s].
    share : Array or None, shape (n,)
        What they are of the usual ones [1]; None for 1.
    width : int
        Steps of a block.
    """
    return mean if share is None else mean / cells(share, width)[: mean.size]


def _shares(y: Array, x: Array) -> Array | None:
    """Share of x that y is in each block [1], where it is 1 in some and one other in the rest; None where it is not so. All of shape (b,)."""
    use = np.isfinite(y) & np.isfinite(x)
    if not use.any():
        return None
    places = np.flatnonzero(use & (np.abs(x) > _MOVES * float(np.quantile(np.abs(x[use]), 0.9))))
    ratio = y[places] / x[places]
    if ratio.size < _LEAST_BLOCKS:
        return None
    sound = np.abs(ratio - 1.0) < _SOUND
    if np.count_nonzero(sound) < _LEAST_SOUND or sound.all():
        return None
    other = float(np.median(ratio[~sound]))
    near = ~sound & (np.abs(ratio - other) < _NEAR * abs(other))
    if abs(other - 1.0) < _OTHER or other <= 0.0 or np.mean(sound | near) < _MOSTLY:
        return None
    odd = np.convolve(np.where(near, 1.0, -1.0), np.ones(_SMOOTH_BLOCKS), mode="same") > 0.0
    if np.count_nonzero(np.diff(odd.astype(np.int8))) > _FEW or np.mean(odd) < _LEAST_PART or odd.all():
        return None
    between = 0.5 * (places[1:] + places[:-1])  # from there on the later one is nearer
    return np.where(odd[np.searchsorted(between, np.arange(y.size))], other, 1.0)
