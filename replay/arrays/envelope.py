"""Columns for pictures of long missions: smallest and largest value of every few steps, so that no spike is lost.

Up to `FULL_STEPS` steps a picture has every step. Beyond, each bucket of `bucket_of(n)` steps becomes two rows, its
smallest and its largest finite value in the order in which they occur; NaN where the whole bucket has none.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from replay.arrays.blocks import blocks, release
from replay.arrays.column_store import ColumnStore
from replay.arrays.compiling import njit

FULL_STEPS = 1 << 20
_BUCKETS = 1 << 18


def bucket_of(size: int) -> int:
    """Steps per bucket for a mission of so many steps: 1 (every step is kept) or a power of two."""
    bucket = 1
    while size > FULL_STEPS and size > bucket * _BUCKETS:
        bucket *= 2
    return bucket


def rows_of(size: int, bucket: int) -> int:
    """Rows that `size` steps become."""
    return size if bucket == 1 else 2 * -(-size // bucket)


def step_of(bucket: int) -> float:
    """Steps between rows. A number of steps, without a unit [1]."""
    return 1.0 if bucket == 1 else bucket / 2


def envelope(values: NDArray[Any], bucket: int) -> NDArray[Any]:
    """Reduce steps to rows.

    Parameters
    ----------
    values : NDArray, shape (n, …)
        Steps; the last bucket may be short.
    bucket : int
        From `bucket_of`.

    Returns
    -------
    NDArray, shape (rows, …)
        The values themselves where the bucket is 1.
    """
    if bucket == 1:
        return values
    out = np.empty((rows_of(len(values), bucket), *values.shape[1:]), values.dtype)
    for part in blocks(len(values), bucket):
        first = 2 * (part.start // bucket)
        rows = _reduced(values[part], bucket)
        out[first : first + len(rows)] = rows
        release(values)
    return out


def shown(values: NDArray[Any]) -> NDArray[Any]:
    """A column of n steps for pictures; the envelope of long ones, as 32-bit numbers. From shape (n,) to (rows,)."""
    bucket = bucket_of(len(values))
    return values if bucket == 1 else envelope(values, bucket).astype(np.float32)


def _reduced(values: NDArray[Any], bucket: int) -> NDArray[Any]:
    rows = values.reshape(len(values), -1)
    out = np.empty((rows_of(len(rows), bucket), rows.shape[1]), values.dtype)
    plain = (x.view(np.uint8) if x.dtype == np.bool_ else x for x in (rows, out))
    _scan_extremes(*plain, bucket)
    return out.reshape(-1, *values.shape[1:])


@njit(cache=True)
def _scan_extremes(rows, out, bucket):  # type: ignore[no-untyped-def]
    """Least and greatest number of every bucket, in the order of time; the first number where all are NaN."""
    for b in range(out.shape[0] // 2):
        first, stop = b * bucket, min((b + 1) * bucket, rows.shape[0])
        for j in range(rows.shape[1]):
            low = high = -1
            for i in range(first, stop):
                x = rows[i, j]
                if x == x:
                    if low < 0 or x < rows[low, j]:
                        low = i
                    if high < 0 or x > rows[high, j]:
                        high = i
            if low < 0:
                low = high = first
            out[2 * b, j], out[2 * b + 1, j] = rows[min(low, high), j], rows[max(low, high), j]


def in_buckets(
    function: Callable[..., NDArray[Any]], bucket: int, store: ColumnStore, *columns: NDArray[Any]
) -> NDArray[Any]:
    """Envelope of a function of whole rows, one block after another; see `ColumnStore.map`.

    Columns of shape (n,), the result of shape (rows,).
    """

    def rows(_: None, *parts: NDArray[Any]) -> tuple[tuple[NDArray[Any]], None]:
        return (envelope(np.asarray(function(*parts)), bucket),), None

    return store.scan(rows, None, *columns, multiple=bucket)[0][0]
