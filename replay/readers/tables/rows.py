"""Rows of a text table, block by block, as columns of 8-byte cells."""

from __future__ import annotations

import re
from collections.abc import Callable, Generator, Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from replay.errors import LogError
from replay.log.reading_notes import Report
from replay.readers.tables import row_kernel as kernel
from replay.readers.tables.text_file import decoded

MAX_COLUMNS = 20_000
LONGEST_ROW = 16 << 20
_CELLS = 1 << 21
_HARD = 1 << 16
_TAIL = 256
_BEHIND = 16  # bytes that the parser may look at behind the last line feed
_PADDING = b"\n" + bytes(_BEHIND)
_NAN = np.array([np.nan]).view(np.int64)[0]


@dataclass(frozen=True)
class Dialect:
    """How cells are written: separator and decimal sign (one character each), whether double quotes enclose them."""

    separator: str
    decimal: str
    quoted: bool


class Rows:
    """Parser of the rows of one table.

    Parameters
    ----------
    label : str
        File, for messages.
    dialect : Dialect
        How cells are written.
    width : int
        Number of columns; cells beyond are counted, missing ones are empty.
    report : Report
        Takes what is lost.
    sparse : int
        Cells per byte of text that are taken for a table.

    Attributes
    ----------
    kinds : NDArray[np.int8], shape (width,)
        `row_kernel.UNKNOWN`, `WHOLE`, `REAL`; set to `MOMENT` beforehand for dates.
    columns : NDArray[np.int64], shape (width, 4)
        Counters of each column: cells that are not empty, cells of text, byte of the first of these.
    table : NDArray[np.int64], shape (5,)
        Counters of rows with too few and too many cells, and their first bytes.
    count : int
        Rows so far.
    examples : dict[int, str]
        First cell of text of columns that have one.
    """

    def __init__(self, label: str, dialect: Dialect, width: int, report: Report, sparse: int = 16) -> None:
        if width > MAX_COLUMNS:
            raise LogError(f"{label} has {width} columns; at most {MAX_COLUMNS} are read")
        self.label, self.dialect, self.report = label, dialect, report
        self.kinds = np.zeros(width, np.int8)
        self.columns = np.zeros((width, 4), np.int64)
        self.table = np.zeros(5, np.int64)
        self._sparse = sparse
        self.examples: dict[int, str] = {}
        self.count = self._bytes = 0
        self._room = max(_CELLS // max(width, 1), 1)
        self._hard = np.zeros((max(_HARD, 2 * width), 4), np.int64)

    def example(self, column: int) -> str:
        """Return the first cell of text in a column, and where it stands."""
        return f"the first is {self.examples.get(column, '')!r} at byte {self.columns[column, kernel.FIRST_TEXT]}"

    def blocks(
        self, pieces: Iterable[bytes], start: int, end: Callable[[bytes], bytes] | None = None
    ) -> Iterator[NDArray[np.int64]]:
        """Parse text.

        Parameters
        ----------
        pieces : Iterable[bytes]
            Text, cut anywhere.
        start : int
            Byte in the file at which it begins.
        end : callable or None
            Gets the last lines (the last row among them) and returns those that are rows.

        Yields
        ------
        NDArray[np.int64], shape (width, n)
            Cells: integers (`row_kernel.MISSING` where empty), or the bits of doubles in columns that are `REAL` by
            then. Valid until the next block.

        Raises
        ------
        LogError
            Where rows hold far fewer cells than the table has columns.
        """
        cells = np.empty((len(self.kinds), self._room), np.int64)
        left, at, skipped = b"", start, 0
        for piece, final in _last_told(pieces):
            if skipped:
                cut = piece.find(b"\n")
                skipped += len(piece) if cut < 0 else cut
                at += len(piece) if cut < 0 else cut
                if cut < 0 and not final:
                    continue
                self.report.lost(f"{self.label}: a row of {skipped} bytes before byte {at} was left out")
                left, piece, skipped = b"", b"" if cut < 0 else piece[cut:], 0
            text = left + piece if left else piece
            stop = len(text)
            if final:
                text = (end(text) if end is not None else text) + _PADDING
                stop = len(text) - _BEHIND
            else:
                stop = text.rfind(b"\n", 0, max(stop - _TAIL, 0)) + 1
            used = yield from self._parse(text, stop, at, final, cells)
            left = text[used:]
            at += used
            if len(left) > LONGEST_ROW:
                skipped, left, at = len(left), b"", at + len(left)
        if skipped:
            self.report.lost(f"{self.label}: a row of {skipped} bytes before byte {at} was left out")

    def _parse(
        self, text: bytes, stop: int, base: int, final: bool, cells: NDArray[np.int64]
    ) -> Generator[NDArray[np.int64], None, int]:
        """Parse ``text[:stop]``; returns how much of it was used."""
        data = np.frombuffer(text, np.uint8, stop)
        marks = np.uint8(ord(self.dialect.separator)), np.uint8(ord(self.dialect.decimal)), self.dialect.quoted
        at = 0
        while at < stop:
            before, odd = self.columns[:, kernel.TEXT] == 0, self.table[:2] == 0
            used, rows, hards = kernel.scan(
                data, at, final, marks, self.kinds, cells, cells.view(np.float64), self._hard, self.columns,
                self.table,
            )  # fmt: skip
            for i in np.flatnonzero(before & (self.columns[:, kernel.TEXT] > 0)):
                first = int(self.columns[i, kernel.FIRST_TEXT])
                cell = re.split(rb"[\r\n]", text[first : first + 40].split(self.dialect.separator.encode())[0])[0]
                self.examples[int(i)] = decoded(cell)
                self.columns[i, kernel.FIRST_TEXT] += base
            self.table[2:4][odd & (self.table[:2] > 0)] += base
            self._bytes += used - at
            self.count += rows
            if self.count * len(self.kinds) > 1_000_000 + self._sparse * self._bytes:
                raise LogError(
                    f"{self.label}: {len(self.kinds)} columns, but {self.count} rows in {self._bytes} bytes; its rows "
                    "are almost empty, so this is not a table"
                )
            for column, row, first, last in self._hard[:hards]:
                cells[column, row] = self._by_python(text[first:last])
            if rows:
                yield cells[:, :rows]
            if used == at:
                break
            at = used
        return at

    def _by_python(self, cell: bytes) -> np.int64:
        value = float(cell.decode("ascii", "replace").replace(self.dialect.decimal, "."))
        return np.array([value]).view(np.int64)[0]  # type: ignore[no-any-return]


def _last_told(pieces: Iterable[bytes]) -> Iterator[tuple[bytes, bool]]:
    """Yield pieces, and whether each is the last."""
    before: bytes | None = None
    for piece in pieces:
        if before is not None:
            yield before, False
        before = piece
    if before is not None:
        yield before, True
