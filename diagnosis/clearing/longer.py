"""Speed per opening over ten seconds: what lies behind a drive that is measured twice shows little of itself, but as long as it lasts.

The ground evens a wheel whose motor, gear or brake fails, so that in three seconds it deviates by no more than a bump or a bend
makes of any wheel. Over ten seconds those pass, and what one wheel alone does stays.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from diagnosis.clearing.cells import WINDOW_S, Array, Cells
from diagnosis.results.clearing import Checked

LONG_S = 10.0
_KNOWN = 0.6  # of its windows


def longer(cells: Cells, windows: Array, names: Sequence[str]) -> Array:
    """Means of windows over ten seconds in whose middle each stands, beside stated faults, shape (windows, parts) as `windows`; else NaN.

    `names`: the parts' wheels or axles.
    """
    x = windows.copy()
    for i, name in enumerate(names):
        x[cells.explained(name), i] = np.nan
    n = round((LONG_S - WINDOW_S) / (cells.frame.hop * cells.dt)) + 1
    out = np.full(x.shape, np.nan)
    if len(x) < n:
        return out
    known = np.isfinite(x)
    edge = np.zeros((1, x.shape[1]))
    total, count = (
        np.concatenate([edge, np.cumsum(z, axis=0)]) for z in (np.where(known, x, 0.0), known.astype(np.float64))
    )
    count = count[n:] - count[:-n]
    mean = (total[n:] - total[:-n]) / np.maximum(count, 1.0)
    out[n // 2 : n // 2 + len(mean)] = np.where(count >= _KNOWN * n, mean, np.nan)
    return out


def around(check: Checked) -> Checked:
    """A check of such means with all of their time."""
    more = (LONG_S - WINDOW_S) / 2.0
    if check.start_s is None or check.stop_s is None:
        return check
    return replace(check, start_s=max(0.0, check.start_s - more), stop_s=check.stop_s + more)
