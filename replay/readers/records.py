"""Compiled walks over the length-prefixed records of MCAP."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray


class Records(NamedTuple):
    """Records of a buffer, in order.

    Attributes
    ----------
    op : NDArray[np.uint8], shape (n,)
        Record type.
    body, size : NDArray[np.int64], shape (n,)
        Place and length of each record's content.
    end : int
        Where the walk stopped: the end of the last complete record.
    """

    op: NDArray[np.uint8]
    body: NDArray[np.int64]
    size: NDArray[np.int64]
    end: int


@njit(cache=True)
def _little(data, at, width):  # type: ignore[no-untyped-def]
    value = np.uint64(0)
    for i in range(width):
        value |= np.uint64(data[at + i]) << np.uint64(8 * i)
    return value


@njit(cache=True)
def _scan_mcap(data, start, stop, op, body, size):  # type: ignore[no-untyped-def]
    """Fill up to len(op) records; return how many there are and where the walk ended."""
    at, n = start, 0
    while at + 9 <= stop:
        length = _little(data, at + 1, 8)
        if length > np.uint64(stop - at - 9) or data[at] == 0:
            break
        if n < len(op):
            op[n], body[n], size[n] = data[at], at + 9, length
        n += 1
        at += 9 + np.int64(length)
    return n, at


def scan_mcap(data: NDArray[np.uint8], start: int = 0, stop: int | None = None) -> Records:
    """Walk MCAP records (opcode u8, length u64, content) as far as they are complete."""
    stop = len(data) if stop is None else stop
    room = 1024
    while True:
        op, body, size = np.empty(room, np.uint8), np.empty(room, np.int64), np.empty(room, np.int64)
        count, end = _scan_mcap(data, start, stop, op, body, size)
        if count <= room:
            return Records(op[:count], body[:count], size[:count], int(end))
        room = count
