"""Two wheels that come to lose alike: among four each of them looks as usual beside the median of the others, or all do not.

A pump, a hose or a differential feeds two motors. What both lose from some moment on, or for a spell, shows in their own speeds per opening, which
fall together while those of the other wheels stay; hills and loads move all of them.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from diagnosis.clearing.cells import Array, Cells
from diagnosis.clearing.responses import Responses
from replay.arrays.quantiles import median_of

#: Of the loss that counts [ln]: of 26 healthy missions of 14 machines that are cleared (tuning) one had a half of it, one 0.43.
FALLS = 0.6
_LEAST_WINDOWS, _PART, _SPLITS = 8, 0.2, 40  # before and after; of all; moments that are tried
_WHEELS = 4
_ABREAST_M = 0.05  # along the machine
_SPELL_S = 6.0  # for which two wheels of one axle, or of one side, are below the others by as much as counts
_IN, _OUT = 0.75, 2.0  # of a spell, that is known of it; times its length, that is known elsewhere


def pairs_fall(responses: Responses, cells: Cells) -> Array:
    """By how much more than any other wheel's each wheel's speed per opening falls, together with another one's [ln], shape (wheels,).

    From some moment on, or for a spell of wheels of one axle or one side, as they are and less what turns make of them. NaN with fewer than four
    wheels, or of few windows in which all are known.
    """
    return np.asarray(np.fmin(*(_fall(responses, cells, own) for own in (responses.own, responses.evened))))


def _fall(responses: Responses, cells: Cells, own: Array) -> Array:
    """The same of one of both, of shape (windows, wheels)."""
    count = own.shape[1]
    out = np.full(count, np.nan)
    if count < _WHEELS:
        return out
    for way in (responses.ahead.all(axis=1), ~responses.ahead.any(axis=1)):
        x = own[way & np.isfinite(own).all(axis=1)]
        least = max(_LEAST_WINDOWS, round(_PART * len(x)))
        for k in range(least, len(x) - least + 1, max(1, len(x) // _SPLITS)):
            change = median_of(x[k:], axis=0) - median_of(x[:k], axis=0)
            for a, b in combinations(range(count), 2):
                others = np.abs(np.delete(change, (a, b))).max()
                more = max(0.0, -max(change[a], change[b]) - others)
                out[[a, b]] = np.fmax(out[[a, b]], more)
    return np.asarray(np.fmax(out, _in_spells(responses, cells, own)))


def _in_spells(responses: Responses, cells: Cells, own: Array) -> Array:
    """The same of spells of `_SPELL_S` beside the rest of the mission in which it goes the same way, shape (wheels,)."""
    count = own.shape[1]
    long = max(1, round(_SPELL_S / (cells.frame.hop * cells.dt)))
    out = np.full(count, np.nan)
    pairs = [p for p in combinations(range(count), 2) if _belong(cells, *p)]
    for way in (responses.ahead.all(axis=1), ~responses.ahead.any(axis=1)):
        known: NDArray[np.bool_] = np.asarray(way & np.isfinite(own).all(axis=1), np.bool_)
        if len(own) <= long or np.count_nonzero(known) < (1.0 + _OUT) * long:
            continue
        total = np.concatenate([np.zeros((1, count)), np.cumsum(np.where(known[:, np.newaxis], own, 0.0), axis=0)])
        number = np.concatenate([[0], np.cumsum(known)])
        inside, outside = number[long:] - number[:-long], number[-1] - (number[long:] - number[:-long])
        enough = (inside >= _IN * long) & (outside >= _OUT * long)
        part = (total[long:] - total[:-long])[enough]
        change = part / inside[enough, np.newaxis] - (total[-1] - part) / outside[enough, np.newaxis]
        for a, b in pairs:
            others = np.delete(change, (a, b), axis=1)
            most = np.maximum(change[:, a], change[:, b])
            more = np.minimum(others.min(axis=1) - most, -most)  # wheels that fall, not others that rise
            out[[a, b]] = np.fmax(out[[a, b]], np.max(more, initial=0.0))
    return out


def _belong(cells: Cells, a: int, b: int) -> bool:
    """Whether two wheels are of one axle or of one side; of a machine without geometry any two."""
    geometry = cells.machine.geometry
    if geometry is None:
        return True
    one, other = (geometry.wheels[cells.machine.wheels[i]] for i in (a, b))
    return abs(one.x - other.x) < _ABREAST_M or one.y * other.y > 0.0
