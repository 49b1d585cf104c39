"""What all wheels' speed per opening has in common in a spell, beside the rest of the mission at the same speeds and openings.

What wheels give per opening goes with how fast they drive: valves have dead bands, and curves. So each spell is left out, and held against what the
rest of the mission gives there: ln ν = c_± + a·ln x + b/x of the speed, or the opening, x as a share of its largest, with c_± of driving ahead and back.
What a spell alone drives, in its way or at its speed, is so held against what is nearest to it, and not against itself.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.clearing.cells import Array, Cells
from diagnosis.decision.common_response import common_of
from replay.arrays.quantiles import median_known

Flags = NDArray[np.bool_]
Places = NDArray[np.intp]

SPELLS_S = 4.0, 15.0
_IN, _OUT, _BESIDE_S = (
    0.7,
    2.0,
    2.5,
)  # known of it; times its length, known elsewhere; left out on either side, where windows share its time
_COMPARED, _REACH = 0.5, 1.1  # of a spell, at speeds and openings up to so many times those of the rest of the mission
_LEAST = 0.03  # of the largest speed or opening
_BOTH = 2.0  # times its length, that each way is known elsewhere: else both are held to be alike
_ALIKE, _FREE = 1e3, 1e-6  # how much ahead and back are alike where one of both is hardly known, and else
_FAR = 3.0  # times what the rest is off its own curve, root mean square: gears, too, make several curves of one
_LEVEL = 1e-3, 1e-5  # per window, how much slope and curvature are held to none


def common_spell(cells: Cells) -> tuple[float, float, float] | None:
    """By how much all wheels' speed per opening is off the rest of the mission's for some seconds at most [ln], and their span [s].

    At the same speeds and at the same openings, whichever is less. None where no spell can be compared. What differs may as well be what is usual, and
    the rest be what has changed.
    """
    common = common_of(cells)
    response, (ahead, back) = common.response, common.ways
    use = np.isfinite(response) & (ahead | back)
    shares = [_share(np.where(use, x, np.nan)) for x in common.levels]
    for share in shares:
        use &= np.nan_to_num(share) > _LEAST
    if not use.any():
        return None
    middle = float(median_known(response[use]))
    best: tuple[float, float, float] | None = None
    for length in SPELLS_S:
        long, beside = (max(1, round(s / common.hop_s)) for s in (length, _BESIDE_S))
        if len(response) < long:
            continue
        by_speed, by_opening = (beside_the_rest(response - middle, x, use, ahead, long, beside) for x in shares)
        alike = np.sign(by_speed) * np.sign(by_opening) > 0.0
        off = np.where(alike, np.where(np.abs(by_speed) < np.abs(by_opening), by_speed, by_opening), 0.0 * by_speed)
        if np.isfinite(off).any():
            k = int(np.nanargmax(np.abs(off)))
            if best is None or abs(off[k]) > abs(best[0]):
                best = float(off[k]), k * common.hop_s, (k + long) * common.hop_s
    return best


def beside_the_rest(response: Array, x: Array, use: Flags, ahead: Flags, long: int, beside: int) -> Array:
    """Mean of what spells are off the curve of the rest of the mission [ln], of shape (spells,), by their first windows.

    0 where the rest itself is as far off, NaN where too little is known.

    Parameters
    ----------
    response : Array, shape (windows,)
        ln of speed per opening.
    x : Array, shape (windows,)
        What it goes with [1].
    use, ahead : NDArray[np.bool_], shape (windows,)
        Windows in which both are known, and those of driving ahead.
    long, beside : int
        Windows of a spell, and those that are left out on either side.
    """
    count = len(x)
    at, y = np.where(use, x, 1.0), np.where(use, response, 0.0)
    terms = np.column_stack([ahead, ~ahead, np.log(at), 1.0 / at]) * use[:, np.newaxis]
    squares = (terms[:, :, np.newaxis] * terms[:, np.newaxis]).reshape(count, -1)
    sums = _summed(np.column_stack([squares, terms * y[:, np.newaxis], use, use & ahead, use & ~ahead, y**2]))
    first = np.arange(count - long + 1)
    before, after = np.maximum(first - beside, 0), np.minimum(first + long + beside, count)
    rest = sums[-1] - sums[after] + sums[before]
    outside, each_way = rest[:, 20], rest[:, 21:23].min(axis=1)
    inside = sums[first + long, 20] - sums[first, 20]
    out = np.full(first.size, np.nan)
    asked = np.flatnonzero((inside >= _IN * long) & (outside >= _OUT * long))
    if not asked.size:
        return out
    squares, products = rest[asked, :16].reshape(-1, 4, 4), rest[asked, 16:20, np.newaxis]
    curve = np.linalg.solve(_held(squares, outside[asked], each_way[asked] < _BOTH * long), products)
    fitted = (curve * (squares @ curve - 2.0 * products)).sum(axis=(1, 2))
    scatter = np.sqrt(np.maximum(rest[asked, 23] + fitted, 0.0) / outside[asked])
    spells = asked[:, np.newaxis] + np.arange(long)
    low, high = (
        sign * _least_outside(np.where(use, sign * x, np.inf), before, after)[asked, np.newaxis] for sign in (1.0, -1.0)
    )
    here = use[spells] & (x[spells] >= low / _REACH) & (x[spells] <= high * _REACH)
    off = y[spells] - (terms[spells] @ curve)[..., 0]
    many = here.sum(axis=1)
    mean = np.where(many >= _COMPARED * long, np.where(here, off, 0.0).sum(axis=1) / np.maximum(many, 1), np.nan)
    out[asked] = np.where(np.abs(mean) < _FAR * scatter, 0.0 * mean, mean)
    return out


def _held(squares: Array, windows: Array, one_way: Flags) -> Array:
    """Normal equations (spells, 4, 4) held to one level of both ways where one is hardly known, and to gentle curves."""
    matrix = squares.copy()
    same = np.where(one_way, _ALIKE, _FREE)
    for i, j, sign in ((0, 0, 1.0), (1, 1, 1.0), (0, 1, -1.0), (1, 0, -1.0)):
        matrix[:, i, j] += sign * same
    for k, level in enumerate(_LEVEL, 2):
        matrix[:, k, k] += level * windows
    matrix[:, [0, 1], [0, 1]] += 1e-9
    return matrix


def _share(x: Array) -> Array:
    """Of its largest value [1], shape (windows,)."""
    return np.asarray(x / np.nanmax(x)) if np.isfinite(x).any() else x


def _least_outside(x: Array, before: Places, after: Places) -> Array:
    """Least value of shape (windows,) outside each spell, shape (spells,)."""
    from_start = np.concatenate([[np.inf], np.minimum.accumulate(x)])
    to_end = np.concatenate([np.minimum.accumulate(x[::-1])[::-1], [np.inf]])
    return np.asarray(np.minimum(from_start[before], to_end[after]))


def _summed(x: Array) -> Array:
    """Sums of the first rows, from none on, shape (windows + 1, …)."""
    return np.concatenate([np.zeros((1, x.shape[1])), np.cumsum(x, axis=0, dtype=np.float64)])
