"""Means over windows around each moment, in bounded memory."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Steps = NDArray[np.int64]

STEP_S, FRAME_S = 0.04, 0.2
MISSING, LARGEST = -9.0, 8.0  # a feature that nobody knows, and the largest one
#: Windows around a moment [s]: from, to.
WINDOWS: tuple[tuple[float, float], ...] = (
    (-0.2, 0.2),
    (-0.6, 0.0),
    (0.0, 0.6),
    (-2.0, 0.0),
    (0.0, 2.0),
    (-1.5, 1.5),
    (-4.0, 4.0),
)
MIDDLE = 5  # of these: the one by which what is usual is told
_REACH_S = 4.1
_CUT_FRAMES = 4000


def frames_at(n: int, dt: float) -> Steps:
    """Steps in the middle of each frame of n steps of dt [s]. Shape (frames,)."""
    hop = max(1, round(FRAME_S / dt))
    return np.arange(min(hop // 2, n - 1), n, hop)


def cuts(at: Steps, n: int, dt: float) -> Iterator[tuple[slice, Steps]]:
    """Frames in turn: the steps (of n) that their windows need, and the frames counted from the first of these.

    `at` of shape (frames,), `dt` in s.
    """
    reach = round(_REACH_S / dt) + 1
    for k in range(0, at.size, _CUT_FRAMES):
        mine = at[k : k + _CUT_FRAMES]
        first, last = max(0, int(mine[0]) - reach), min(n, int(mine[-1]) + reach + 1)
        yield slice(first, last), mine - first


def windowed(columns: Array, at: Steps, dt: float) -> list[Array]:
    """Means of columns (n, k) over each of `WINDOWS` around the steps `at`, shape (frames, k) each.

    `dt` in s; units of the columns are kept.
    """
    n = len(columns)
    sums = np.concatenate([np.zeros((1, columns.shape[1])), np.cumsum(columns, axis=0)])
    out = []
    for low, high in WINDOWS:
        first = np.clip(at + round(low / dt), 0, n - 1)
        last = np.clip(at + round(high / dt), first + 1, n)
        out.append((sums[last] - sums[first]) / (last - first)[:, None])
    return out


def bounded(features: Array) -> Array:
    """Features within the range that the trees know; `MISSING` where there is none.

    Both of shape (frames, features).
    """
    return np.clip(np.nan_to_num(features, nan=MISSING), MISSING, LARGEST)
