"""Which row a run is stated with by the probabilities of all rows, and how far these may be believed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.estimation.fault_models import (
    HEALTHY,
    INEFFICIENT,
    NO_SIGNAL,
    SCALED_ROWS,
    STEADY_ROWS,
    STUCK,
    TOTAL_ROWS,
)
from diagnosis.results.fault_rows import codes_of
from replay.faults import Side

Array = NDArray[np.float64]

# Share of findings that are not what they seem, from tuning missions by `python tests/benchmarks/calibrate_direct.py`; and the length at
# which half of those in a log too slow for its commands are: of three seconds 98 of 100 were right in campaigns, below two few.
_LAPSE, _COARSE_S = 0.01, 1.9
_CLEARLY = 2.0  # times as probable as the path's row, from which on another one is stated
_MAJORITY = 0.5  # of the probability: a fault is called by it


def stated_row(row: int, p: Array, *, zero: bool, still: bool) -> int:
    """The path's row of a run, or another fault's where that is clearly more probable, or has the majority.

    Parameters
    ----------
    row : int
        Row of the path.
    p : Array, shape (rows,)
        Probabilities of the rows.
    zero, still : bool
        Whether the channel stays at zero, and whether its reference hardly moves: some rows are alike then.
    """
    faults = [r for r in range(p.size) if r != HEALTHY]
    best = max(faults, key=lambda r: float(p[r]))
    constant = {*TOTAL_ROWS, *(SCALED_ROWS if row not in SCALED_ROWS else ())}
    alike = (zero and {row, best} <= constant) or (still and {row, best} <= set(STEADY_ROWS))
    other = p[best] > _CLEARLY * p[row] or p[best] > _MAJORITY
    return best if other and not alike else row


def not_silent(p: Array, side: Side) -> Array:
    """Probabilities of the rows, shape (rows,), of a channel that shows too much to have no signal: the other faults share that row's."""
    others = [r for r in codes_of(side) if r not in (HEALTHY, NO_SIGNAL)]
    out = p.copy()
    out[others] += out[NO_SIGNAL] / len(others)
    out[NO_SIGNAL] = 0.0
    return out


def with_lapses(p: Array, row: int, side: Side, seconds: float | None) -> Array:
    """Probabilities of the rows, lessened by how often a finding is not the fault that it seems, shape (rows,).

    In a log too slow for its commands (`seconds` long; None elsewhere) most short findings are pieces of another fault,
    so that what the row loses goes to the other faults of its side's table.
    """
    kept = 1.0 - _LAPSE
    if seconds is not None:
        kept *= seconds**6 / (seconds**6 + _COARSE_S**6)
    out = p.copy()
    others = [r for r in codes_of(side) if r not in (HEALTHY, row)]
    share = 1.0 / len(others)
    level = (float(p[others].max()) + share * float(p[row])) / max((1.0 + share) * float(p[row]), 1e-300)
    kept = max(kept, min(level, 1.0))
    out[others] += p[row] * (1.0 - kept) / len(others)
    out[row] = p[row] * kept
    return out


def of_a_constant(p: Array) -> Array:
    """Probabilities of the rows, shape (rows,), where nothing moved: a constant value and a constant share of a constant are the same.

    Where another row is more probable than half of both, none of the three is called more surely than the others.
    """
    out = p.copy()
    out[[STUCK, INEFFICIENT]] = 0.5 * (p[STUCK] + p[INEFFICIENT])
    ahead = [r for r in range(p.size) if r not in (HEALTHY, STUCK, INEFFICIENT) and out[r] > out[STUCK]]
    if ahead:
        rows = [STUCK, INEFFICIENT, *ahead]
        out[rows] = out[rows].mean()
    return out


def as_sure(p: Array, row: int, side: Side) -> Array:
    """Probabilities of the rows, shape (rows,), of which none is more probable than `row`: what others explain as well is called by none more surely."""
    out = p.copy()
    ahead = [r for r in codes_of(side) if r != HEALTHY and p[r] >= p[row]]
    out[ahead] = p[ahead].mean()
    return out
