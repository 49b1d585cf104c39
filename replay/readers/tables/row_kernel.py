"""Rows of a text table to columns of numbers, as one compiled pass over the bytes."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from replay.arrays.compiling import njit
from replay.readers.tables.iso_kernel import iso_ns
from replay.readers.tables.number_kernel import BAD, FLOAT, HARD, INTEGER, byte_at, number

UNKNOWN, WHOLE, REAL, MOMENT = 0, 1, 2, 3  # kinds of columns; cells of MOMENT are dates, kept as ns since 1970
MISSING = -(2**63)
FILLED, TEXT, FIRST_TEXT, ROUNDED = 0, 1, 2, 3  # counters of a column
SHORT, LONG, FIRST_SHORT, FIRST_LONG, WIDEST = 0, 1, 2, 3, 4  # counters of the table
LONGEST_QUOTE = 1 << 16
_NAN = np.array([np.nan]).view(np.int64)[0]
_POSITIVE, _NEGATIVE = np.array([np.inf, -np.inf]).view(np.int64)
_ABSENT, _ONE, _ZERO, _INFINITE = 1, 2, 3, 4
_WORDS = {
    _ABSENT: "nan,na,n/a,#n/a,null,none,n. def.,ind,-nan(ind),nan(ind),1.#ind,1.#qnan,1.#ind00,1.#qnan0,-,epäluku",
    _ONE: "true,yes,on,wahr",
    _ZERO: "false,no,off,falsch",
    _INFINITE: "inf,infinity,1.#inf,1.#inf00,∞,unendlich,+unendlich,ääretön",
}


def _packed(word: str) -> tuple[int, int]:
    raw = word.encode().ljust(16, b"\0")
    return int.from_bytes(raw[:8], "little"), int.from_bytes(raw[8:16], "little")


WORDS = np.array([(*_packed(w), code) for code, row in _WORDS.items() for w in row.split(",")], np.uint64)


@njit(cache=True, no_cpython_wrapper=True)
def _word(data: NDArray[np.uint8], at: int, stop: int) -> Any:
    """What a cell that is no number says; 0 where it is text."""
    if stop - at > 16:
        return 0
    low, high = np.uint64(0), np.uint64(0)
    for i in range(at, stop):
        c = data[i]
        if 65 <= c <= 90:
            c += np.uint8(32)
        k = i - at
        if k < 8:
            low |= np.uint64(c) << np.uint64(8 * k)
        else:
            high |= np.uint64(c) << np.uint64(8 * (k - 8))
    for j in range(len(WORDS)):
        if WORDS[j, 0] == low and WORDS[j, 1] == high:
            return np.int64(WORDS[j, 2])
    return 0


@njit(cache=True, no_cpython_wrapper=True)
def _to_real(column: NDArray[np.int64], reals: NDArray[np.float64], rows: int) -> None:
    for i in range(rows):
        value = column[i]
        reals[i] = np.nan if value == MISSING else np.float64(value)


@njit(cache=True, no_cpython_wrapper=True)
def _quoted(data: NDArray[np.uint8], at: int, stop: int) -> int:
    """Where the quote that closes the one before `at` stands; `stop` where it does not come."""
    j = at
    while j < stop:
        if data[j] == 34:
            if j + 1 < stop and data[j + 1] == 34:
                j += 1
            else:
                return j
        j += 1
    return stop


@njit(cache=True, no_cpython_wrapper=True)
def _moment(data: NDArray[np.uint8], start: int, end: int, counters: NDArray[np.int64]) -> Any:
    """Moment of a cell of text that may hold a date or a time of day."""
    value = iso_ns(data, start, end)
    if value == MISSING:
        if counters[TEXT] == 0:
            counters[FIRST_TEXT] = start
        counters[TEXT] += 1
    return value


@njit(cache=True, no_cpython_wrapper=True)
def _worded(data: NDArray[np.uint8], start: int, end: int, counters: NDArray[np.int64]) -> tuple[int, Any]:
    """Kind and value of a cell that is no number: a truth, an infinity, nothing, or text (both `BAD`)."""
    said = _word(data, start, end)
    sign = data[start]
    if said == 0 and (sign == 45 or sign == 43):
        said = _word(data, start + 1, end)
        said = said if said in (_INFINITE, _ABSENT) else 0
    if said in (_ONE, _ZERO):
        return INTEGER, np.int64(said == _ONE)
    if said == _INFINITE:
        return FLOAT, np.int64(_NEGATIVE if sign == 45 else _POSITIVE)
    if said == 0:
        if counters[TEXT] == 0:
            counters[FIRST_TEXT] = start
        counters[TEXT] += 1
    return BAD, np.int64(0)


@njit(cache=True, nogil=True)
def scan(
    data: NDArray[np.uint8], at: int, final: bool, marks: tuple[np.uint8, np.uint8, bool],
    kinds: NDArray[np.int8], cells: NDArray[np.int64], reals: NDArray[np.float64], hard: NDArray[np.int64],
    columns: NDArray[np.int64], table: NDArray[np.int64],
) -> tuple[int, int, int]:  # fmt: skip
    """Parse rows until the text, the room for rows or the list of hard cells ends.

    Parameters
    ----------
    data : NDArray[np.uint8]
        Text that ends with a line feed; eight more bytes may be read behind it.
    at : int
        Where a row begins.
    final : bool
        Whether no more text follows.
    marks : tuple[np.uint8, np.uint8, bool]
        Separator, decimal sign, and whether double quotes enclose cells.
    kinds : NDArray[np.int8], shape (k,)
        Kinds of columns; turn from `UNKNOWN` to `WHOLE` to `REAL` as cells demand.
    cells, reals : NDArray, shape (k, m)
        Room for m rows: integers, and the same memory as doubles.
    hard : NDArray[np.int64], shape (h, 4)
        Room for cells that only Python can read: column, row, first byte, byte behind.
    columns : NDArray[np.int64], shape (k, 4)
        Counters of each column.
    table : NDArray[np.int64], shape (5,)
        Counters of the table.

    Returns
    -------
    tuple[int, int, int]
        First byte behind the last whole row, rows, and hard cells.
    """
    separator, decimal, quoted = marks
    width, room = cells.shape
    stop = len(data)
    rows = hards = 0
    widest = table[WIDEST]
    row_at = at
    while row_at < stop and rows < room and hards + width <= len(hard):
        i = first = row_at
        c = 0
        ended = False
        filled = 0  # cells up to the last that is not empty
        start = i
        while not ended:
            while byte_at(data, i) == 32:
                i += 1
            start = i
            known = kinds[c] if c < width else np.int8(MOMENT)
            kind = BAD
            value: Any = np.int64(0)
            if known != MOMENT:
                kind, value, i = number(data, start, decimal)
                while byte_at(data, i) == 32 or byte_at(data, i) == 13:
                    i += 1
                d = byte_at(data, i)
                if d != separator and d != 10:
                    kind = BAD
            end = i
            if kind == BAD:
                i = start
                closed = stop
                if quoted and byte_at(data, i) == 34:  # a cell in quotes
                    limit = min(stop, i + LONGEST_QUOTE)
                    closed = _quoted(data, i + 1, limit)
                    if closed == limit:
                        if limit == stop and not final:
                            columns[:, FILLED] += rows
                            table[WIDEST] = widest
                            return row_at, rows, hards
                        closed = stop
                if closed < stop:
                    start, i = start + 1, closed + 1
                    if known != MOMENT:
                        while byte_at(data, start) == 32:
                            start += 1
                        kind, value, end = number(data, start, decimal)
                        while byte_at(data, end) == 32:
                            end += 1
                        if end != closed:
                            kind = BAD
                d = byte_at(data, i)
                while d != separator and d != 10:
                    i += 1
                    d = byte_at(data, i)
                if closed < stop:
                    for j in range(closed + 1, i):
                        if data[j] != 32 and data[j] != 13:
                            kind = BAD
                if kind == BAD:
                    end = closed if closed < stop else i
                    while end > start and (data[end - 1] == 32 or data[end - 1] == 13):
                        end -= 1
                    if end > start and c < width:
                        if known == MOMENT:
                            kind, value = INTEGER, _moment(data, start, end, columns[c])
                        else:
                            kind, value = _worded(data, start, end, columns[c])
            if end > start:
                filled = c + 1
            if c < width:
                if kind == INTEGER:
                    if known == REAL:
                        reals[c, rows] = np.float64(value)
                    else:
                        if known == UNKNOWN:
                            kinds[c] = WHOLE
                        cells[c, rows] = value
                elif kind == BAD:
                    if end == start:
                        columns[c, FILLED] -= 1
                    cells[c, rows] = _NAN if known == REAL else MISSING
                else:
                    if known != REAL:
                        _to_real(cells[c], reals[c], rows)
                        kinds[c] = REAL
                    if kind == HARD:
                        hard[hards, 0], hard[hards, 1], hard[hards, 2], hard[hards, 3] = c, rows, start, end
                        hards += 1
                        value = _NAN
                    cells[c, rows] = value
            c += 1
            ended = byte_at(data, i) == 10
            i += 1
        row_at = i
        if filled == 0 and c == 1:
            if width > 0:
                columns[0, FILLED] += 1
            continue
        if filled > width:
            if table[LONG] == 0:
                table[FIRST_LONG] = first
            table[LONG] += 1
        if filled > widest:
            widest = filled
        if c < width:
            if table[SHORT] == 0:
                table[FIRST_SHORT] = start
            table[SHORT] += 1
            for k in range(c, width):
                cells[k, rows] = _NAN if kinds[k] == REAL else MISSING
                columns[k, FILLED] -= 1
        rows += 1
    columns[:, FILLED] += rows
    table[WIDEST] = widest
    return row_at, rows, hards
