"""What all wheels' speed per opening has in common, before and after a moment or in a spell, at the same speeds or openings.

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
from replay.arrays.quantiles import median_known, median_of, quantile_known, quantile_of

_LEVEL = 0.12  # ln of the speed: as wide are speeds that are alike
_LEAST, _EACH = 20, 3  # windows before and after, in all, and at a level
_SPLITS = 40  # moments that are tried
_WHEELS, _KNOWN = 2, 0.6  # fewer have nothing in common; of the wheels
_LOW, _HIGH = 0.2, 0.8  # quantiles of the differences of all levels, which must agree
_SPELL_S, _FULL = 5.0, 0.6  # and of its windows, in which the response is known
#: Windows at a level; ln that half of them are off its usual one, where levels explain what is usual; and times that, elsewhere.
_ALIKE, _FITS, _FAR = 4, 0.03, 4.0


class _Common(NamedTuple):
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
    common = _common(cells)
    found = [
        (change[0], float(at[change[1]]) * common.hop_s)
        for by in (0, 1)
        for at, level in _driven(common, by)
        if (change := _largest(level, common.response[at])) is not None and abs(change[0]) <= most
    ]
    return max(found, key=lambda x: abs(x[0]), default=None)


def common_spell(cells: Cells) -> tuple[float, float, float] | None:
    """By how much all wheels' speed per opening differs for some seconds from what is usual at the same speed [ln], and their span [s].

    At the same opening as well, and far, where speeds explain little of what is usual; None where nothing does. By openings alone another gear would
    differ. What differs may as well be what is usual, and the rest be what has changed.
    """
    common = _common(cells)
    width = max(1, round(_SPELL_S / common.hop_s))
    best: _Spell | None = None
    for one, other in zip(_driven(common, 0), _driven(common, 1), strict=True):
        by_speed, by_opening = (_spell(at, _unusual(level, common.response[at]), width) for at, level in (one, other))
        told = by_speed
        if by_speed is not None and by_speed.unusual > _FITS:
            told = None if by_opening is None else min(by_speed, by_opening, key=_size)
            if told is not None and _size(told) < _FAR * max(by_speed.unusual, told.unusual):
                told = None
        if told is not None and (best is None or _size(told) > _size(best)):
            best = told
    return None if best is None else (best.off, best.start * common.hop_s, (best.start + width) * common.hop_s)


def _common(cells: Cells) -> _Common:
    return cells.once("common response", lambda: _of_all(cells))


def _of_all(cells: Cells) -> _Common:
    speed, command, opening = (cells.wheels(leaf) for leaf in ("v", "u", "u_applied"))
    if len(cells.driven) < _WHEELS:
        nothing, never = np.full(cells.frame.starts.size, np.nan), np.zeros(cells.frame.starts.size, np.bool_)
        return _Common(nothing, (nothing, nothing), (never, never), cells.frame.hop * cells.dt)
    used = np.where(np.isfinite(opening), opening, command)
    found = responses_of(cells, speed, used, cells.reference, over_time=False)
    own = found.own[:, cells.driven]
    known = np.isfinite(own).sum(axis=1) >= _KNOWN * own.shape[1]
    common = np.full(len(own), np.nan)
    common[known] = median_known(own[known], axis=1)
    common[np.column_stack([cells.explained(wheel) for wheel in cells.machine.wheels]).any(axis=1)] = np.nan
    levels = cells.frame.mean(_median(speed)), cells.frame.mean(_median(used[:, cells.driven]))
    ways = np.asarray(found.ahead.all(axis=1)), np.asarray(~found.ahead.any(axis=1))
    return _Common(common, levels, ways, cells.frame.hop * cells.dt)


def _driven(common: _Common, by: int) -> Iterator[tuple[NDArray[np.intp], Array]]:
    """Windows of either way in which the response is known, and ln of their speed (0) or opening (1)."""
    level = np.nan_to_num(common.levels[by])
    for way in common.ways:
        at = np.flatnonzero(way & np.isfinite(common.response) & (level > 0.0))
        yield at, np.log(level[at])


def _unusual(level: Array, response: Array) -> Array:
    """What is off the usual response at the same level [ln], NaN where that is not known; all of shape (windows,)."""
    out, places = np.full(level.size, np.nan), np.floor(level / _LEVEL).astype(np.int64)
    for place in np.unique(places):
        inside = places == place
        if np.count_nonzero(inside) >= _ALIKE:
            out[inside] = response[inside] - median_of(response[inside])
    return out


class _Spell(NamedTuple):
    """Some windows on end: by how much nearly all of them are off at least [ln], the first one, and what half of all windows are off [ln]."""

    off: float
    start: int
    unusual: float


def _size(x: _Spell) -> float:
    return abs(x.off)


def _spell(at: NDArray[np.intp], off: Array, width: int) -> _Spell | None:
    """The spell of so many windows that is furthest off; None where none is known. Windows and what each is off, of shape (windows,)."""
    if not np.isfinite(off).any() or (count := int(at.max()) + 1) < width:
        return None
    every = np.full(count, np.nan)
    every[at] = off
    windows = np.lib.stride_tricks.sliding_window_view(every, width)
    starts = np.flatnonzero(np.isfinite(windows).sum(axis=1) >= _FULL * width)
    if not starts.size:
        return None
    low, high = quantile_known(windows[starts], (_LOW, _HIGH), axis=1)
    least = np.where(low * high <= 0.0, 0.0, np.where(low > 0.0, low, high))
    k = int(np.argmax(np.abs(least)))
    return _Spell(float(least[k]), int(starts[k]), float(median_of(np.abs(off[np.isfinite(off)]))))


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
