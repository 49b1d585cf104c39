"""Columnar decoding of serialised messages (CDR of both byte orders, ROS 1).

One payload is walked; every payload that agrees with it in length and in all bytes that fix the layout is then
decoded by strided views. What remains starts the next round, up to a limit; the rest is decoded message by message.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from replay.readers.definitions import MessageType
from replay.readers.layout import Layout, LayoutError, layout_of

MAX_ROUNDS = 24
_ROW_BYTES = 8192


@dataclass(frozen=True)
class Part:
    """Numbers of some rows that share one layout.

    Attributes
    ----------
    rows : NDArray[np.int64], shape (m,)
        Row numbers, increasing.
    columns : Mapping[str, NDArray], each of shape (m,)
        Values by field path.
    skipped : tuple[str, ...]
        Arrays too long to become channels.
    """

    rows: NDArray[np.int64]
    columns: Mapping[str, NDArray[Any]]
    skipped: tuple[str, ...]


@dataclass
class Outcome:
    """What could not be decoded, or not in columns."""

    bad: int = 0
    reason: str = ""
    slow: int = 0


def decode(
    kind: MessageType, data: NDArray[np.uint8], starts: NDArray[np.int64], lengths: NDArray[np.int64], outcome: Outcome
) -> Iterator[Part]:
    """Decode payloads of one message type into columns.

    Parameters
    ----------
    kind : MessageType
        Their type.
    data : NDArray[np.uint8], shape (b,)
        Bytes that hold all payloads.
    starts, lengths : NDArray[np.int64], shape (n,)
        Place of each payload in `data`.
    outcome : Outcome
        Counts of undecodable and slowly decoded messages, added to.

    Yields
    ------
    Part
        Every decodable row stands in exactly one part.
    """
    for size in np.unique(lengths):
        left = np.flatnonzero(lengths == size)
        for _ in range(MAX_ROUNDS):
            if not len(left):
                break
            layout = _walk(kind, data, int(starts[left[0]]), int(size), outcome)
            if layout is None:
                left = left[1:]
                continue
            fits, columns = _extract(layout, data, starts[left])
            if columns:
                yield Part(left[fits], columns, layout.skipped)
            left = left[~fits]
        for row in left:  # slow fallback: layouts that hardly repeat
            layout = _walk(kind, data, int(starts[row]), int(size), outcome)
            if layout is not None:
                outcome.slow += 1
                rows = np.array([row])
                _, columns = _extract(layout, data, starts[rows])
                yield Part(rows, columns, layout.skipped)


def _walk(kind: MessageType, data: NDArray[np.uint8], start: int, size: int, outcome: Outcome) -> Layout | None:
    try:
        return layout_of(kind, data[start : start + size].tobytes())
    except LayoutError as error:
        outcome.bad += 1
        outcome.reason = outcome.reason or str(error)
        return None


def _extract(
    layout: Layout, data: NDArray[np.uint8], starts: NDArray[np.int64]
) -> tuple[NDArray[np.bool_], dict[str, NDArray[Any]]]:
    """Rows that fit the layout, and their columns."""
    span = layout.span
    whole = span <= _ROW_BYTES
    rows = _gather(data, starts, 0, span).view(np.uint8).reshape(len(starts), span) if whole and span else None

    def cells(offset: int, size: int) -> NDArray[np.uint8]:
        if rows is not None:
            return rows[:, offset : offset + size]
        return _gather(data, starts, offset, size).view(np.uint8).reshape(len(starts), size)

    fits = np.ones(len(starts), np.bool_)
    for offset, content in layout.checks:
        if content:
            fits &= (cells(offset, len(content)) == np.frombuffer(content, np.uint8)).all(axis=1)
    every = bool(fits.all())
    columns: dict[str, NDArray[Any]] = {}
    for slot in layout.slots:
        raw = cells(slot.offset, slot.dtype.itemsize)
        if not every:
            raw = raw[fits]
        values = np.ascontiguousarray(raw).view(slot.dtype).reshape(-1)
        columns[slot.path] = values.astype(slot.dtype.newbyteorder("="), copy=False)
    return fits, columns


def _gather(data: NDArray[np.uint8], starts: NDArray[np.int64], offset: int, size: int) -> NDArray[Any]:
    """Copy `size` bytes from each start + offset."""
    windows: NDArray[Any] = np.ndarray((len(data) - size + 1,), f"V{size}", data, strides=(1,))
    return windows[starts + offset]
