"""The compiled steps of `diagnosis.report.encode`: values to levels, and the bytes of levels' differences, plane by plane."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from replay.arrays.compiling import njit


@njit(cache=True, nogil=True, error_model="numpy")
def quantise(y: NDArray[np.float64], huge: float, step: float, base: float, out: NDArray[np.int32]) -> None:
    """Write the level of each value, both of shape (n,): round(y/step) − base [1]; 0 where it is NaN or not below `huge`.

    `huge`, `step` in the unit of `y`, `base` in steps.
    """
    for i in range(y.size):
        x = y[i] if abs(y[i]) < huge else base * step
        out[i] = np.int32(np.rint(x / step) - base)


@njit(cache=True, nogil=True, error_model="numpy")
def split_planes(levels: NDArray[np.int32], rows: NDArray[np.uint8], first: int, stop: int) -> int:
    """Write bytes `first` to `stop` of the zigzag differences of levels, lowest first, and return all their bits at once.

    `levels` of shape (n,), `rows` of shape (4, n).
    """
    bits = np.uint32(0)
    for plane in range(first, stop):
        row, shift = rows[plane], np.uint32(8 * plane)
        for i in range(levels.size):  # without a value that is carried on, so that several are done at once
            before = levels[i - 1] if i else np.int32(0)
            delta = np.int32(levels[i] - before)
            coded = np.uint32(np.int32(delta << np.int32(1)) ^ np.int32(delta >> np.int32(31)))
            bits |= coded
            row[i] = np.uint8((coded >> shift) & np.uint32(255))
    return int(bits)
