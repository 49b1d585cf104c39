"""What all wheels' speed per opening has in common, before and after a moment, at the same speeds.

A controller that holds the speeds hides in them what all motors lose, and what all sensors read too little: it opens all valves further. Valves are no
straight lines, so that only what is driven as fast before as after is compared. Another load, oil or gear changes the same; no part is blamed for it.
While a wheel's fault is stated nothing is asked: the others drag it, or it drags them.
"""

from __future__ import annotations

import numpy as np

from diagnosis.clearing.cells import Array, Cells
from diagnosis.clearing.responses import responses_of

_LEVEL = 0.12  # ln of the speed: as wide are speeds that are alike
_LEAST, _EACH = 20, 3  # windows before and after, in all, and at a level
_SPLITS = 40  # moments that are tried
_WHEELS, _KNOWN = 2, 0.6  # fewer have nothing in common; of the wheels
_LOW, _HIGH = 0.2, 0.8  # quantiles of the differences of all levels, which must agree


def common_change(cells: Cells) -> tuple[float, float] | None:
    """By how much all wheels' speed per opening changes at least at the same speeds [ln], and when [s]; None where little is driven alike before and after."""
    speed, command, opening = (cells.wheels(leaf) for leaf in ("v", "u", "u_applied"))
    if len(cells.driven) < _WHEELS:
        return None
    used = np.where(np.isfinite(opening), opening, command)
    found = responses_of(cells, speed, used, cells.reference, over_time=False)
    own = found.own[:, cells.driven]
    known = np.isfinite(own).sum(axis=1) >= _KNOWN * own.shape[1]
    common = np.full(len(own), np.nan)
    common[known] = np.nanmedian(own[known], axis=1)
    common[np.column_stack([cells.explained(wheel) for wheel in cells.machine.wheels]).any(axis=1)] = np.nan
    level = cells.frame.mean(_median(speed))
    best: tuple[float, float] | None = None
    for way in (found.ahead.all(axis=1), ~found.ahead.any(axis=1)):
        at = np.flatnonzero(way & np.isfinite(common) & (np.nan_to_num(level) > 0.0))
        change = _largest(np.log(level[at]), common[at])
        if change is not None and (best is None or abs(change[0]) > abs(best[0])):
            best = change[0], float(cells.frame.starts[at[change[1]]] * cells.dt)
    return best


def _median(speed: Array) -> Array:
    known = np.isfinite(speed).any(axis=1)
    out = np.full(len(speed), np.nan)
    out[known] = np.abs(np.nanmedian(speed[known], axis=1))
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
            left += sum(float(np.abs(x - np.median(x)).sum()) for x in parts if x.size)
            early, late = parts
            if min(early.size, late.size) >= _EACH:
                changes.append(float(np.median(late) - np.median(early)))
                weights.append(late.size)
                before += early.size
        if min(before, sum(weights)) >= _LEAST and (best is None or left < best[0]):
            low, high = np.quantile(np.repeat(changes, weights), (_LOW, _HIGH))
            best = left, 0.0 if low * high <= 0.0 else float(low if low > 0.0 else high), k
    return None if best is None else best[1:]
