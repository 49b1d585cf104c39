"""Compiled walks over the pages of an SQLite file: tables, rows, overflow chains.

Page numbers start at 1, as in the file. Nothing read from a page is trusted: places and lengths are checked against the
page and the file, pages are visited once.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from replay.arrays.compiling import njit
from replay.readers.common.compiled import part

INTERIOR, LEAF = 5, 13
OK, DAMAGED, OTHER_TYPES, BEYOND = 0, 1, 2, 3


@njit(cache=True, no_cpython_wrapper=True)
def big_endian(data, at, width):  # type: ignore[no-untyped-def]
    """Signed big-endian integer of `width` bytes."""
    value = np.int64(np.int8(data[at])) if width else np.int64(0)
    for i in range(1, width):
        value = value << 8 | np.int64(data[at + i])
    return value


@njit(cache=True, no_cpython_wrapper=True)
def u16(data, at):  # type: ignore[no-untyped-def]
    """Big-endian integer of two bytes."""
    return np.int64(data[at]) << 8 | np.int64(data[at + 1])


@njit(cache=True, no_cpython_wrapper=True)
def unsigned(data, at):  # type: ignore[no-untyped-def]
    """Big-endian integer of four bytes."""
    return u16(data, at) << 16 | u16(data, at + 2)


@njit(cache=True)
def varint(data, at, stop):  # type: ignore[no-untyped-def]
    """Value and end of the variable-length integer at `at`; end −1 where it does not fit."""
    if at < stop and data[at] < 128:
        return np.int64(data[at]), at + 1
    value = np.int64(0)
    for i in range(9):
        if at + i >= stop:
            return np.int64(0), -1
        byte = np.int64(data[at + i])
        if i == 8:
            return value << 8 | byte, at + 9
        value = value << 7 | (byte & 127)
        if byte < 128:
            return value, at + i + 1
    return value, -1


@njit(cache=True, no_cpython_wrapper=True)
def page_head(data, page, number):  # type: ignore[no-untyped-def]
    """Start of the page, start of its tree header, and where the page ends."""
    start = (number - 1) * page
    return start, start + (100 if number == 1 else 0), min(start + page, len(data))


@part
def _key(data: NDArray[np.uint8], page: int, place: tuple[int, int, int], cell: int, otherwise: int) -> Any:
    """Last row below a cell of an interior page (start, head and end: `place`), `otherwise` where it is damaged."""
    start, head, stop = place
    at = start + (u16(data, head + 12 + 2 * cell) & page - 1)
    if head + 12 <= at and at + 5 <= stop:
        key, end = varint(data, at + 4, stop)
        if end > 0:
            return key
    return otherwise


@njit(cache=True, no_cpython_wrapper=True)
def _is_wanted(wanted, bottom, top):  # type: ignore[no-untyped-def]
    """Whether a row bottom < row ≤ top is wanted."""
    place = np.searchsorted(wanted, bottom, "right")
    return place < len(wanted) and wanted[place] <= top


@njit(cache=True)
def walk(data, page, root, seen, wanted, all_rows):  # type: ignore[no-untyped-def]
    """Leaves of a table in the order of its rows.

    Parameters
    ----------
    data, page, root : bytes of the file, page size, first page of the table
    seen : one byte per page, set for pages of the tree; index 0 is not used
    wanted, all_rows : sorted row numbers that are wanted, unless all are

    Returns
    -------
    Leaves, and pages that the tree names and that are no pages of a table.
    """
    pages = len(seen) - 1
    leaves, suspects = np.empty(pages, np.int64), np.empty(pages, np.int64)
    stack, low, high = np.empty(pages + 1, np.int64), np.empty(pages + 1, np.int64), np.empty(pages + 1, np.int64)
    n = bad = depth = 0
    if 1 <= root <= pages and not seen[root]:
        stack[0], low[0], high[0], depth = root, np.iinfo(np.int64).min, np.iinfo(np.int64).max, 1
        seen[root] = 1
    while depth:
        depth -= 1
        number, first, last = stack[depth], low[depth], high[depth]
        start, head, stop = page_head(data, page, number)
        kind = data[head] if head + 12 <= stop else 0
        if kind == LEAF:
            leaves[n] = number
            n += 1
            continue
        if kind != INTERIOR:
            suspects[bad] = number
            bad += 1
            continue
        cells = min(u16(data, head + 3), (stop - head - 12) // 2)
        top = last
        for i in range(cells, -1, -1):  # from the right, so that the left comes off the stack first
            if i == cells:
                child, bottom_cell = unsigned(data, head + 8), i - 1
            else:
                at = start + (u16(data, head + 12 + 2 * i) & page - 1)
                if at < head + 12 or at + 5 > stop:
                    continue
                child, bottom_cell = unsigned(data, at), i - 1
            bottom = first if bottom_cell < 0 else _key(data, page, (start, head, stop), bottom_cell, first)
            keep = all_rows or _is_wanted(wanted, bottom, top)
            if keep and 1 <= child <= pages and not seen[child]:
                seen[child] = 1
                stack[depth], low[depth], high[depth] = child, bottom, top
                depth += 1
            elif keep and bad < pages:
                suspects[bad] = 0
                bad += 1
            top = bottom
    return leaves[:n].copy(), suspects[:bad].copy()


@njit(cache=True, no_cpython_wrapper=True)
def parse(data, at, stop, total, topic_column, stamp_column, data_column):  # type: ignore[no-untyped-def]
    """Topic, stamp and place of the data in the record of `total` bytes at `at`, of which those before `stop` lie there.

    Returns
    -------
    Status, topic, stamp, start of the data from `at`, their length.
    """
    none = np.int64(0)
    size, p = varint(data, at, stop)
    if p < 0 or size > total or size < 1:
        return DAMAGED, none, none, none, none
    if at + size > stop:
        return BEYOND, none, none, none, none
    body, column, status = size, 0, OK
    topic = stamp = start = length = none
    found = 0
    while p < at + size:
        kind, p = varint(data, p, at + size)
        if p < 0 or kind < 0:
            return DAMAGED, none, none, none, none
        width = (kind - 12) // 2 if kind >= 12 else (kind if kind < 5 else 6 if kind == 5 else 8 if kind < 8 else 0)
        if width > total - body:
            return DAMAGED, none, none, none, none
        if column == topic_column or column == stamp_column:  # noqa: SIM109 (faster when compiled)
            value = np.int64(0)
            if kind >= 8 and kind < 10:
                value = kind - 8
            elif 1 <= kind <= 6:
                if at + body + width > stop:
                    return BEYOND, none, none, none, none
                value = big_endian(data, at + body, width)
            else:
                status = OTHER_TYPES
            if column == topic_column:
                topic = value
            else:
                stamp = value
            found += 1
        elif column == data_column:
            if kind < 12 or kind % 2:
                status = OTHER_TYPES
            start, length = np.int64(body), np.int64(width)
            found += 1
        body += width
        column += 1
    if p != at + size or body != total:
        return DAMAGED, none, none, none, none
    return (status if found == 3 else OTHER_TYPES), topic, stamp, start, length


@njit(cache=True, no_cpython_wrapper=True)
def _copy(out, data):  # type: ignore[no-untyped-def]
    for i in range(len(out)):  # a plain index from 0: this loop becomes wide moves
        out[i] = data[i]


@njit(cache=True)
def copy_payload(data, page, usable, place, local, begin, size, out, to):  # type: ignore[no-untyped-def]
    """Copy bytes `begin` to `begin + size` of a row's payload; return whether its chain of pages holds them all."""
    stop, done = begin + size, 0
    if begin < local:
        done = min(stop, local) - begin
        _copy(out[to : to + done], data[place + begin : place + begin + done])
    if stop <= local:
        return True
    number, at, budget = unsigned(data, place + local), local, len(data) // page + 2
    while at < stop:
        first = (number - 1) * page
        take = min(usable - 4, stop - at)
        budget -= 1
        if number < 1 or budget < 0 or first + 4 + take > len(data):
            return False
        skip = max(begin - at, 0)
        if skip < take:
            _copy(out[to + done : to + done + take - skip], data[first + 4 + skip : first + 4 + take])
            done += take - skip
        at += take
        number = unsigned(data, first)
    return True


