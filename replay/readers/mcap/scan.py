"""Stretches of an MCAP file as arrays: where records lie, and the messages among them by channel."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from replay.readers.common.compiled import plain
from replay.readers.mcap.collect_kernel import (
    scan_census,
    scan_chunk_heads,
    scan_chunk_indexes,
    scan_collect,
    scan_index_heads,
)
from replay.readers.mcap.format import CHANNELS, FOOTER, SOUND
from replay.readers.mcap.walk_kernel import scan_walk

MAX_NAMES = 1 << 16
BATCH = 1 << 19
_ROOM = 4096


class Walk(NamedTuple):
    """What stands in a stretch of bytes.

    Attributes
    ----------
    rows : NDArray[np.int64], shape (n, 4)
        Opcode, first byte, byte behind the last, and `SOUND` or `MENDED` (its opcode or one of its lengths was wrong);
        for runs of messages and of records of unknown type their number. `HOLE` rows hold no complete record.
    end : int
        Where the walk ended: behind the footer, or at the end of the bytes.
    """

    rows: NDArray[np.int64]
    end: int


class Tally:
    """Messages per channel and the stamps that bound them."""

    def __init__(self) -> None:
        self.counts = np.zeros(CHANNELS, np.int64)
        self.bounds = np.array([2**63 - 1, -1], np.int64)


def walk(
    data: NDArray[np.uint8], start: int, stop: int, named: NDArray[np.uint8], tally: Tally, inside: bool = False
) -> Walk:
    """Walk the records from `start` to `stop`, or to a footer; every byte stands in exactly one row.

    Parameters
    ----------
    data : NDArray[np.uint8], shape (b,)
        The bytes.
    start, stop : int
        The stretch to walk.
    named : NDArray[np.uint8], shape (65536,)
        1 for channels that are known; those met are added.
    tally : Tally
        Takes the messages met.
    inside : bool
        Whether these are the records of a chunk: names among messages belong to their runs.
    """
    _check_inside(data, start, stop)
    data, at, state = plain(data), start, np.zeros(4, np.int64)
    parts: list[NDArray[np.int64]] = []
    while at < stop:
        rows = np.empty((_ROOM, 4), np.int64)
        n, at = scan_walk(data, at, stop, inside, named, rows, tally.counts, tally.bounds, state)
        parts.append(rows[:n])
        if n and rows[n - 1, 0] == FOOTER and rows[n - 1, 3] == SOUND:
            break
    return Walk(np.concatenate(parts) if parts else np.empty((0, 4), np.int64), int(at))


def _check_inside(data: NDArray[np.uint8], start: int, stop: int) -> None:
    """Refuse a stretch that leaves the bytes, before compiled code that trusts it is entered."""
    if not 0 <= start <= stop <= len(data):
        raise IndexError(f"bytes {start} to {stop} do not lie within {len(data)} bytes")


class Census(NamedTuple):
    """What a stretch of sound records holds: messages per channel, places of name records, and where it ended."""

    channels: NDArray[np.int64]
    counts: NDArray[np.int64]
    names: NDArray[np.int64]
    unknown: int
    bounds: tuple[int, int]
    end: int


class Grouped(NamedTuple):
    """Messages of one channel: payload places and lengths, log and publish stamps [ns]."""

    channel: int
    body: NDArray[np.int64]
    size: NDArray[np.int64]
    log: NDArray[np.int64]
    publish: NDArray[np.int64]


class Scanner:
    """Scans stretches of sound records; keeps its scratch arrays from one to the next.

    A chunk's message indexes would find its messages a little sooner than a scan, but the difference is small beside
    decompression, and a scan finds what the indexes leave out.
    """

    def __init__(self) -> None:
        self._counts = np.zeros(CHANNELS, np.int64)
        self._slot = np.full(CHANNELS, -1, np.int64)
        self._touched = np.empty(CHANNELS, np.int64)
        self._names = np.empty((MAX_NAMES, 3), np.int64)

    def census(self, data: NDArray[np.uint8], start: int, stop: int) -> Census:
        """Count what stands in a stretch, up to `BATCH` messages. `data` of shape (bytes,)."""
        _check_inside(data, start, stop)
        bounds = np.array([2**63 - 1, -1], np.int64)
        _, met, named, other, end = scan_census(
            plain(data), start, stop, BATCH, self._counts, self._touched, self._names, bounds
        )  # fmt: skip
        channels = np.sort(self._touched[:met])
        counts = self._counts[channels]
        self._counts[channels] = 0
        unknown = other + max(named - MAX_NAMES, 0)
        return Census(
            channels, counts, self._names[: min(named, MAX_NAMES)], unknown, (int(bounds[0]), int(bounds[1])), int(end)
        )

    def collect(
        self,
        data: NDArray[np.uint8],
        start: int,
        census: Census,
        wanted: NDArray[np.bool_],
        window: tuple[int, int] | None,
    ) -> list[Grouped]:
        """Messages of the counted stretch, by channel, where `wanted` (shape as the census's channels) and in time."""
        channels, counts = census.channels[wanted], census.counts[wanted]
        if not len(channels):
            return []
        _check_inside(data, start, census.end)
        stops = np.cumsum(counts)
        first, last = (-(2**63), 2**63 - 1) if window is None else (window[0], window[1] - 1)
        body, size, log, publish = (np.empty(int(stops[-1]), np.int64) for _ in range(4))
        self._slot[channels] = stops - counts
        scan_collect(plain(data), start, census.end, self._slot, first, last, body, size, log, publish)
        filled = self._slot[channels]
        self._slot[channels] = -1
        return [
            Grouped(int(c), body[a:b], size[a:b], log[a:b], publish[a:b])
            for c, a, b in zip(channels, stops - counts, filled, strict=True)
            if b > a
        ]


def chunk_times(data: NDArray[np.uint8], rows: NDArray[np.int64]) -> NDArray[np.int64]:
    """First and last stamp that chunks state, shape (n, 2) [ns]; −1 where a record is too short to state them."""
    out = np.full((len(rows), 2), -1, np.int64)
    long = _within(data, rows, 25)
    heads = np.empty((int(long.sum()), 2), np.int64)
    scan_chunk_heads(plain(data), rows[long], heads)
    out[long] = heads
    return out


def _within(data: NDArray[np.uint8], rows: NDArray[np.int64], size: int) -> NDArray[np.bool_]:
    """Which records hold as many bytes, all of them in the data."""
    start, stop = rows[:, 1], rows[:, 2]
    within: NDArray[np.bool_] = (
        (start >= 0) & (start <= len(data) - size) & (stop - start >= size) & (stop <= len(data))
    )
    return within


def index_counts(data: NDArray[np.uint8], rows: NDArray[np.int64]) -> NDArray[np.int64]:
    """Channel and number of messages of message index records, shape (n, 2).

    Raises
    ------
    IndexError
        Where a message index does not lie within the bytes.
    """
    if not _within(data, rows, 15).all():
        raise IndexError("a message index does not lie within the bytes")
    out = np.empty((len(rows), 2), np.int64)
    scan_index_heads(plain(data), rows, out)
    return out


def chunk_indexes(data: NDArray[np.uint8], rows: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Chunk index records as rows, and their message indexes.

    Returns
    -------
    NDArray[np.int64], shape (n, 7)
        First and last stamp [ns], start, length, length of the message indexes, packed and full size [bytes].
    NDArray[np.int64], shape (m, 3)
        Row, channel and place of each message index.
    """
    out: NDArray[np.int64] = np.empty((len(rows), 7), np.int64)
    pairs: NDArray[np.int64] = np.empty((int((rows[:, 2] - rows[:, 1]).sum()) // 10, 3), np.int64)
    count = scan_chunk_indexes(plain(data), rows, out, pairs)
    return out, pairs[:count]
