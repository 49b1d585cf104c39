"""Compiled walk over the index of the stamps in an SQLite file.

As in `replay.readers.rosbag2.sqlite_kernel`, nothing read from a page is trusted, and pages are visited once.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from replay.arrays.compiling import njit
from replay.readers.common.compiled import part
from replay.readers.rosbag2.sqlite_kernel import big_endian, page_head, u16, unsigned, varint

INDEX_INTERIOR, INDEX_LEAF = 2, 10


@part
def _entry(data: NDArray[np.uint8], at: int, stop: int) -> tuple[Any, Any, bool]:
    """Stamp and row number of an index entry, and whether it is sound."""
    pair: tuple[Any, Any] = (np.int64(0), np.int64(0))
    size, at = varint(data, at, stop)
    if at < 0 or size < 3 or size > 32 or at + size > stop or data[at] != 3:
        return pair[0], pair[1], False
    p = at + 3
    for k in range(2):
        code: Any = np.int64(data[at + 1 + k])
        if code > 9 or code == 7 or code == 0:
            return pair[0], pair[1], False
    for k in range(2):
        code = np.int64(data[at + 1 + k])
        width = code if code < 5 else 6 if code == 5 else 8 if code == 6 else 0
        if p + width > at + size:
            return pair[0], pair[1], False
        value = big_endian(data, p, width) if width else code - 8
        pair = (value, pair[1]) if k == 0 else (pair[0], value)
        p += width
    return pair[0], pair[1], True


@njit(cache=True)
def stamped_rows(data, page, root, seen, first, stop_stamp, rows):  # type: ignore[no-untyped-def]
    """Fill `rows` with the row numbers of index entries first ≤ stamp < stop; return how many, and all entries met.

    Both are −1 where a page or an entry of the index is damaged.
    """
    pages = len(seen) - 1
    stack = np.empty(pages + 1, np.int64)
    n = met = depth = 0
    if 1 <= root <= pages:
        stack[0], depth = root, 1
    while depth:
        depth -= 1
        number = stack[depth]
        if number < 1 or number > pages or seen[number]:
            return -1, -1
        seen[number] = 1
        start, head, stop = page_head(data, page, number)
        kind = data[head] if head + 12 <= stop else 0
        if kind != INDEX_LEAF and kind != INDEX_INTERIOR:
            return -1, -1
        inner = 4 if kind == INDEX_INTERIOR else 0
        cells, below = u16(data, head + 3), np.int64(np.iinfo(np.int64).min)
        if head + 8 + inner + 2 * cells > stop:
            return -1, -1
        for i in range(cells):
            at = start + (u16(data, head + 8 + inner + 2 * i) & page - 1)
            if at + inner >= stop:
                return -1, -1
            child = unsigned(data, at) if inner and at + 4 < stop else 0
            stamp, row, sound = _entry(data, at + inner, stop)
            if not sound:
                return -1, -1
            if inner and below < stop_stamp and stamp >= first:
                if depth >= pages:
                    return -1, -1
                stack[depth] = child
                depth += 1
            below = stamp
            met += 1
            if first <= stamp < stop_stamp:
                if n < len(rows):
                    rows[n] = row
                n += 1
        if inner and below < stop_stamp:
            if depth >= pages:
                return -1, -1
            stack[depth] = unsigned(data, head + 8)
            depth += 1
    return n, met
