"""Compiled walks over the bytes of an MCAP file that trust no length without looking at what it leads to.

A record is an opcode (u8), a length (u64) and its content. A record *fits* where its inner lengths agree with its own;
a walk goes on where the next record fits too, and searches byte by byte for the next place from which several records
follow one another where it does not.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from replay.arrays.compiling import njit
from replay.readers.common.compiled import part
from replay.readers.mcap.format import (
    ATTACHMENT,
    ATTACHMENT_INDEX,
    CHANNEL,
    CHUNK,
    CHUNK_INDEX,
    DATA_END,
    FOOTER,
    HEADER,
    HOLE,
    MENDED,
    MESSAGE,
    MESSAGE_HEAD,
    MESSAGE_INDEX,
    METADATA,
    METADATA_INDEX,
    PRIVATE,
    SCHEMA,
    SHORT,
    SOUND,
    STATISTICS,
    SUMMARY_OFFSET,
)
from replay.readers.mcap.numbers import u16, u32, u64

_SLACK = 64


@njit(cache=True, no_cpython_wrapper=True)
def _end(data, at, stop):  # type: ignore[no-untyped-def]
    """End of the record by its length, or −1 where it leaves the bytes."""
    if at + 9 > stop:
        return np.int64(-1)
    length = u64(data, at + 1)
    if length > np.uint64(stop - at - 9):
        return np.int64(-1)
    return np.int64(at + 9) + np.int64(length)


@njit(cache=True, no_cpython_wrapper=True)
def _over(data, at, end, parts):  # type: ignore[no-untyped-def]
    """Behind `parts` length-prefixed parts, or −1 where they leave the record."""
    for _ in range(parts):
        if at < 0 or at + 4 > end:
            return np.int64(-1)
        size = np.int64(u32(data, at))
        if size > end - at - 4:
            return np.int64(-1)
        at += 4 + size
    return np.int64(at)


@njit(cache=True, no_cpython_wrapper=True)
def _chunk_fits(data, at, end):  # type: ignore[no-untyped-def]
    """Whether a record of any opcode has the content of a chunk: the packed size ends where the record does."""
    if end - at < 49:
        return False
    text = np.int64(u32(data, at + 37))
    if text > 16 or at + 49 + text > end:
        return False
    packed = u64(data, at + 41 + text)
    left = end - at - 49 - text
    return packed <= np.uint64(left) and np.int64(packed) >= left - _SLACK


@njit(cache=True, no_cpython_wrapper=True)
def _fits(data, at, stop):  # type: ignore[no-untyped-def]
    """End of the record where its content agrees with its length, else −1."""
    end = _end(data, at, stop)
    if end < 0:
        return end
    op, body, size = data[at], at + 9, end - at - 9
    if op == MESSAGE:
        return end if size >= MESSAGE_HEAD else np.int64(-1)
    if op == CHUNK:
        return end if _chunk_fits(data, at, end) else np.int64(-1)
    last = np.int64(-1)
    if op == MESSAGE_INDEX:
        last = _over(data, body + 2, end, 1)
    elif op == HEADER:
        last = _over(data, body, end, 2)
    elif op == SCHEMA:
        last = _over(data, body + 2, end, 3)
    elif op == CHANNEL:
        last = _over(data, body + 4, end, 3)
    elif op == METADATA:
        last = _over(data, body, end, 2)
    elif op == STATISTICS:
        last = _over(data, body + 42, end, 1)
    elif op == METADATA_INDEX:
        last = _over(data, body + 16, end, 1)
    elif op == ATTACHMENT_INDEX:
        last = _over(data, body + 40, end, 2)
    elif op == CHUNK_INDEX:
        last = _over(data, body + 32, end, 1)
        if last >= 0:
            last = _over(data, last + 8, end, 1)
        if last >= 0:
            last += 16
    elif op == ATTACHMENT:
        last = _over(data, body + 16, end, 2)
        if last < 0 or last + 12 > end or u64(data, last) > np.uint64(end - last - 12):
            return np.int64(-1)
        last += 12 + np.int64(u64(data, last))
    elif op == FOOTER:
        last = body + 20
    elif op == DATA_END:
        last = body + 4
    elif op == SUMMARY_OFFSET:
        last = body + 17
    elif op >= PRIVATE and (end == stop or (_end(data, end, stop) >= 0 and data[end] != 0)):
        last = end
    if last < 0 or last > end or last < end - _SLACK:
        return np.int64(-1)
    return end


@njit(cache=True, no_cpython_wrapper=True)
def _packed(data, at, stop):  # type: ignore[no-untyped-def]
    """Whether a zstd or lz4 frame begins where that of a chunk would."""
    for text in (3, 4):
        p = at + 49 + text
        if p + 4 <= stop and (u32(data, p) == np.uint64(0xFD2FB528) or u32(data, p) == np.uint64(0x184D2204)):
            return True
    return False


@njit(cache=True, no_cpython_wrapper=True)
def _mended(data, at, stop):  # type: ignore[no-untyped-def]
    """End of a record whose opcode, content or length is wrong, where something else tells it, else −1."""
    end = _end(data, at, stop)
    if end >= 0 and (end == stop or _fits(data, end, stop) >= 0):
        return end
    if data[at] != CHUNK and not _packed(data, at, stop):
        return np.int64(-1)
    for text in (0, 3, 4):
        if at + 49 + text > stop or u32(data, at + 37) != np.uint64(text):
            continue
        packed = u64(data, at + 41 + text)
        if packed and packed <= np.uint64(stop - at - 49 - text):
            end = np.int64(at + 49 + text) + np.int64(packed)
            if end < stop and _fits(data, end, stop) >= 0:
                return end
    return np.int64(-1)


@njit(cache=True, no_cpython_wrapper=True)
def _named(data, at, named):  # type: ignore[no-untyped-def]
    """Whether the record is no message, or one of a channel that is named."""
    return data[at] != MESSAGE or named[np.int64(u16(data, at + 9))] > 0


@njit(cache=True, no_cpython_wrapper=True)
def _resume(data, at, stop, named, packed):  # type: ignore[no-untyped-def]
    """First place from which three records follow one another, or fewer up to the end; −1 where there is none.

    In a file of compressed chunks (`packed`) messages and their names are not looked for: what resembles them there
    stands inside a frame, whose bytes lie between theirs.
    """
    for p in range(at, stop - 8):
        op = data[p]
        if op == 0 or op > DATA_END or data[p + 8] or data[p + 7] or data[p + 6]:
            continue
        if packed and (op in (MESSAGE, SCHEMA, CHANNEL)):
            continue
        q, links = np.int64(p), 0
        while links < 3 and q != stop:
            end = _fits(data, q, stop)
            if end < 0 or not _named(data, q, named):
                break
            if data[q] == FOOTER:
                links = 3 if end - q == 29 and end + 8 == stop else -1
                break
            q = end
            links += 1
        if links == 3 or (q == stop and links > 0):
            return np.int64(p)
    return np.int64(-1)


@njit(cache=True, no_cpython_wrapper=True)
def _cut(data, at, stop):  # type: ignore[no-untyped-def]
    """Whether a record that the end of the bytes cuts off may start here."""
    return at + 9 > stop or (0 < data[at] <= DATA_END and u64(data, at + 1) < np.uint64(1 << 40))


@part
def _count(data: NDArray[np.uint8], at: int, counts: NDArray[np.int64], bounds: NDArray[np.int64]) -> None:
    """Count a message and widen the bounds of the stamps."""
    counts[np.int64(u16(data, at + 9))] += 1
    stamp = np.int64(u64(data, at + 15))
    if stamp >= 0:
        bounds[0], bounds[1] = min(bounds[0], stamp), max(bounds[1], stamp)


@part
def _add_hole(rows: NDArray[np.int64], n: int, at: int, end: int) -> int:
    rows[n, 0], rows[n, 1], rows[n, 2], rows[n, 3] = HOLE, at, end, 0
    return n + 1


@part
def _add_row(rows: NDArray[np.int64], n: int, op: Any, at: int, end: int, flag: int) -> int:
    """Add a record to the rows, to the last one where messages or unknown records follow one another; how many there are."""
    many = op == MESSAGE or op > DATA_END
    if many and n and rows[n - 1, 0] == op and rows[n - 1, 2] == at:
        rows[n - 1, 2] = end
        rows[n - 1, 3] += 1
        return n
    rows[n, 0], rows[n, 1], rows[n, 2], rows[n, 3] = op, at, end, 1 if many else flag
    return n + 1


@njit(cache=True)
def scan_walk(data, at, stop, inside, named, rows, counts, bounds, state):  # type: ignore[no-untyped-def]
    """Fill rows until they are full or the bytes end.

    inside: whether these are the records of a chunk, so that names may stand among messages and nothing else is wanted.
    state: end and flag of the record ahead, whether chunks are compressed, and whether the walk has just resumed.
    counts, bounds: messages per channel outside chunks, and the lowest and highest log stamp of them.
    """
    n = 0
    end, flag, packed, resumed = state[0], state[1], state[2] > 0, state[3] > 0
    if end == 0:
        end, flag = _fits(data, at, stop), SOUND
        if end < 0:
            end, flag = _mended(data, at, stop), MENDED
    while at < stop and n + 3 <= len(rows):
        if end < 0:
            packed = packed or (data[at] == CHUNK and _packed(data, at, stop))
            again = _resume(data, at + 1, stop, named, packed)
            if again < 0:
                again = stop
            n = _add_hole(rows, n, at, again)
            at, resumed = again, True
            end, flag = (_fits(data, at, stop), SOUND) if at < stop else (np.int64(-1), SOUND)
            continue
        op = np.int64(data[at])
        if op == CHANNEL and end - at >= 11:
            named[np.int64(u16(data, at + 9))] = 1
        ended = op == FOOTER and flag == SOUND
        after, after_flag = np.int64(-1), SOUND
        if end < stop and not ended:
            after = _fits(data, end, stop)
            if after < 0:
                after, after_flag = _mended(data, end, stop), MENDED
            if after < 0 and not (op == CHUNK and flag == SOUND):
                again = _resume(data, at + 1, stop, named, packed)
                wrong = 0 <= again < end  # its length leads past a record
                if not wrong and op == MESSAGE and resumed and (again >= 0 or not _cut(data, end, stop)):
                    wrong, again = True, max(again, end)  # behind damage, and nothing confirms its length
                if wrong:
                    n = _add_hole(rows, n, at, again)
                    at, resumed = again, True
                    end, flag = _fits(data, at, stop), SOUND
                    continue
        if (flag == MENDED or op > DATA_END) and op != CHUNK and _chunk_fits(data, at, end):
            op, flag = np.int64(CHUNK), MENDED
        if op == CHUNK:
            packed = packed or _packed(data, at, stop)
        if op != MESSAGE:
            resumed = False
        if op == MESSAGE and flag == SOUND:
            _count(data, at, counts, bounds)
        elif op == MESSAGE:
            op = np.int64(SHORT + MESSAGE)
        elif inside:
            op = np.int64(MESSAGE if op in (SCHEMA, CHANNEL) and flag == SOUND else SHORT)
        n = _add_row(rows, n, op, at, end, flag)
        at, end, flag = end, after, after_flag
        if ended:
            break
    state[0], state[1], state[2], state[3] = end, flag, packed, resumed
    return n, at
