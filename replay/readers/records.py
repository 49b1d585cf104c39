"""Compiled walks over length-prefixed records (MCAP, ROS 1 bag)."""

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


@njit(cache=True)
def _scan_bag(data, start, stop, op, head, body, size, conn, stamp):  # type: ignore[no-untyped-def]
    """Fill up to len(op) bag records with connection and time; return how many and where the walk ended."""
    at, n = start, 0
    while at + 8 <= stop:
        head_size = np.int64(_little(data, at, 4))
        data_at = at + 4 + head_size
        if data_at + 4 > stop:
            break
        data_size = np.int64(_little(data, data_at, 4))
        if data_at + 4 + data_size > stop:
            break
        code, who, when = 0, np.int64(-1), np.int64(0)
        p = at + 4
        while p + 4 <= data_at:
            field = np.int64(_little(data, p, 4))
            if field < 3 or p + 4 + field > data_at:
                break
            q = p + 4
            if field == 4 and data[q] == 111 and data[q + 1] == 112 and data[q + 2] == 61:  # op=
                code = data[q + 3]
            elif field == 9 and data[q] == 99 and data[q + 3] == 110 and data[q + 4] == 61:  # conn=
                who = np.int64(_little(data, q + 5, 4))
            elif field == 13 and data[q] == 116 and data[q + 3] == 101 and data[q + 4] == 61:  # time=
                when = np.int64(_little(data, q + 5, 4)) * 1000000000 + np.int64(_little(data, q + 9, 4))
            p = q + field
        if p != data_at or code == 0:
            break
        if n < len(op):
            op[n], head[n], body[n], size[n], conn[n], stamp[n] = code, at + 4, data_at + 4, data_size, who, when
        n += 1
        at = data_at + 4 + data_size
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


class BagRecords(NamedTuple):
    """Records of a bag or of one of its chunks; `head` is where each record's header fields start."""

    op: NDArray[np.uint8]
    head: NDArray[np.int64]
    body: NDArray[np.int64]
    size: NDArray[np.int64]
    conn: NDArray[np.int64]
    stamp: NDArray[np.int64]
    end: int


def scan_bag(data: NDArray[np.uint8], start: int = 0, stop: int | None = None) -> BagRecords:
    """Walk ROS 1 bag records (header, data) as far as they are complete; `conn` −1 where a record has none."""
    stop = len(data) if stop is None else stop
    room = 1024
    while True:
        op = np.empty(room, np.uint8)
        head, body, size, conn, stamp = (np.empty(room, np.int64) for _ in range(5))
        count, end = _scan_bag(data, start, stop, op, head, body, size, conn, stamp)
        if count <= room:
            return BagRecords(
                op[:count], head[:count], body[:count], size[:count], conn[:count], stamp[:count], int(end)
            )
        room = count
