"""Compiled scans over records that are known to be sound: messages by channel, heads of chunks and indexes."""

from __future__ import annotations

import numpy as np

from replay.arrays.compiling import njit
from replay.readers.mcap.format import CHANNEL, MESSAGE, MESSAGE_HEAD, SCHEMA
from replay.readers.mcap.numbers import u16, u32, u64


@njit(cache=True)
def scan_census(data, at, stop, most, counts, touched, names, bounds):  # type: ignore[no-untyped-def]
    """Count messages per channel over sound records, at most `most`; note channels met and name records."""
    n, met, named, other = 0, 0, 0, 0
    while at + 9 <= stop and n < most:
        length = u64(data, at + 1)
        op = data[at]
        if length > np.uint64(stop - at - 9) or op == 0:
            break
        if op == MESSAGE and length >= np.uint64(MESSAGE_HEAD):
            channel = np.int64(u16(data, at + 9))
            if counts[channel] == 0:
                touched[met] = channel
                met += 1
            counts[channel] += 1
            n += 1
            stamp = np.int64(u64(data, at + 15))
            if stamp >= 0:
                bounds[0], bounds[1] = min(bounds[0], stamp), max(bounds[1], stamp)
        elif op in (SCHEMA, CHANNEL):
            if named < len(names):
                names[named, 0], names[named, 1], names[named, 2] = op, at + 9, np.int64(length)
            named += 1
        else:
            other += 1
        at += 9 + np.int64(length)
    return n, met, named, other, at


@njit(cache=True)
def scan_collect(data, at, stop, slot, first, last, body, size, log, publish):  # type: ignore[no-untyped-def]
    """Place messages of wanted channels (slot ≥ 0) that lie in the window, grouped by channel."""
    while at + 9 <= stop:
        length = np.int64(u64(data, at + 1))
        if data[at] == MESSAGE and length >= MESSAGE_HEAD:
            channel = np.int64(u16(data, at + 9))
            k = slot[channel]
            if k >= 0:
                stamp = np.int64(u64(data, at + 15))
                if first <= stamp <= last:
                    body[k], size[k] = at + 9 + MESSAGE_HEAD, length - MESSAGE_HEAD
                    log[k], publish[k] = stamp, np.int64(u64(data, at + 23))
                    slot[channel] = k + 1
        at += 9 + length


@njit(cache=True)
def scan_chunk_heads(data, rows, out):  # type: ignore[no-untyped-def]
    """First and last stamp of each chunk."""
    for i in range(len(rows)):
        at = rows[i, 1]
        for k in range(2):
            out[i, k] = np.int64(u64(data, at + 9 + 8 * k))


@njit(cache=True)
def scan_index_heads(data, rows, out):  # type: ignore[no-untyped-def]
    """Channel and number of entries of each message index."""
    for i in range(len(rows)):
        at = rows[i, 1]
        out[i, 0] = np.int64(u16(data, at + 9))
        out[i, 1] = np.int64(u32(data, at + 11)) // 16


@njit(cache=True)
def scan_chunk_indexes(data, rows, out, pairs):  # type: ignore[no-untyped-def]
    """Fields of chunk index records, and (chunk, channel, offset) of their message indexes; returns their number."""
    n = 0
    for i in range(len(rows)):
        at = rows[i, 1] + 9
        for k in range(4):
            out[i, k] = np.int64(u64(data, at + 8 * k))
        size = np.int64(u32(data, at + 32)) // 10
        for j in range(size):
            p = at + 36 + 10 * j
            pairs[n, 0], pairs[n, 1] = i, np.int64(u16(data, p))
            pairs[n, 2] = np.int64(u64(data, p + 2))
            n += 1
        p = at + 36 + np.int64(u32(data, at + 32))
        out[i, 4] = np.int64(u64(data, p))
        text = np.int64(u32(data, p + 8))
        out[i, 5] = np.int64(u64(data, p + 12 + text))
        out[i, 6] = np.int64(u64(data, p + 20 + text))
    return n
