"""Compiled walk over serialised protobuf messages: every number to its place, every length checked.

Values and presence of all rows of a batch are matrices of shape (places, rows); see
`replay.readers.messages.protobuf_places` for the places and `replay.readers.messages.protobuf` for their owner.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from replay.arrays.compiling import njit
from replay.readers.common.compiled import part
from replay.readers.messages.protobuf_places import (
    BEYOND,
    NO_ROOM,
    Ints,
    Places,
    Rows,
    Slots,
    clear,
    new_place,
    next_element,
    next_number,
    only_message,
)
from replay.readers.messages.protobuf_schema import BYTES, DOUBLE, MESSAGE, STRING, Tables
from replay.readers.messages.protobuf_wire import Wire, add_hash, find, is_text, number_at, varint, wire_of

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


class _Stack(NamedTuple):
    """Messages that are open, the outermost first: their end, place (−1: not kept), type and the field expected next."""

    end: Ints
    place: Ints
    kind: Ints
    hint: Ints


class _Field(NamedTuple):
    """A field on the wire: wire type, number, and the size of what has a length."""

    wire: int
    code: int
    size: int


class _Value(NamedTuple):
    """What a known field holds: its number in the tables, its kind, its size, and whether it is a packed array."""

    field: int
    kind: int
    size: int
    packed: bool


@part
def _head(wire: Wire, at: int, stop: int) -> tuple[_Field, int, int]:
    """Tag and length of the next field, the place behind them, and what is wrong."""
    tag = int(np.int64(wire.data[at]))
    if tag < 128:
        at += 1
    else:
        long, at = varint(wire.data, at, stop, 5)
        tag = int(np.int64(long))
        if at < 0:
            return _Field(0, 0, 0), at, CUT
    kind, code = tag & 7, tag >> 3
    if code == 0 or code >= 1 << 29 or kind > 5:
        return _Field(0, 0, 0), at, BAD_TAG
    if kind == 3 or kind == 4:
        return _Field(0, 0, 0), at, GROUP_FOUND
    size = 0
    if kind == 2:
        if at < stop and wire.data[at] < 128:
            size = int(np.int64(wire.data[at]))
            at += 1
        else:
            long, at = varint(wire.data, at, stop, 5)
            size = int(np.int64(long))
        if at < 0 or size > stop - at:
            return _Field(0, 0, 0), at, CUT
    return _Field(kind, code, size), at, OK


@part
def _skip(wire: Wire, at: int, stop: int, field: _Field) -> int:
    """Place behind a field that is not known; −1 where it is cut."""
    if field.wire == 0:
        return int(varint(wire.data, at, stop, 10)[1])
    at += field.size if field.wire == 2 else 8 if field.wire == 1 else 4
    return -1 if at > stop else at


@part
def _clear_others(
    row: int, field: int, place: int, cleared: int, rows: Rows, places: Places, slots: Slots, types: Tables
) -> int:
    """Take back the other fields of a oneof, of which the last one counts; return how often that was done in the row."""
    first = types.first[places.kind[place]]
    for other in range(first, types.first[places.kind[place] + 1]):
        beside = places.first[place] + other - first
        if other == field or types.choice[other] != types.choice[field] or slots.place[beside] < 0:
            continue
        if rows.present[slots.place[beside], row]:
            cleared += 1
            if cleared <= MAX_CLEARED:
                clear(beside, row, rows, places, slots)
    return cleared


@part
def _enter(
    row: int, slot: int, value: _Value, visit: int, limit: int, rows: Rows, places: Places, slots: Slots, types: Tables
) -> tuple[int, int]:
    """Place of the message that begins (−1: it is not kept, or `NO_ROOM`), and whether an array became too long."""
    if slot < 0:
        return -1, 0
    if not types.repeated[value.field]:
        return only_message(slot, value.field, places, slots, types), 0
    inner = next_element(slot, visit, limit, places, slots, types)
    if inner >= 0:
        rows.values[slots.counter[slot], row] = slots.met[slot]
    return inner, int(inner == BEYOND and slots.met[slot] == limit + 1)


@part
def _drop_array(row: int, slot: int, visit: int, rows: Rows, places: Places, slots: Slots) -> None:
    """Take back an array of messages that is too long, and remember how far it was read."""
    met, last = slots.met[slot], slots.last[slot]
    clear(slot, row, rows, places, slots)
    slots.visit[slot], slots.last[slot], slots.met[slot], slots.long[slot] = visit, last, met, 1


@part
def _single(
    wire: Wire, at: int, stop: int, row: int, slot: int, kind: int, rows: Rows, places: Places, slots: Slots
) -> tuple[int, int]:
    """Take one number; return the place behind it and what is wrong."""
    value, at = number_at(wire, at, stop, kind)
    if at < 0:
        return at, CUT
    if slot >= 0:
        place = slots.place[slot]
        if place < 0:
            place = new_place(slot, -1, places)
            if place < 0:
                return at, FULL
            slots.place[slot] = place
        rows.values[place, row], rows.present[place, row] = value, 1
    return at, OK


@part
def _array(
    wire: Wire, span: tuple[int, int], row: int, slot: int, value: _Value, seen: tuple[int, int], rows: Rows,
    places: Places, slots: Slots,
) -> tuple[int, int]:  # fmt: skip
    """Take numbers or names of an array, one or all that are packed; return the place behind them and what is wrong.

    `span` is where they begin and the message ends, `seen` the row's number and how many elements become places.
    """
    (at, stop), (visit, limit) = span, seen
    index, last, state = 0, -1, OK
    if slot >= 0 and slots.visit[slot] == visit:
        index, last = slots.met[slot], slots.last[slot]
    before = index
    until = at + value.size if value.packed or value.kind == STRING else stop
    while not (value.packed and at == until):
        if value.kind == STRING:
            cell, after = (np.uint64(at) << np.uint64(20)) | np.uint64(value.size if value.size < 1 << 20 else 0), until
            if slot >= 0:
                add_hash(wire.data, at, until, slots.counter[slot] + 1, row, rows.values)
        elif value.kind == DOUBLE and at + 8 <= until:
            cell, after = wire.words[at], at + 8
        else:
            cell, after = number_at(wire, at, until, value.kind)
        if after < 0:
            state = CUT
            break
        at = after
        index += 1
        if slot >= 0 and index <= limit:
            place = next_number(slot, index - 1, last, places, slots)
            if place < 0:
                return at, FULL
            last = place
            rows.values[place, row], rows.present[place, row] = cell, 1
        if not value.packed:
            break
    if slot >= 0 and index:
        slots.visit[slot], slots.last[slot], slots.met[slot] = visit, last, index
        rows.values[slots.counter[slot], row] = index if index <= limit else 0
        if index > limit and before <= limit:
            slots.long[slot], gone = 1, slots.place[slot]
            while gone >= 0:
                rows.present[gone, row] = 0
                gone = places.following[gone]
    return at, state


@part
def _walk_row(
    wire: Wire, rows: Rows, row: int, visit: int, limit: int, types: Tables, places: Places, slots: Slots, stack: _Stack
) -> int:
    """Walk one payload; return what is wrong with it, or `FULL`. The loop over fields stands whole: its state is one."""
    at, depth, cleared = rows.starts[row], 0, 0
    stack.end[0], stack.place[0], stack.kind[0], stack.hint[0] = at + rows.lengths[row], 0, 0, types.first[0]
    rows.present[0, row] = 1
    if at < 0 or rows.lengths[row] < 0 or stack.end[0] > len(wire.data):
        return CUT
    while True:
        stop = stack.end[depth]
        if at == stop:
            if depth == 0:
                return OK
            depth -= 1
            continue
        head, at, state = _head(wire, at, stop)
        if state != OK:
            return state
        low, high = types.first[stack.kind[depth]], types.first[stack.kind[depth] + 1]
        field = stack.hint[depth]
        if field >= high or types.number[field] != head.code:
            field = find(types.number, low, high, head.code)
        kind = -1 if field < 0 else types.kind[field]
        packed = field >= 0 and head.wire == 2 and kind < BYTES and types.repeated[field]
        if field < 0 or (wire_of(kind) != head.wire and not packed):
            at = _skip(wire, at, stop, head)
            if at < 0:
                return CUT
            continue
        value = _Value(field, kind, head.size, packed)
        stack.hint[depth] = field if types.repeated[field] else field + 1
        place = stack.place[depth]
        slot = -1 if place < 0 or types.hidden[field] else places.first[place] + field - low
        if kind == STRING and types.check[field] and not is_text(wire.data, at, at + head.size):
            return BAD_TEXT
        if slot >= 0 and types.choice[field] >= 0:
            cleared = _clear_others(row, field, place, cleared, rows, places, slots, types)
            if cleared > MAX_CLEARED:
                return TOO_CHANGEABLE
        if kind == MESSAGE:
            inner, too_long = _enter(row, slot, value, visit, limit, rows, places, slots, types)
            if too_long:
                cleared += 1
                if cleared > MAX_CLEARED:
                    return TOO_CHANGEABLE
                _drop_array(row, slot, visit, rows, places, slots)
            if inner == NO_ROOM:
                return FULL
            if depth == MAX_DEPTH:
                return TOO_DEEP
            if inner >= 0:
                rows.present[inner, row] = 1
            depth += 1
            stack.end[depth], stack.place[depth], stack.kind[depth] = at + head.size, inner, types.target[field]
            stack.hint[depth] = types.first[types.target[field]]
        elif kind >= BYTES and not types.key[field]:
            at += head.size
        else:
            if types.repeated[field]:
                at, state = _array(wire, (at, stop), row, slot, value, (visit, limit), rows, places, slots)
            else:
                at, state = _single(wire, at, stop, row, slot, kind, rows, places, slots)
            if state != OK:
                return state


@part
def _walk_rows(
    wire: Wire, rows: Rows, visit: int, limit: int, types: Tables, places: Places, slots: Slots, stack: _Stack
) -> int:
    for row in range(len(rows.starts)):
        state = _walk_row(wire, rows, row, visit + row + 1, limit, types, places, slots, stack)
        if state == FULL:
            return row
        rows.status[row] = state
    return len(rows.starts)


@njit(cache=True)
def walk(wire: Wire, rows: Rows, visit: int, limit: int, types: Tables, places: Places, slots: Slots) -> int:
    """Walk payloads row by row; return how many rows were done before room for places ran out.

    Parameters
    ----------
    wire : Wire
        Bytes that hold all payloads.
    rows : Rows
        The payloads, and what is filled.
    visit : int
        Number that no row had before; rows count on from it.
    limit : int
        Elements of an array that become places.
    types : Tables
        Fields of all types.
    places, slots : Places, Slots
        Those that were met; added to.
    """
    end, place = np.empty(MAX_DEPTH + 1, np.int64), np.empty(MAX_DEPTH + 1, np.int64)
    kind, hint = np.empty(MAX_DEPTH + 1, np.int64), np.empty(MAX_DEPTH + 1, np.int64)
    return _walk_rows(wire, rows, visit, limit, types, places, slots, _Stack(end, place, kind, hint))
