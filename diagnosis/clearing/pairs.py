"""Two wheels that come to lose alike: among four each of them looks as usual beside the median of the others, or all do not.

A pump, a hose or a differential feeds two motors. What both lose from some moment on shows in their own speeds per opening, which fall
together while those of the other wheels stay; hills and loads move all of them.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np

from diagnosis.clearing.cells import Array
from diagnosis.clearing.responses import Responses

#: Of the loss that counts [ln]: of 26 healthy missions of 14 machines that are cleared (tuning) one had a half of it, one 0.43.
FALLS = 0.6
_LEAST_WINDOWS, _PART, _SPLITS = 8, 0.2, 40  # before and after; of all; moments that are tried
_WHEELS = 4


def pairs_fall(responses: Responses) -> Array:
    """By how much more than any other wheel's each wheel's speed per opening falls in the mission, together with another one's [ln], shape (wheels,).

    NaN with fewer than four wheels, or of few windows in which all are known.
    """
    own = responses.own
    count = own.shape[1]
    out = np.full(count, np.nan)
    if count < _WHEELS:
        return out
    for way in (responses.ahead.all(axis=1), ~responses.ahead.any(axis=1)):
        x = own[way & np.isfinite(own).all(axis=1)]
        least = max(_LEAST_WINDOWS, round(_PART * len(x)))
        for k in range(least, len(x) - least + 1, max(1, len(x) // _SPLITS)):
            change = np.median(x[k:], axis=0) - np.median(x[:k], axis=0)
            for a, b in combinations(range(count), 2):
                others = np.abs(np.delete(change, (a, b))).max()
                more = max(0.0, -max(change[a], change[b]) - others)
                out[[a, b]] = np.fmax(out[[a, b]], more)
    return out
