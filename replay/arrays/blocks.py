"""Rows in blocks: a mission of hours is never in memory as a whole."""

from __future__ import annotations

import mmap
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

BLOCK = 1 << 19


def blocks(size: int, multiple: int = 1, rows: int | None = None) -> Iterator[slice]:
    """Cut ``range(size)`` into slices of about `rows` (None: `BLOCK`); all but the last hold a multiple of `multiple`."""
    step = max((BLOCK if rows is None else rows) // multiple, 1) * multiple
    return (slice(at, min(at + step, size)) for at in range(0, size, step))


def framed(x: NDArray[Any], width: int) -> NDArray[Any]:
    """Rows by block, shape (⌈n/width⌉, width, …), to be read alone; the last block is filled up with the last row."""
    missing = -len(x) % width
    filled = np.pad(x, [(0, missing)] + [(0, 0)] * (x.ndim - 1), mode="edge") if missing or not _in_rows(x) else x
    return filled.reshape(-1, width, *x.shape[1:])


def _in_rows(x: NDArray[Any]) -> bool:
    """Whether rows stand one behind the other; sums over others are rounded otherwise."""
    return x.flags.c_contiguous


def block_means(x: NDArray[Any], width: int) -> NDArray[np.float64]:
    """Means over blocks of `width` rows, shape (⌈n/width⌉, …), as `framed` has them."""
    whole = len(x) // width * width if _in_rows(x) else len(x)
    means = framed(x[:whole], width).mean(axis=1, dtype=np.float64)
    if whole == len(x):
        return np.asarray(means)
    return np.concatenate([means, framed(x[whole:], width).mean(axis=1, dtype=np.float64)])  # no copy of all rows


def release(*arrays: NDArray[Any] | None) -> None:
    """Let go of the memory of columns that stand in temporary files until they are read again; others stay as they are."""
    for array in arrays:
        base: Any = array
        while isinstance(base, np.ndarray):
            base = base.base
        if isinstance(base, memoryview):
            base = base.obj
        if isinstance(base, mmap.mmap):
            unload(base)


def unload(mapped: mmap.mmap) -> None:
    """Let go of the memory of a map; its numbers are in the file."""
    if hasattr(mapped, "madvise"):  # not on Windows
        mapped.madvise(mmap.MADV_DONTNEED)
