"""Rows of a text table to columns of numbers, as one compiled pass over the bytes."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from replay.readers.iso_kernel import iso_ns
from replay.readers.number_kernel import BAD, FLOAT, HARD, INTEGER, number

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


@njit(cache=True)
def _word(data: NDArray[np.uint8], at: int, stop: int, words: NDArray[np.uint64]) -> Any:
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
    for j in range(len(words)):
        if words[j, 0] == low and words[j, 1] == high:
            return np.int64(words[j, 2])
    return 0


@njit(cache=True)
def _to_real(column: NDArray[np.int64], reals: NDArray[np.float64], rows: int) -> None:
    for i in range(rows):
        value = column[i]
        reals[i] = np.nan if value == MISSING else np.float64(value)


@njit(cache=True, nogil=True)
def scan(
    data: NDArray[np.uint8], at: int, final: bool, marks: tuple[np.uint8, np.uint8, bool],
    kinds: NDArray[np.int8], cells: NDArray[np.int64], reals: NDArray[np.float64], hard: NDArray[np.int64],
    columns: NDArray[np.int64], table: NDArray[np.int64], tables: tuple[NDArray[np.float64], NDArray[np.uint64], NDArray[np.uint64]],
) -> tuple[int, int, int]:  # fmt: skip
    """Parse rows until the text, the room for rows or the list of hard cells ends.

    Parameters
    ----------
    data : NDArray[np.uint8]
        Text; unless final it ends with a line feed.
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
    tables : tuple
        `TENS`, `FIVES`, `WORDS`.

    Returns
    -------
    tuple[int, int, int]
        First byte behind the last whole row, rows, and hard cells.
    """
    separator, decimal, quoted = marks
    tens, fives, words = tables
    width, room = cells.shape
    stop = len(data)
    rows = hards = 0
    row_at = at
    while row_at < stop and rows < room and hards + width <= len(hard):
        i = row_at
        c = 0
        ended = False
        filled = 0
        while not ended:
            while i < stop and data[i] == 32:
                i += 1
            start = i
            inside = -1
            if quoted and i < stop and data[i] == 34:  # a cell in quotes: its text, and the first byte behind it
                j = i + 1
                limit = min(stop, i + LONGEST_QUOTE)
                while j < limit:
                    if data[j] == 34:
                        if j + 1 < limit and data[j + 1] == 34:
                            j += 1
                        else:
                            break
                    j += 1
                if j < limit:
                    start, inside = i + 1, j
                elif limit == stop and not final:
                    return row_at, rows, hards
            kind = np.int8(-1)
            value: Any = 0
            end = start
            bound = stop if inside < 0 else inside
            if c < width and kinds[c] != MOMENT:
                while end < bound and data[end] == 32:
                    end += 1
                kind, value, end = number(data, end, bound, decimal, tens, fives)
            while end < bound and (data[end] == 32 or data[end] == 13):
                end += 1
            if inside >= 0:
                whole = end == inside
                i = inside + 1
                while i < stop and (data[i] == 32 or data[i] == 13):
                    i += 1
                if i < stop and data[i] != separator and data[i] != 10:
                    whole = False
            else:
                whole = end >= stop or data[end] == separator or data[end] == 10
                i = end
            if not whole or kind <= BAD:
                kind = np.int8(BAD)
                while i < stop and data[i] != separator and data[i] != 10:
                    i += 1
                end = i if inside < 0 else inside
                while end > start and (data[end - 1] == 32 or data[end - 1] == 13):
                    end -= 1
            empty = end == start
            if c < width:
                if empty:
                    if kinds[c] == REAL:
                        cells[c, rows] = _NAN
                    else:
                        cells[c, rows] = MISSING
                else:
                    filled += 1
                    columns[c, FILLED] += 1
                    if kinds[c] == MOMENT:
                        value = iso_ns(data, start, end)
                        cells[c, rows] = value
                        if value == MISSING:
                            if columns[c, TEXT] == 0:
                                columns[c, FIRST_TEXT] = start
                            columns[c, TEXT] += 1
                    else:
                        if kind == BAD:
                            said = _word(data, start, end, words)
                            sign = data[start]
                            if said == 0 and (sign == 45 or sign == 43):
                                said = _word(data, start + 1, end, words)
                                said = said if said in (_INFINITE, _ABSENT) else 0
                            if said in (_ONE, _ZERO):
                                kind, value = np.int8(INTEGER), np.int64(said == _ONE)
                            elif said == _INFINITE:
                                kind, value = np.int8(FLOAT), _NEGATIVE if sign == 45 else _POSITIVE
                            else:
                                if said == 0:
                                    if columns[c, TEXT] == 0:
                                        columns[c, FIRST_TEXT] = start
                                    columns[c, TEXT] += 1
                                value = MISSING if kinds[c] != REAL else _NAN
                        if kind == INTEGER:
                            if kinds[c] == REAL:
                                reals[c, rows] = np.float64(value)
                            else:
                                kinds[c] = WHOLE
                                cells[c, rows] = value
                        elif kind == BAD:
                            cells[c, rows] = value
                        else:
                            if kinds[c] != REAL:
                                _to_real(cells[c], reals[c], rows)
                                kinds[c] = REAL
                            if kind == HARD:
                                hard[hards, 0], hard[hards, 1], hard[hards, 2], hard[hards, 3] = c, rows, start, end
                                hards += 1
                                value = _NAN
                            cells[c, rows] = value
            elif not empty:
                if table[LONG] == 0 or c == width:
                    if table[LONG] == 0:
                        table[FIRST_LONG] = row_at
                    if c == width:
                        table[LONG] += 1
                filled += 1
            if not empty:
                table[WIDEST] = max(table[WIDEST], c + 1)
            c += 1
            if i >= stop or data[i] == 10:
                ended = True
            i += 1
        row_at = min(i, stop)
        if filled == 0 and c == 1:
            continue
        if c < width:
            if table[SHORT] == 0:
                table[FIRST_SHORT] = start
            table[SHORT] += 1
            for k in range(c, width):
                cells[k, rows] = _NAN if kinds[k] == REAL else MISSING
        rows += 1
    return row_at, rows, hards