@njit(cache=True)
def cells_of(data, page, numbers):  # type: ignore[no-untyped-def]
    """Count of the cells that each leaf states, at most as many as fit."""
    counts = np.zeros(len(numbers), np.int64)
    for k in range(len(numbers)):
        _, head, stop = page_head(data, page, numbers[k])
        if head + 8 <= stop:
            counts[k] = min(u16(data, head + 3), (page - 8) // 2)
    return counts


@njit(cache=True)
def locate(data, page, usable, numbers):  # type: ignore[no-untyped-def]
    """Row number, place, local and whole length of each cell's payload in leaves; status OK or DAMAGED."""
    n = cells_of(data, page, numbers).sum()
    row, place = np.empty(n, np.int64), np.empty(n, np.int64)
    local, total, status = np.empty(n, np.int64), np.empty(n, np.int64), np.empty(n, np.uint8)
    k = 0
    most, least = usable - 35, (usable - 12) * 32 // 255 - 23
    for number in numbers:
        start, head, stop = page_head(data, page, number)
        if head + 8 > stop:
            continue
        for i in range(min(u16(data, head + 3), (page - 8) // 2)):
            row[k] = place[k] = local[k] = total[k] = 0
            status[k] = DAMAGED
            at = head + 8 + 2 * i
            k += 1
            if at + 2 > stop:
                continue
            at = start + (u16(data, at) & page - 1)
            if at < head + 8 or at >= stop:
                continue
            size, at = varint(data, at, stop)
            if at < 0 or size < 1 or size > len(data):
                continue
            number_of_row, at = varint(data, at, stop)
            if at < 0:
                continue
            here = size
            if size > most:
                here = least + (size - least) % (usable - 4)
                if here > most:
                    here = least
            if at + here + (4 if here < size else 0) > stop:
                continue
            row[k - 1], place[k - 1], local[k - 1], total[k - 1], status[k - 1] = number_of_row, at, here, size, OK
    return row, place, local, total, status


@njit(cache=True)
def messages_of(data, page, usable, place, local, total, status, columns):  # type: ignore[no-untyped-def]
    """Topic, stamp, start and length of the data of located rows; `status` is updated."""
    n = len(place)
    topic, stamp = np.zeros(n, np.int64), np.zeros(n, np.int64)
    start, length = np.zeros(n, np.int64), np.zeros(n, np.int64)
    for i in range(n):
        if status[i] != OK:
            continue
        at = place[i]
        found = parse(data, at, at + local[i], total[i], columns[0], columns[1], columns[2])
        if found[0] == BEYOND:
            whole = np.empty(total[i], np.uint8)
            if copy_payload(data, page, usable, at, local[i], np.int64(0), total[i], whole, np.int64(0)):
                found = parse(whole, np.int64(0), total[i], total[i], columns[0], columns[1], columns[2])
        status[i] = DAMAGED if found[0] == BEYOND else found[0]
        topic[i], stamp[i], start[i], length[i] = found[1], found[2], found[3], found[4]
    return topic, stamp, start, length


@njit(cache=True)
def gather(data, page, usable, place, local, start, length, out, into, status):  # type: ignore[no-untyped-def]
    """Copy the data of rows to `into` in `out`; a broken chain of pages makes a row DAMAGED."""
    for i in range(len(place)):
        if not copy_payload(data, page, usable, place[i], local[i], start[i], length[i], out, into[i]):
            status[i] = DAMAGED
