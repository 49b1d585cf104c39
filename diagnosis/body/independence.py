"""Whether odometry is computed from the wheels themselves: then it says nothing that they do not say."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from diagnosis.body.positions import Positions, moves
from diagnosis.body.rolling import Rolling, integral

Array = NDArray[np.float64]

_WINDOW_S = 0.5
_SAME = 0.004  # of its speed: what computed odometry may differ from a weighted mean of the wheels
_ROUNDS = 8
_LEAST = 20


def from_wheels(positions: Positions, rolling: Rolling) -> bool:
    """Whether the way is a weighted sum of what the wheels' sensors, or the command, say."""
    spaced = _spaced(positions)
    if spaced.t.size < _LEAST:
        return False
    _, displacement, _ = moves(spaced, rolling, None, 0.0)
    known = [np.nan_to_num(values) for values in rolling.voters.T if np.isfinite(values).any()]
    columns = [np.diff(np.interp(spaced.t, rolling.edges, integral(values, rolling.dt))) for values in known]
    return bool(columns) and _misfit(np.abs(displacement), np.abs(np.column_stack(columns))) < _SAME


def _misfit(way: Array, columns: Array) -> float:
    """Median deviation from the best weighted sum, as a share of the median way."""
    moving = way > 0.3 * np.quantile(way, 0.9)
    if moving.sum() < _LEAST:
        return float("inf")
    way, columns = way[moving], columns[moving]
    weight = np.ones(way.size)
    misfit = np.abs(way)
    for _ in range(_ROUNDS):  # least absolute deviations: faults and curves are no part of the rule
        root = np.sqrt(weight)
        found = np.linalg.lstsq(columns * root[:, None], way * root, rcond=None)[0]
        misfit = np.abs(way - columns @ found)
        weight = 1.0 / np.maximum(misfit, 1e-3 * np.median(way))
    return float(np.median(misfit) / np.median(way))


def _spaced(positions: Positions) -> Positions:
    """Fixes at least half a second apart."""
    window = np.floor(positions.t / _WINDOW_S)
    keep = np.r_[True, np.diff(window) > 0]
    return Positions(positions.t[keep], positions.place[keep])
