"""Compiled walk over the records of a ROS 1 bag, which finds its way again behind damaged bytes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from replay.arrays.compiling import njit
from replay.readers.common.compiled import plain

MESSAGE, HEADER, INDEX, CHUNK, INFO, CONNECTION = 2, 3, 4, 5, 6, 7
MAX_FIELDS = 64
_LONGEST_HEAD = 1 << 16


class BagRecords(NamedTuple):
    """Records of a bag or of one of its chunks, in order.

    Attributes
    ----------
    op : NDArray[np.uint8], shape (n,)
        Record type.
    head, body, size : NDArray[np.int64], shape (n,)
        Where header fields and data start, and length of the data [bytes].
    conn, stamp : NDArray[np.int64], shape (n,)
        Connection (−1 where a record has none) and time [ns].
    end : int
        End of the last complete record.
    lost, gaps, first : int
        Bytes that belong to no record, in how many places, and where the first of them is (−1: none).
    mended : int
        Records whose length was wrong and was taken from where the next record starts.
    """

    op: NDArray[np.uint8]
    head: NDArray[np.int64]
    body: NDArray[np.int64]
    size: NDArray[np.int64]
    conn: NDArray[np.int64]
    stamp: NDArray[np.int64]
    end: int
    lost: int
    gaps: int
    first: int
    mended: int


@njit(cache=True, no_cpython_wrapper=True)
def _u32(data, at):  # type: ignore[no-untyped-def]
    return (
        np.int64(data[at]) | np.int64(data[at + 1]) << 8 | np.int64(data[at + 2]) << 16 | np.int64(data[at + 3]) << 24
    )


@njit(cache=True, no_cpython_wrapper=True)
def _record(data, at, stop):  # type: ignore[no-untyped-def]
    """Parse the header at `at`: (type or 0, place of the data's length, connection, time, fields it must have)."""
    if at + 8 > stop:
        return 0, at, np.int64(-1), np.int64(0), False
    head = _u32(data, at)
    body = at + 4 + head
    if head < 8 or head > _LONGEST_HEAD or body + 4 > stop:
        return 0, at, np.int64(-1), np.int64(0), False
    op, conn, stamp = 0, np.int64(-1), np.int64(0)
    named = timed = sized = packed = placed = False
    p, fields = at + 4, 0
    while p + 4 <= body and fields < MAX_FIELDS:  # a header of tiny fields would be walked again from each of its bytes
        fields += 1
        length = _u32(data, p)
        q = p + 4
        p = q + length
        if length < 3 or p > body:
            return 0, at, conn, stamp, False
        if length == 4 and data[q] == 111 and data[q + 1] == 112 and data[q + 2] == 61:  # op=
            op = int(data[q + 3])
        elif length == 9 and data[q] == 99 and data[q + 3] == 110 and data[q + 4] == 61:  # conn=
            conn, named = _u32(data, q + 5), True
        elif length == 13 and data[q] == 116 and data[q + 3] == 101 and data[q + 4] == 61:  # time=
            stamp, timed = _u32(data, q + 5) * 1000000000 + _u32(data, q + 9), True
        elif length == 9 and data[q] == 115 and data[q + 3] == 101 and data[q + 4] == 61:  # size=
            sized = True
        elif length >= 12 and data[q] == 99 and data[q + 10] == 110 and data[q + 11] == 61:  # compression=
            packed = True
        elif length == 18 and (data[q] == 99 or data[q] == 105):  # chunk_pos=, index_pos= with its eight bytes
            placed = True
    if p != body or op < 2 or op > 7:
        return 0, at, conn, stamp, False
    sure = (
        (op == 2 and named and timed)
        or (op == 5 and sized and packed)
        or (op == 4 and named)
        or (op == 7 and named)
        or (op == 6 and placed)
        or op == 3
    )
    return op, body, conn, stamp, sure


@njit(cache=True)
def _find(data, start, stop, outer):  # type: ignore[no-untyped-def]
    """Place of the next record that is complete in all its fields; stop where there is none.

    Before `outer` only records count that never stand inside a chunk: compressed ones hold some of theirs as they are.
    """
    for at in range(start, stop - 7):
        # the header is short and its first field lies in it: all but a few places fail here, zeros among them
        if data[at + 2] or data[at + 3] or data[at + 6] or data[at + 7] or not (data[at] | data[at + 1]):
            continue
        op, body, _, _, sure = _record(data, at, stop)
        if op and sure and (body + 4 + _u32(data, body) <= stop or op == 5) and (at >= outer or 4 <= op <= 6):
            return at
    return stop


@njit(cache=True)
def _scan(data, start, stop, op, head, body, size, conn, stamp):  # type: ignore[no-untyped-def]
    at, n, end = start, 0, start
    lost, gaps, first, mended = 0, 0, -1, 0
    last_body, last_op, last = np.int64(-1), 0, False
    bare, found = np.int64(-1), np.int64(-1)  # no record starts from the one up to the other
    while at < stop:
        code, data_at, who, when, sure = _record(data, at, stop)
        inner = data_at + 4
        length = _u32(data, data_at) if code else np.int64(0)
        if code and inner + length > stop and sure and code == 2:
            # a message whose length cannot be right: it ends where the next record starts
            if not bare <= inner <= found:  # records within records may lead here again and again
                bare, found = inner, _find(data, inner, stop, np.int64(0))
            again = found
            if again < stop:
                length = again - inner
                mended += 1
        if not code or inner + length > stop:
            if code == 5 and sure:
                break  # a chunk that is cut off, or whose length is wrong: the caller looks into it
            again = _find(data, last_body if last else at + 1, stop, at if last_op == 5 else np.int64(0))
            if again < at and n and n <= len(op):
                size[n - 1] = again - body[n - 1]
                mended += 1
            elif again >= at and last and n <= len(op) and op[n - 1] == 5:
                size[n - 1] = again - body[n - 1]  # a chunk knows its own end
                mended += 1
            elif again >= at:
                if first < 0:
                    first = at
                lost, gaps = lost + again - at, gaps + 1
            at, last = again, False
            continue
        if n < len(op):
            op[n], head[n], body[n], size[n], conn[n], stamp[n] = code, at + 4, inner, length, who, when
        n += 1
        last_body, last_op, last = inner, code, True
        at = end = inner + length
    return n, at, end, lost, gaps, first, mended


def end_of_chunk(data: NDArray[np.uint8], body: int) -> int:
    """Where the record behind a chunk starts whose length is not to be trusted; the end of the data without one.

    `data` of shape (bytes,).

    Raises
    ------
    IndexError
        Where the chunk begins before the data.
    """
    if body < 0:
        raise IndexError(f"byte {body} is not one of {len(data)} bytes")
    return int(_find(data, body, len(data), len(data)))


def scan_bag(data: NDArray[np.uint8], start: int = 0, stop: int | None = None) -> BagRecords:
    """Walk the records of a bag or chunk.

    The walk ends early only at a chunk that reaches beyond `stop`. Bytes that form no record are passed over up to the
    next place where one starts with all its fields; a record whose length leads astray ends there.

    Parameters
    ----------
    data : NDArray[np.uint8], shape (b,)
        Bytes of the bag or chunk.
    start, stop : int
        Where the walk starts and ends [bytes]; what of it leaves the data is not walked.

    Raises
    ------
    IndexError
        Where `start` is negative.
    """
    data = plain(data)
    stop = len(data) if stop is None else min(stop, len(data))
    if start < 0:
        raise IndexError(f"byte {start} is not one of {len(data)} bytes")
    room = max(64, min(1 << 16, (stop - start) // 64))
    while True:
        op = np.empty(room, np.uint8)
        head, body, size, conn, stamp = (np.empty(room, np.int64) for _ in range(5))
        count, at, end, lost, gaps, first, mended = _scan(data, start, stop, op, head, body, size, conn, stamp)
        if count <= room:
            if at < stop:
                lost, gaps, first = lost + stop - at, gaps + 1, at if first < 0 else first
            return BagRecords(
                op[:count], head[:count], body[:count], size[:count], conn[:count], stamp[:count],
                int(end), int(lost), int(gaps), int(first), int(mended),
            )  # fmt: skip
        room = count
