"""Tables that grow while a log is read: numbers of one topic, in recorded order, in memory or in a temporary file.

Decoders write whole batches into a table's open grid. What every message holds needs no row numbers. A grid that is
full is kept as it is; grids are joined, each let go of in turn, when the log has ended, or sent to temporary files
before that where they would outgrow memory.
"""

from __future__ import annotations

import mmap
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import accumulate
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from replay.arrays.column_store import Column, ColumnStore
from replay.errors import LogError
from replay.readers.messages.cdr_program import Spec
from replay.readers.messages.encodings import width_of

SIZES = (1, 2, 4, 8)
_FEWEST_ROWS = 256
_MOST_BYTES = 64 << 20
_COPY_BYTES = 4 << 20
_MOST_FORETOLD = 1 << 40

Rows = NDArray[np.int64]
Cells = tuple[Rows | None, NDArray[Any]]


def _stored(spec: Spec) -> str:
    """Number type of a column in memory: truth values are bytes, hidden counts 32-bit."""
    return {"#": "u4", "?": "u1"}.get(spec.dtype, spec.dtype)


@dataclass
class Budget:
    """Memory that may be taken on the word of an index, which may be wrong [bytes]."""

    left: int = 0

    def take(self, size: int) -> bool:
        """Take memory, unless there is not so much left."""
        if not 0 < size <= self.left:
            return False
        self.left -= size
        return True


