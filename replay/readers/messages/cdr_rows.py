"""What the compiled loops over serialised messages are given: payloads, layout or program, and the table they fill."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

FREE, BAD = -1, -2  # owners of a row that no table has, and of a damaged one
_SHORT = 64
_NUMBERS = tuple(np.dtype(f"u{size}") for size in (1, 2, 4, 8))
Ints = NDArray[np.int64]


class Payloads(NamedTuple):
    """Payloads of one connection.

    Attributes
    ----------
    b1, b2, b4, b8 : NDArray
        Bytes as numbers of 1, 2, 4 and 8 bytes that start at every byte.
    limit : int
        How many of the bytes may hold payloads.
    starts, lengths, slots : NDArray[np.int64], shape (n,)
        Place of each payload, and its row in the batch.
    """

    b1: NDArray[np.uint8]
    b2: NDArray[np.uint16]
    b4: NDArray[np.uint32]
    b8: NDArray[np.uint64]
    limit: int
    starts: Ints
    lengths: Ints
    slots: Ints

    def payload(self, row: int) -> bytes:
        """Copy one payload."""
        start, size = int(self.starts[row]), int(self.lengths[row])
        if start < 0 or size < 0 or start + size > self.limit:
            return b""
        raw: bytes = self.b1[start : start + size].tobytes()
        return raw


class FixedLayout(NamedTuple):
    """Where the numbers of payloads lie that are all alike.

    Attributes
    ----------
    size : int
        Bytes of a payload.
    swap : bool
        Whether its numbers are big-endian.
    check_at, check_mask, check_word : NDArray, shape (c,)
        Bytes that fix the layout: eight from a place on, those of them that count, and what they must be.
    at1, to1, at2, to2, at4, to4, at8, to8 : NDArray[np.int64]
        Offset of each number of 1, 2, 4 and 8 bytes, and its column.
    """

    size: int
    swap: bool
    check_at: Ints
    check_mask: NDArray[np.uint64]
    check_word: NDArray[np.uint64]
    at1: Ints
    to1: Ints
    at2: Ints
    to2: Ints
    at4: Ints
    to4: Ints
    at8: Ints
    to8: Ints


class Steps(NamedTuple):
    """A program (`replay.readers.messages.cdr_program`) and the columns of one table that it fills.

    Attributes
    ----------
    ops : NDArray[np.int64], shape (n, 5)
        Operation and operands.
    names : NDArray[np.uint8]
        Bytes of all names, one after another.
    head : NDArray[np.uint8]
        Bytes that start every payload; none in ROS 1.
    swap : bool
        Whether numbers are big-endian.
    biggest : int
        Largest alignment; 0 where nothing is aligned.
    slack : int
        Bytes that may follow the last value.
    places : NDArray[np.int64]
        Column of each number of the program.
    hidden : NDArray[np.int64]
        Those of its numbers that are counts.
    """

    ops: Ints
    names: NDArray[np.uint8]
    head: NDArray[np.uint8]
    swap: bool
    biggest: int
    slack: int
    places: Ints
    hidden: Ints


class OpenTable(NamedTuple):
    """Room for a batch in a table.

    Attributes
    ----------
    owner : NDArray[np.int32]
        Table that has each row of the batch, or `FREE` or `BAD`.
    number : int
        The table's own.
    first : int
        Where in the cells the batch begins.
    out1, out2, out4, out8 : NDArray, shape (columns, rows)
        Cells of 1, 2, 4 and 8 bytes.
    """

    owner: NDArray[np.int32]
    number: int
    first: int
    out1: NDArray[np.uint8]
    out2: NDArray[np.uint16]
    out4: NDArray[np.uint32]
    out8: NDArray[np.uint64]


def views(data: NDArray[np.uint8]) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any], NDArray[Any]]:
    """View bytes as numbers of 1, 2, 4 and 8 bytes that start at every byte.

    `data` of shape (bytes,), the views of shape (bytes − width + 1,).
    """
    data = data.view(np.ndarray)
    if len(data) < _SHORT or not data.flags.c_contiguous:
        data = np.concatenate([data, np.zeros(_SHORT, np.uint8)])
    data.flags.writeable = False  # so are all views of it: one compiled version serves all
    size = len(data)
    b1, b2, b4, b8 = (np.ndarray((size + 1 - d.itemsize,), d, data, strides=(1,)) for d in _NUMBERS)
    return b1, b2, b4, b8
