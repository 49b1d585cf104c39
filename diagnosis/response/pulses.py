"""Speeds that come in pulses: published more often than the encoder is read, they are 0 where no new reading has come, and too much where one has."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from diagnosis.response.inputs import FollowerData

Array = NDArray[np.float64]

_SHARE = 0.35  # of the readings in motion: a slow wheel on a coarse encoder has as many, but not where it is fastest
_BETWEEN, _AROUND = 5, 10  # readings to the next that is not 0; over which the speed is meant
_LEAST = 50  # readings in motion


def in_pulses(drives: Sequence[FollowerData]) -> str:
    """A sentence where the speed of any drive comes in pulses, also where it is fastest; empty where none does."""
    shares = {d.name: share_of(d.y[d.fresh & np.isfinite(d.y)]) for d in drives}
    found = {name: share for name, share in shares.items() if share >= _SHARE}
    if not found:
        return ""
    names, several = " and ".join(found), len(found) > 1
    return (
        f"{names} come{'' if several else 's'} in pulses: {100 * max(found.values()):.0f} % of the readings in motion are 0 between others that are not, also "
        f"where {'they are' if several else 'it is'} fastest, as where a speed is published more often than its encoder is read; how the machine followed its "
        "commands does not show in that."
    )


def share_of(readings: Array) -> float:
    """Share of readings that are 0 between others that are not, in the faster half of the motion, of readings of shape (n,) [m/s]."""
    if readings.size < _LEAST:
        return 0.0
    moves = readings != 0.0
    near = np.ones(_BETWEEN)
    ahead = np.convolve(moves, near, mode="full")[: moves.size] > 0.0
    behind = np.convolve(moves[::-1], near, mode="full")[: moves.size][::-1] > 0.0
    inside = moves | (ahead & behind)
    if np.count_nonzero(inside) < _LEAST:
        return 0.0
    mean = np.convolve(np.abs(readings), np.ones(_AROUND) / _AROUND, mode="same")
    fast = inside & (mean >= np.median(mean[inside]))
    return float(np.mean(~moves[fast]))