class _Spill:
    """Columns in one temporary file: many of them are long together, and each file of its own would be too many.

    Each column has its place for `expected` rows; where more come, all move to a file with more room.
    """

    def __init__(self, dtypes: list[np.dtype[Any]], expected: int) -> None:
        self.dtypes = dtypes
        self.rows = 0
        self.room = max(expected, 1)
        self.file = _scratch()

    def _first(self, rows: int) -> list[int]:
        """Where each column stands if it has room for so many rows, and the size of all [bytes]."""
        return list(accumulate(((rows * d.itemsize + 63) // 64 * 64 for d in self.dtypes), initial=0))

    def append(self, columns: Iterable[NDArray[Any]], rows: int) -> None:
        """Add rows, column by column."""
        if self.rows + rows > self.room:
            self._widen(max(2 * self.room, self.rows + rows))
        with _room():
            for start, dtype, column in zip(self._first(self.room), self.dtypes, columns, strict=False):
                self.file.seek(start + self.rows * dtype.itemsize)
                self.file.write(np.ascontiguousarray(column).view(np.uint8).data)
        self.rows += rows

    def _widen(self, room: int) -> None:
        """Move all columns to a file with more room."""
        with _room(), self.file as file:
            self.file = _scratch()
            for old, new, dtype in zip(self._first(self.room), self._first(room), self.dtypes, strict=False):
                file.seek(old)
                self.file.seek(new)
                left = self.rows * dtype.itemsize
                while left > 0:
                    left -= self.file.write(file.read(min(left, _COPY_BYTES)))
        self.room = room

    def finish(self) -> list[NDArray[Any]]:
        """Return all columns as views of one map of the file."""
        first = self._first(self.room)
        with self.file as file:
            if not self.rows or not first[-1]:
                return [np.empty(self.rows, d) for d in self.dtypes]
            with _room():
                file.truncate(first[-1])
                file.flush()
            mapped = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_COPY)
        return [np.frombuffer(mapped, d, self.rows, start) for d, start in zip(self.dtypes, first, strict=False)]


def _scratch() -> IO[bytes]:
    with _room():
        return tempfile.TemporaryFile(prefix="mfhca-")


@contextmanager
def _room() -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise LogError(
            f"the temporary folder {tempfile.gettempdir()} cannot take the log's columns: {error.strerror or error}; "
            "set TMPDIR to a folder with more room"
        ) from error


class Grid:
    """Room for rows, grouped by the size of a number; shape (columns, rows) each."""

    def __init__(self, counts: tuple[int, ...], rows: int) -> None:
        self.rows = rows // 64 * 64 + 72 if rows else 0  # so that columns start in different cache sets
        self.cells: tuple[NDArray[Any], ...] = tuple(
            np.empty((n, self.rows if n else 0), f"u{size}") for n, size in zip(counts, SIZES, strict=True)
        )


class Table:
    """Columns that some or all messages of a topic fill together.

    Parameters
    ----------
    number : int
        Its number among the topic's tables.
    specs : tuple[Spec, ...]
        Its columns.
    store : ColumnStore
        Where long columns stand.
    expected : int
        How many rows are foretold; 0 where nothing is known.
    budget : Budget or None
        Where room for them is taken from.
    """

    def __init__(
        self,
        number: int,
        specs: tuple[Spec, ...],
        store: ColumnStore,
        expected: int = 0,
        budget: Budget | None = None,
    ) -> None:
        self.number, self.specs, self.store = number, specs, store
        widths = [width_of(_stored(s)) for s in specs]
        self.counts = tuple(widths.count(size) for size in SIZES)
        seen = dict.fromkeys(SIZES, -1)
        self.place: dict[Spec, int] = {}
        for spec, width in zip(specs, widths, strict=True):
            seen[width] += 1
            self.place[spec] = seen[width]
        self.width = sum(widths)
        self.foretold = expected
        self.expected = expected if budget is not None and budget.take(expected * self.width) else 0
        self.grid = Grid(self.counts, 0)
        self.used = self.count = 0
        self.full: list[tuple[Grid, int]] = []
        self.spilled: _Spill | None = None
        self.rows: Column | None = None

    @property
    def held(self) -> int:
        """Bytes in memory."""
        return self.width * (self.used + sum(n for _, n in self.full))

    def open(self, rows: int) -> int:
        """Make room for a batch, and return where in the grid it starts."""
        if self.used + rows > self.grid.rows:
            self._renew(rows)
        return self.used

    def _renew(self, rows: int) -> None:
        self._keep()
        guess = min(max(self.count // 2, _FEWEST_ROWS), _MOST_BYTES // max(self.width, 1))
        if not self.count:
            guess = max(guess, self.expected)
        self.grid = Grid(self.counts, max(rows, guess))

    def _keep(self) -> None:
        if self.used:
            if self.spilled is None:
                self.full.append((self.grid, self.used))
            else:
                self._spill(self.grid, self.used)
        self.used = 0

    def close(self, picked: Rows | None, rows: int, before: int) -> None:
        """Take the rows of a batch that were written; those between move up.

        Rows of shape (k,).

        Parameters
        ----------
        picked : NDArray[np.int64] or None
            Rows of the batch, increasing; None for all.
        rows : int
            Rows of the batch.
        before : int
            Rows of the topic before the batch.
        """
        count = rows if picked is None else len(picked)
        if picked is not None:
            for cells in self.grid.cells:
                if len(cells):
                    cells[:, self.used : self.used + count] = cells[:, self.used + picked]
        if self.rows is None and (picked is not None or before != self.count):
            self.rows = self.store.column(np.int64)
            self.rows.append(np.arange(self.count))
        if self.rows is not None:
            self.rows.append(before + (np.arange(rows) if picked is None else picked))
        self.used += count
        self.count += count

    def spill(self) -> None:
        """Send everything to temporary files, and what comes later too."""
        if self.spilled is None:
            foretold = self.foretold if self.foretold * self.width < _MOST_FORETOLD else 0
            self.spilled = _Spill([np.dtype(_stored(s)) for s in self.specs], max(foretold, self.count))
            for grid, used in self.full:
                self._spill(grid, used)
            self.full = []
        self._keep()
        self.grid = Grid(self.counts, 0)

    def _spill(self, grid: Grid, used: int) -> None:
        assert self.spilled is not None
        self.spilled.append((self._cells(grid, used, s) for s in self.specs), used)

    def _cells(self, grid: Grid, used: int, spec: Spec) -> NDArray[Any]:
        dtype = _stored(spec)
        cells: NDArray[Any] = grid.cells[SIZES.index(width_of(dtype))][self.place[spec], :used]
        return (cells != 0).view(np.uint8) if spec.dtype == "?" else cells.view(dtype)

    def finish(self) -> tuple[Rows | None, list[NDArray[Any]]]:
        """Return the rows (None for the first to the last of the topic) and all columns; the table is empty then.

        Rows of shape (k,), columns of shape (k,) each.
        """
        rows = None if self.rows is None else self.rows.finish()
        if self.spilled is not None:
            self._keep()
            return rows, self.spilled.finish()
        if not self.full:
            return rows, [self._cells(self.grid, self.used, s) for s in self.specs]
        self._keep()
        self.grid = Grid(self.counts, 0)
        columns: list[NDArray[Any]] = [np.empty(self.count, _stored(s)) for s in self.specs]
        at = 0
        while self.full:
            grid, used = self.full.pop(0)
            for spec, column in zip(self.specs, columns, strict=True):
                column[at : at + used] = self._cells(grid, used, spec)
            at += used
            del grid
        return rows, columns
