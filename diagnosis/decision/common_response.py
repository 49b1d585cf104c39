"""What all wheels' speed per opening has in common, before and after a moment, at the same speeds or openings.

A controller that holds the speeds hides in them what all motors lose, and what all sensors read too little: it opens all valves further. Valves are no
straight lines, so that only what is driven as fast before as after is compared. Another load, oil or gear changes the same; no part is blamed for it.
While a wheel's fault is stated nothing is asked: the others drag it, or it drags them.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from diagnosis.clearing.cells import Array, Cells
from diagnosis.clearing.responses import responses_of
from replay.arrays.quantiles import median_known, median_of, quantile_of

_LEVEL = 0.12  # ln of the speed: as wide are speeds that are alike
_LEAST, _EACH = 20, 3  # windows before and after, in all, and at a level
_SPLITS = 40  # moments that are tried
_WHEELS, _KNOWN = 2, 0.5  # fewer have nothing in common; of the wheels
_LOW, _HIGH = 0.2, 0.8  # quantiles of the differences of all levels, which must agree


class Common(NamedTuple):
    """What the wheels have in common in each window, all of shape (windows,) but the ways.

    Attributes
    ----------
    response : Array
        ln of speed per opening, NaN where it is not known.
    levels : tuple[Array, Array]
        Speed [m/s] and opening [1] of the median wheel.
    ways : tuple[NDArray[np.bool_], NDArray[np.bool_]]
        Windows ahead and back.
    hop_s : float
        From one window to the next [s].
    """

    response: Array
    levels: tuple[Array, Array]
    ways: tuple[NDArray[np.bool_], NDArray[np.bool_]]
    hop_s: float


def common_change(cells: Cells, most: float) -> tuple[float, float] | None:
    """By how much all wheels' speed per opening changes at least at the same speeds, or openings [ln], and when [s].

    None where little is driven alike before and after. A controller that does not hold the speeds leaves the openings alike. What changes by more than
    `most` [ln] is left out.
    """
    common = common_of(cells)
    found = [
        (change[0], float(at[change[1]]) * common.hop_s)
        for by in (0, 1)
        for at, level in _driven(common, by)
        if (change := _largest(level, common.response[at])) is not None and abs(change[0]) <= most
    ]
    return max(found, key=lambda x: abs(x[0]), default=None)


def common_of(cells: Cells) -> Common:
    """What the wheels of a mission have in common."""
    return cells.once("common response", lambda: _of_all(cells))


def _of_all(cells: Cells) -> Common:
    speed, command, opening = (cells.wheels(leaf) for leaf in ("v", "u", "u_applied"))
    if len(cells.driven) < _WHEELS:
        nothing, never = np.full(cells.frame.starts.size, np.nan), np.zeros(cells.frame.starts.size, np.bool_)
        return Common(nothing, (nothing, nothing), (never, never), cells.frame.hop * cells.dt)
    used = np.where(np.isfinite(opening), opening, command)
    found = responses_of(cells, speed, used, cells.reference, over_time=False)
    own = found.own[:, cells.driven]
    known = np.isfinite(own).sum(axis=1) >= max(_WHEELS, _KNOWN * own.shape[1])
    common = np.full(len(own), np.nan)
    if known.any():  # wheels differ, and not all of them are known everywhere
        common[known] = median_known(own[known] - median_known(own[known], axis=0), axis=1)
    common[np.column_stack([cells.explained(wheel) for wheel in cells.machine.wheels]).any(axis=1)] = np.nan
    levels = cells.frame.mean(_median(speed)), cells.frame.mean(_median(used[:, cells.driven]))
    ways = np.asarray(found.ahead.all(axis=1)), np.asarray(~found.ahead.any(axis=1))
    return Common(common, levels, ways, cells.frame.hop * cells.dt)


def _driven(common: Common, by: int) -> Iterator[tuple[NDArray[np.intp], Array]]:
    """Windows of either way in which the response is known, and ln of their speed (0) or opening (1)."""
    level = np.nan_to_num(common.levels[by])
    for way in common.ways:
        at = np.flatnonzero(way & np.isfinite(common.response) & (level > 0.0))
        yield at, np.log(level[at])


def _median(speed: Array) -> Array:
    known = np.isfinite(speed).any(axis=1)
    out = np.full(len(speed), np.nan)
    out[known] = np.abs(median_known(speed[known], axis=1))
    return out


def _largest(level: Array, common: Array) -> tuple[float, int] | None:
    """Change at the same levels that nearly all of them agree on [ln], and the window from which on it is there; arrays of shape (windows,)."""
    n, places = common.size, np.floor(level / _LEVEL).astype(np.int64)
    bins = [np.flatnonzero(places == p) for p in np.unique(places)]
    best: tuple[float, float, int] | None = (
        None  # what medians of all levels before and after leave, the change, and the moment
    )
    for k in range(_LEAST, n - _LEAST + 1, max(1, n // _SPLITS)):
        changes, weights, before, left = [], [], 0, 0.0
        for inside in bins:
            parts = [common[inside[inside < k]], common[inside[inside >= k]]]
            left += sum(float(np.abs(x - median_of(x)).sum()) for x in parts if x.size)
            early, late = parts
            if min(early.size, late.size) >= _EACH:
                changes.append(float(median_of(late) - median_of(early)))
                weights.append(late.size)
                before += early.size
        if min(before, sum(weights)) >= _LEAST and (best is None or left < best[0]):
            low, high = quantile_of(np.repeat(changes, weights), (_LOW, _HIGH))
            best = left, 0.0 if low * high <= 0.0 else float(low if low > 0.0 else high), k
    return None if best is None else best[1:]
