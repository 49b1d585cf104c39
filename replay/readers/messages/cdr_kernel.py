"""Compiled loop over serialised messages that are all alike: the numbers of each to their columns.

Rows that have an owner are skipped; the table becomes the owner of each row that fits. Payload bytes are untrusted:
every offset is checked against the payload's end before it is used.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from replay.arrays.compiling import njit
from replay.readers.common.compiled import part
from replay.readers.messages.cdr_rows import FREE, FixedLayout, Ints, OpenTable, Payloads

_TILE = 32


@njit(cache=True, no_cpython_wrapper=True)
def turn8(v: Any) -> Any:
    """Number of eight bytes in the other byte order."""
    v = ((v & np.uint64(0x00FF00FF00FF00FF)) << np.uint64(8)) | ((v >> np.uint64(8)) & np.uint64(0x00FF00FF00FF00FF))
    v = ((v & np.uint64(0x0000FFFF0000FFFF)) << np.uint64(16)) | ((v >> np.uint64(16)) & np.uint64(0x0000FFFF0000FFFF))
    return (v << np.uint64(32)) | (v >> np.uint64(32))


@njit(cache=True, no_cpython_wrapper=True)
def turn4(v: Any) -> Any:
    """Number of four bytes in the other byte order."""
    v = np.uint32(v)
    v = np.uint32((v & np.uint32(0x00FF00FF)) << np.uint32(8)) | np.uint32((v >> np.uint32(8)) & np.uint32(0x00FF00FF))
    return np.uint32(np.uint32(v << np.uint32(16)) | np.uint32(v >> np.uint32(16)))


@njit(cache=True, no_cpython_wrapper=True)
def turn2(v: Any) -> Any:
    """Number of two bytes in the other byte order."""
    return np.uint16((np.uint32(v) << np.uint32(8)) | (np.uint32(v) >> np.uint32(8)))


@part
def _copy(numbers: NDArray[Any], source: Ints, offset: int, column: NDArray[Any], target: Ints, m: int) -> None:
    """Copy one number of each of m rows; indexes are unsigned, which spares a test for negative ones."""
    for k in range(m):
        column[np.uint64(target[k])] = numbers[np.uint64(source[k] + offset)]


@part
def _is_alike(payloads: Payloads, layout: FixedLayout, row: int) -> bool:
    """Whether a payload has the layout's size and the bytes that fix it."""
    at = payloads.starts[row]
    if payloads.lengths[row] != layout.size or at < 0 or at + layout.size > payloads.limit:
        return False
    wrong = np.uint64(0)
    for k in range(len(layout.check_at)):
        wrong |= (payloads.b8[at + layout.check_at[k]] ^ layout.check_word[k]) & layout.check_mask[k]
    return bool(wrong == 0)


@part
def _turn(layout: FixedLayout, table: OpenTable, target: Ints, m: int) -> None:
    """Turn the byte order of what was copied for m rows."""
    for k in range(m):
        for c in layout.to8:
            table.out8[c, target[k]] = turn8(table.out8[c, target[k]])
        for c in layout.to4:
            table.out4[c, target[k]] = turn4(table.out4[c, target[k]])
        for c in layout.to2:
            table.out2[c, target[k]] = turn2(table.out2[c, target[k]])


@part
def _take(payloads: Payloads, layout: FixedLayout, table: OpenTable, source: Ints, target: Ints) -> tuple[int, int]:
    taken, left = 0, -1
    for begin in range(0, len(payloads.starts), _TILE):
        m = int(np.int64(0))  # a literal 0 would compile what it is passed to once more
        for row in range(begin, min(begin + _TILE, len(payloads.starts))):
            slot = payloads.slots[row]
            if table.owner[slot] != FREE:
                continue
            if _is_alike(payloads, layout, row):
                table.owner[slot] = table.number
                source[m], target[m] = payloads.starts[row], table.first + slot
                m += 1
            elif left < 0:
                left = row
        taken += m
        for c in range(len(layout.at8)):
            _copy(payloads.b8, source, layout.at8[c], table.out8[layout.to8[c]], target, m)
        for c in range(len(layout.at4)):
            _copy(payloads.b4, source, layout.at4[c], table.out4[layout.to4[c]], target, m)
        for c in range(len(layout.at2)):
            _copy(payloads.b2, source, layout.at2[c], table.out2[layout.to2[c]], target, m)
        for c in range(len(layout.at1)):
            _copy(payloads.b1, source, layout.at1[c], table.out1[layout.to1[c]], target, m)
        if layout.swap:
            _turn(layout, table, target, m)
    return taken, left


@njit(cache=True)
def take_fixed(payloads: Payloads, layout: FixedLayout, table: OpenTable) -> tuple[int, int]:
    """Copy the rows of one layout; return how many there are and the first row left free, or −1."""
    return _take(payloads, layout, table, np.empty(_TILE, np.int64), np.empty(_TILE, np.int64))
