"""Compiled walk over serialised protobuf messages: every number to its place, every length checked.

A *place* is where a value can stand: a message, a number, or an element of an array, in every message of one type the
same one. Places are made when they are first met, so that types which hold themselves cost what the data hold. A
*slot* is a field of a message's place; that of an array holds a chain of element places. Values and presence of all
rows of a batch are matrices of shape (places, rows); see `replay.readers.messages.protobuf` for their owner.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from replay.readers.messages.protobuf_schema import BYTES, DOUBLE, MESSAGE, STRING
from replay.readers.messages.protobuf_wire import add_hash, find, is_text, number_at, varint, wire_of

MAX_DEPTH = 64
MAX_CLEARED = 64
OK, FULL, CUT, GROUP_FOUND, BAD_TAG, BAD_TEXT, TOO_DEEP, TOO_CHANGEABLE, TOO_MANY = range(9)
REASONS = (
    "",
    "",
    "a field is longer than its message",
    "it holds a group, which is not supported",
    "it holds an impossible field number or wire type",
    "its text is not UTF-8",
    f"it is nested deeper than {MAX_DEPTH}",
    f"it replaces parts of itself more than {MAX_CLEARED} times",
    "it holds too many numbers",
)


@njit(cache=True)
def _new_place(slot, index, used, places):  # type: ignore[no-untyped-def]
    place = used[0]
    if place >= places.shape[1]:
        return -1
    used[0] += 1
    places[0, place], places[1, place], places[2, place], places[3, place], places[4, place] = slot, index, -1, -1, -1
    return place


@njit(cache=True)
def new_message(slot, index, kind, used, places, slots, first, flags):  # type: ignore[no-untyped-def]
    """Make the place of a message with its slots; −1 where there is no room."""
    count = first[kind + 1] - first[kind]
    if used[1] + count > slots.shape[1] or used[0] + 1 + 2 * count > places.shape[1]:
        return -1
    place = _new_place(slot, index, used, places)
    places[3, place], places[4, place] = kind, used[1]
    used[1] += count
    for i in range(count):
        s, f = places[4, place] + i, first[kind] + i
        slots[0, s], slots[1, s], slots[2, s], slots[3, s] = place, f, -1, -1
        slots[4, s], slots[5, s], slots[6, s] = -1, -1, 0
        if flags[0, f]:  # repeated: a place for the count, for names one more for their hash
            slots[3, s] = _new_place(s, -1, used, places)
            if flags[3, f]:
                _new_place(s, -1, used, places)
        elif flags[1, f]:  # its absence means 0
            slots[2, s] = _new_place(s, -1, used, places)
    return place


@njit(cache=True)
def _clear(slot, row, used, places, slots, values, present):  # type: ignore[no-untyped-def]
    """Take back everything below a slot in one row."""
    for place in range(used[0]):
        up = places[0, place]
        while up >= 0 and up != slot:
            up = places[0, slots[0, up]]
        if up == slot:
            values[place, row], present[place, row] = 0, 0
    for other in range(used[1]):
        up = other
        while up >= 0 and up != slot:
            up = places[0, slots[0, up]]
        if up == slot:
            slots[4, other] = -1


@njit(cache=True)
def _element(slot, visit, limit, used, places, slots, first, flags, target):  # type: ignore[no-untyped-def]
    """Place of the next message in an array; −1 beyond the limit, −2 where there is no room."""
    if slots[4, slot] != visit:
        slots[4, slot], slots[5, slot], slots[6, slot] = visit, -1, 0
    index = slots[6, slot]
    slots[6, slot] += 1
    if index >= limit:
        return -1
    last = slots[5, slot]
    place = slots[2, slot] if last < 0 else places[2, last]
    if place < 0:
        place = new_message(slot, index, target[slots[1, slot]], used, places, slots, first, flags)
        if place < 0:
            return -2
        if last < 0:
            slots[2, slot] = place
        else:
            places[2, last] = place
    slots[5, slot] = place
    return place


@njit(cache=True)
def walk(  # type: ignore[no-untyped-def]
    data, words, halves, starts, lengths, visit, limit, first, number, kinds, choice, target, flags, used, places, slots, values,
    present, status,
):  # fmt: skip
    """Walk payloads row by row; return how many rows were done before room for places ran out.

    Parameters
    ----------
    data, words, halves : arrays
        Bytes, and the 8-byte and 4-byte numbers that start at each of them.
    starts, lengths : arrays
        Where the payloads lie.
    visit : int
        Number that no row had before; rows count on from it.
    limit : int
        Elements of an array that become places.
    first, number, kinds, choice, target : arrays
        As in `replay.readers.messages.protobuf_schema.Tables`.
    flags : array, shape (5, fields)
        Repeated, implicit, checked, key and hidden fields.
    used : array, shape (2,)
        Places and slots in use.
    places : array, shape (5, p)
        Slot that holds it, index in an array, next element, type and first slot of a message.
    slots : array, shape (8, s)
        Place of its message, field, place (of the first element), place of the count; visit, last element and count of
        the row at hand; whether it ever was too long.
    values, present : arrays, shape (p, n)
        Filled; zero before.
    status : array, shape (n,)
        What is wrong with each row.
    """
    ends = np.empty(MAX_DEPTH + 1, np.int64)
    nodes = np.empty(MAX_DEPTH + 1, np.int64)
    types = np.empty(MAX_DEPTH + 1, np.int64)
    hints = np.empty(MAX_DEPTH + 1, np.int64)
    for row in range(len(starts)):
        visit += 1
        at, depth, cleared, state = starts[row], 0, 0, OK
        ends[0], nodes[0], types[0], hints[0] = starts[row] + lengths[row], 0, 0, first[0]
        present[0, row] = 1
        if at < 0 or lengths[row] < 0 or ends[0] > len(data):
            status[row] = CUT
            continue
        while True:
            stop = ends[depth]
            if at == stop:
                if depth == 0:
                    break
                depth -= 1
                continue
            tag = np.int64(data[at])
            if tag < 128:
                at += 1
            else:
                long, at = varint(data, at, stop, 5)
                tag = np.int64(long)
                if at < 0:
                    state = CUT
                    break
            wire, code = tag & 7, tag >> 3
            if code == 0 or code >= 1 << 29 or wire > 5:
                state = BAD_TAG
                break
            if wire in (3, 4):
                state = GROUP_FOUND
                break
            low, high = first[types[depth]], first[types[depth] + 1]
            field = hints[depth]
            if field >= high or number[field] != code:
                field = find(number, low, high, code)
            size = np.int64(0)
            if wire == 2:
                if at < stop and data[at] < 128:
                    size = np.int64(data[at])
                    at += 1
                else:
                    long, at = varint(data, at, stop, 5)
                    size = np.int64(long)
                if at < 0 or size > stop - at:
                    state = CUT
                    break
            kind = -1 if field < 0 else kinds[field]
            packed = field >= 0 and wire == 2 and kind < BYTES and flags[0, field]
            if field < 0 or (wire_of(kind) != wire and not packed):  # unknown: skipped
                if wire == 0:
                    at = varint(data, at, stop, 10)[1]
                else:
                    at += size if wire == 2 else 8 if wire == 1 else 4
                if at < 0 or at > stop:
                    state = CUT
                    break
                continue
            hints[depth] = field if flags[0, field] else field + 1
            node = nodes[depth]
            slot = -1 if node < 0 or flags[4, field] else places[4, node] + field - low
            if kind == STRING and flags[2, field] and not is_text(data, at, at + size):
                state = BAD_TEXT
                break
            if slot >= 0 and choice[field] >= 0:  # the last one of a oneof counts
                for other in range(low, high):
                    beside = places[4, node] + other - low
                    if other == field or choice[other] != choice[field] or slots[2, beside] < 0:
                        continue
                    if present[slots[2, beside], row]:
                        cleared += 1
                        if cleared <= MAX_CLEARED:
                            _clear(beside, row, used, places, slots, values, present)
                if cleared > MAX_CLEARED:
                    state = TOO_CHANGEABLE
                    break
            if kind == MESSAGE:
                inner = -1
                if slot >= 0 and flags[0, field]:
                    inner = _element(slot, visit, limit, used, places, slots, first, flags, target)
                    if inner >= 0:
                        values[slots[3, slot], row] = slots[6, slot]
                    elif inner == -1 and slots[6, slot] == limit + 1:
                        count, last = slots[6, slot], slots[5, slot]
                        cleared += 1
                        if cleared > MAX_CLEARED:
                            state = TOO_CHANGEABLE
                            break
                        _clear(slot, row, used, places, slots, values, present)
                        slots[4, slot], slots[5, slot], slots[6, slot], slots[7, slot] = visit, last, count, 1
                elif slot >= 0:
                    inner = slots[2, slot]
                    if inner < 0:
                        inner = new_message(slot, -1, target[field], used, places, slots, first, flags)
                        inner = -2 if inner < 0 else inner
                        slots[2, slot] = max(inner, -1)
                if inner == -2:
                    return row
                if depth == MAX_DEPTH:
                    state = TOO_DEEP
                    break
                if inner >= 0:
                    present[inner, row] = 1
                depth += 1
                ends[depth], nodes[depth], types[depth], hints[depth] = (
                    at + size,
                    inner,
                    target[field],
                    first[target[field]],
                )
                continue
            if kind >= BYTES and not flags[3, field]:
                at += size
                continue
            if not flags[0, field]:
                value, at = number_at(data, words, halves, at, stop, kind)
                if at < 0:
                    state = CUT
                    break
                if slot >= 0:
                    place = slots[2, slot]
                    if place < 0:
                        place = _new_place(slot, -1, used, places)
                        if place < 0:
                            return row
                        slots[2, slot] = place
                    values[place, row], present[place, row] = value, 1
                continue
            index, last = 0, -1
            if slot >= 0 and slots[4, slot] == visit:
                index, last = slots[6, slot], slots[5, slot]
            before = index
            until = at + size if packed or kind == STRING else stop
            while True:
                if packed and at == until:
                    break
                if kind == STRING:
                    value, after = (np.uint64(at) << np.uint64(20)) | np.uint64(size if size < 1 << 20 else 0), until
                    if slot >= 0:
                        add_hash(data, at, until, slots[3, slot] + 1, row, values)
                elif kind == DOUBLE and at + 8 <= until:
                    value, after = words[at], at + 8
                else:
                    value, after = number_at(data, words, halves, at, until, kind)
                if after < 0:
                    state = CUT
                    break
                at = after
                index += 1
                if slot >= 0 and index <= limit:
                    place = slots[2, slot] if last < 0 else places[2, last]
                    if place < 0:
                        place = _new_place(slot, index - 1, used, places)
                        if place < 0:
                            return row
                        if last < 0:
                            slots[2, slot] = place
                        else:
                            places[2, last] = place
                    last = place
                    values[place, row], present[place, row] = value, 1
                if not packed:
                    break
            if slot >= 0 and index:
                slots[4, slot], slots[5, slot], slots[6, slot] = visit, last, index
                values[slots[3, slot], row] = index if index <= limit else 0
                if index > limit and before <= limit:
                    slots[7, slot], gone = 1, slots[2, slot]
                    while gone >= 0:
                        present[gone, row] = 0
                        gone = places[2, gone]
            if state != OK:
                break
        status[row] = state
    return len(starts)
