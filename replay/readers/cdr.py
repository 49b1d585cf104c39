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
GIVE_UP = 500
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


class Decoder:
    """Decodes payloads of one message type; remembers the layouts it has met.

    Parameters
    ----------
    kind : MessageType
        The type of all payloads.
    outcome : Outcome
        Counts of undecodable and slowly decoded messages, added to.
    """

    def __init__(self, kind: MessageType, outcome: Outcome) -> None:
        self.kind, self.outcome = kind, outcome
        self.met: dict[int, list[Layout]] = {}

    def decode(self, data: NDArray[np.uint8], starts: NDArray[np.int64], lengths: NDArray[np.int64]) -> Iterator[Part]:
        """Decode payloads into columns.

        Parameters
        ----------
        data : NDArray[np.uint8], shape (b,)
            Bytes that hold all payloads.
        starts, lengths : NDArray[np.int64], shape (n,)
            Place of each payload in `data`.

        Yields
        ------
        Part
            Every decodable row stands in exactly one part.
        """
        for size in np.unique(lengths):
            left = np.flatnonzero(lengths == size)
            met = self.met.setdefault(int(size), [])
            for layout in met:
                left, part = _take(layout, data, starts, left)
                if part is not None:
                    yield part
            while len(left) and len(met) < MAX_ROUNDS and not self._hopeless():
                new = self._walk(data, int(starts[left[0]]), int(size))
                if new is None:
                    left = left[1:]
                    continue
                met.append(new)
                left, part = _take(new, data, starts, left)
                if part is not None:
                    yield part
            if self._hopeless():
                self.outcome.bad += len(left)
                continue
            for row in left:  # slow fallback: layouts that hardly repeat
                single = self._walk(data, int(starts[row]), int(size))
                if single is not None:
                    self.outcome.slow += 1
                    part = _take(single, data, starts, np.array([row]))[1]
                    if part is not None:
                        yield part

    def _hopeless(self) -> bool:
        """Whether so many payloads failed and none fitted that the definition is not theirs."""
        return self.outcome.bad >= GIVE_UP and not any(self.met.values())

    def _walk(self, data: NDArray[np.uint8], start: int, size: int) -> Layout | None:
        try:
            return layout_of(self.kind, data[start : start + size].tobytes())
        except LayoutError as error:
            self.outcome.bad += 1
            self.outcome.reason = self.outcome.reason or str(error)
            return None


def _take(
    layout: Layout, data: NDArray[np.uint8], starts: NDArray[np.int64], rows: NDArray[np.int64]
) -> tuple[NDArray[np.int64], Part | None]:
    """Decode the rows that fit a layout; return the others."""
    if not len(rows):
        return rows, None
    fits, columns = _extract(layout, data, starts[rows])
    part = Part(rows[fits], columns, layout.skipped) if fits.any() and (columns or layout.skipped) else None
    return rows[~fits], part


def _extract(
    layout: Layout, data: NDArray[np.uint8], starts: NDArray[np.int64]
) -> tuple[NDArray[np.bool_], dict[str, NDArray[Any]]]:
    """Rows that fit the layout, and their columns."""
    span, fixed = layout.span, layout.fixed
    if not span:
        return np.ones(len(starts), np.bool_), {}
    if span > _ROW_BYTES:
        return _extract_far(layout, data, starts)
    rows = _gather(data, starts, 0, span).view(np.uint8).reshape(len(starts), span)
    fits: NDArray[np.bool_] = (rows[:, fixed[0]] == fixed[1]).all(axis=1)
    if not fits.all():
        rows = rows[fits]
    return fits, {s.path: _native(rows[:, s.offset : s.offset + s.dtype.itemsize], s.dtype) for s in layout.slots}


def _extract_far(
    layout: Layout, data: NDArray[np.uint8], starts: NDArray[np.int64]
) -> tuple[NDArray[np.bool_], dict[str, NDArray[Any]]]:
    """Do the same cell by cell, for long payloads of which few bytes are wanted."""
    fits = np.ones(len(starts), np.bool_)
    for offset, content in layout.checks:
        if content:
            cells = _gather(data, starts, offset, len(content)).view(np.uint8).reshape(len(starts), -1)
            fits &= (cells == np.frombuffer(content, np.uint8)).all(axis=1)
    kept = starts[fits]
    sizes = ((s, s.dtype.itemsize) for s in layout.slots)
    return fits, {
        s.path: _native(_gather(data, kept, s.offset, n).view(np.uint8).reshape(-1, n), s.dtype) for s, n in sizes
    }


def _native(cells: NDArray[np.uint8], dtype: np.dtype[Any]) -> NDArray[Any]:
    """Bytes of shape (n, size) as n numbers in this machine's byte order."""
    values = np.ascontiguousarray(cells).view(dtype).reshape(-1)
    return values.astype(dtype.newbyteorder("="), copy=False)


def _gather(data: NDArray[np.uint8], starts: NDArray[np.int64], offset: int, size: int) -> NDArray[Any]:
    """Copy `size` bytes from each start + offset."""
    windows: NDArray[Any] = np.ndarray((len(data) - size + 1,), f"V{size}", data, strides=(1,))
    return windows[starts + offset]
