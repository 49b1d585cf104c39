"""Largest, smallest and mean value of sliding windows, in NumPy alone: importing `scipy.ndimage` takes longer than they do."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def largest_within(x: Array, before: int, after: int) -> Array:
    """Largest of the samples i − before … i + after, shape (n,), as `scipy.ndimage.maximum_filter1d` has it.

    Beyond the ends x goes on as its mirror image. `x` of shape (n,), n > 0, without NaN.
    """
    return _extreme(x, before, after, np.maximum)


def smallest_within(x: Array, before: int, after: int) -> Array:
    """Smallest of the samples i − before … i + after, shape (n,); see `largest_within`."""
    return _extreme(x, before, after, np.minimum)


def _extreme(x: Array, before: int, after: int, pick: np.ufunc) -> Array:
    """Extremes of 1, 2, 4… samples are put together until two of them cover the window."""
    width, length = before + after + 1, 1
    best = np.pad(x, (before, after), mode="symmetric")
    while 2 * length <= width:
        best = pick(best[:-length], best[length:])
        length *= 2
    return np.asarray(pick(best[: x.size], best[width - length :]))


def mean_within(x: Array, width: int) -> Array:
    """Mean of `width` samples around each one, 0 beyond the ends, shape (n,): `scipy.ndimage.uniform_filter1d` to the last digit.

    `x` of shape (n,), n > 0, finite; of an even width one more sample lies before than after.
    """
    before = width // 2
    line = np.pad(x, (before, width - before - 1))
    first = np.add.accumulate(line[:width])[-1:]
    return np.asarray(np.add.accumulate(np.concatenate([first, line[width:] - line[:-width]])) / width)
