"""Compiled parts of a walk over protobuf messages that make, find and clear the places of values.

A *place* is where a value can stand: a message, a number, or an element of an array, in every message of one type the
same one. Places are made when they are first met, so that types which hold themselves cost what the data hold. A
*slot* is a field of a message's place; that of an array holds a chain of element places.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from replay.arrays.compiling import njit
from replay.readers.common.compiled import part, routine
from replay.readers.messages.protobuf_schema import Tables

Ints = NDArray[np.int64]
NO_ROOM, BEYOND = -2, -1


class Places(NamedTuple):
    """Places, in the order in which they were made; −1 stands for none.

    Attributes
    ----------
    used : NDArray[np.int64], shape (1,)
        How many there are.
    slot, element : NDArray[np.int64], shape (p,)
        The slot that holds each, and its index in an array.
    following : NDArray[np.int64], shape (p,)
        Next element of the array.
    kind, first : NDArray[np.int64], shape (p,)
        Type and first slot of a message.
    """

    used: Ints
    slot: Ints
    element: Ints
    following: Ints
    kind: Ints
    first: Ints


class Slots(NamedTuple):
    """Slots, those of one message one after another; −1 stands for none.

    Attributes
    ----------
    used : NDArray[np.int64], shape (1,)
        How many there are.
    message, field : NDArray[np.int64], shape (s,)
        Place of the message that each belongs to, and its field.
    place, counter : NDArray[np.int64], shape (s,)
        Place of the value (of the first element of an array), and that of an array's count.
    visit, last, met : NDArray[np.int64], shape (s,)
        Of an array in the row at hand: the row's number, place of the last element and how many were met.
    long : NDArray[np.int64], shape (s,)
        1 where the array ever was too long.
    """

    used: Ints
    message: Ints
    field: Ints
    place: Ints
    counter: Ints
    visit: Ints
    last: Ints
    met: Ints
    long: Ints


class Rows(NamedTuple):
    """Payloads of a batch and what the walk fills for them.

    Attributes
    ----------
    starts, lengths : NDArray[np.int64], shape (n,)
        Where the payloads lie.
    values, present : NDArray, shape (p, n)
        Cells of 64 bits of each place, and whether they are there; zero before.
    status : NDArray[np.uint8], shape (n,)
        What is wrong with each row.
    """

    starts: Ints
    lengths: Ints
    values: NDArray[np.uint64]
    present: NDArray[np.uint8]
    status: NDArray[np.uint8]


@part
def new_place(slot: int, index: int, places: Places) -> int:
    """Make a place; −1 where there is no room."""
    place = int(places.used[0])
    if place >= len(places.slot):
        return -1
    places.used[0] += 1
    places.slot[place], places.element[place], places.following[place] = slot, index, -1
    places.kind[place], places.first[place] = -1, -1
    return place


@routine
def new_message(slot: int, index: int, kind: int, places: Places, slots: Slots, types: Tables) -> int:
    """Make the place of a message with its slots; −1 where there is no room."""
    count = types.first[kind + 1] - types.first[kind]
    if slots.used[0] + count > len(slots.field) or places.used[0] + 1 + 2 * count > len(places.slot):
        return -1
    place = new_place(slot, index, places)
    first = slots.used[0]
    places.kind[place], places.first[place] = kind, first
    slots.used[0] += count
    for i in range(count):
        s, f = first + i, types.first[kind] + i
        slots.message[s], slots.field[s], slots.place[s], slots.counter[s] = place, f, -1, -1
        slots.visit[s], slots.last[s], slots.met[s] = -1, -1, 0
        if types.repeated[f]:  # a place for the count, for names one more for their hash
            slots.counter[s] = new_place(s, -1, places)
            if types.key[f]:
                new_place(s, -1, places)
        elif types.implicit[f]:  # its absence means 0
            slots.place[s] = new_place(s, -1, places)
    return place


@njit(cache=True)
def make_root(places: Places, slots: Slots, types: Tables) -> None:
    """Make the place of the message itself."""
    new_message(-1, -1, 0, places, slots, types)


@routine
def clear(slot: int, row: int, rows: Rows, places: Places, slots: Slots) -> None:
    """Take back everything below a slot in one row."""
    for place in range(places.used[0]):
        up = places.slot[place]
        while up >= 0 and up != slot:
            up = places.slot[slots.message[up]]
        if up == slot:
            rows.values[place, row], rows.present[place, row] = 0, 0
    for other in range(slots.used[0]):
        up = other
        while up >= 0 and up != slot:
            up = places.slot[slots.message[up]]
        if up == slot:
            slots.visit[other] = -1


@part
def next_element(slot: int, visit: int, limit: int, places: Places, slots: Slots, types: Tables) -> int:
    """Place of the next message in an array; `BEYOND` the limit, or `NO_ROOM`."""
    if slots.visit[slot] != visit:
        slots.visit[slot], slots.last[slot], slots.met[slot] = visit, -1, 0
    index = slots.met[slot]
    slots.met[slot] += 1
    if index >= limit:
        return BEYOND
    last = slots.last[slot]
    place = int(slots.place[slot] if last < 0 else places.following[last])
    if place < 0:
        place = new_message(slot, index, types.target[slots.field[slot]], places, slots, types)
        if place < 0:
            return NO_ROOM
        if last < 0:
            slots.place[slot] = place
        else:
            places.following[last] = place
    slots.last[slot] = place
    return place


@part
def only_message(slot: int, field: int, places: Places, slots: Slots, types: Tables) -> int:
    """Place of the message in a slot that is no array, or `NO_ROOM`."""
    inner = int(slots.place[slot])
    if inner < 0:
        inner = new_message(slot, -1, types.target[field], places, slots, types)
        if inner < 0:
            return NO_ROOM
        slots.place[slot] = inner
    return inner


@part
def next_number(slot: int, index: int, last: int, places: Places, slots: Slots) -> int:
    """Place of the next number of an array, behind the place `last`; −1 where there is no room."""
    place = int(slots.place[slot] if last < 0 else places.following[last])
    if place < 0:
        place = new_place(slot, index, places)
        if place >= 0:
            if last < 0:
                slots.place[slot] = place
            else:
                places.following[last] = place
    return place
