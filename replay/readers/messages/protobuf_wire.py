"""Compiled parts of protobuf's wire format: lengths, numbers, text."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from replay.readers.common.compiled import part, routine
from replay.readers.messages.protobuf_schema import (  # fmt: skip
    BOOL,
    BYTES,
    DOUBLE,
    FIXED32,
    FIXED64,
    FLOAT,
    GROUP,
    MESSAGE,
    SFIXED32,
    SFIXED64,
    SINT32,
    SINT64,
    STRING,
)


class Wire(NamedTuple):
    """Bytes that hold payloads, and the 8-byte and 4-byte numbers that start at each of them."""

    data: NDArray[np.uint8]
    words: NDArray[np.uint64]
    halves: NDArray[np.uint32]


@routine
def varint(data: NDArray[np.uint8], at: int, stop: int, most: int) -> tuple[Any, int]:
    """Value and the place behind it; place −1 where it is cut or longer than `most` bytes. `data` of shape (bytes,)."""
    if at < stop and data[at] < 128:
        return np.uint64(data[at]), at + 1
    value = np.uint64(0)
    for i in range(most):
        if at + i >= stop:
            return value, -1
        byte = np.uint64(data[at + i])
        value |= (byte & np.uint64(127)) << np.uint64(7 * i)
        if byte < 128:
            return value, at + i + 1
    return value, -1


@routine
def is_text(data: NDArray[np.uint8], at: int, stop: int) -> bool:
    """Whether bytes are UTF-8 without surrogates and overlong forms. `data` of shape (bytes,)."""
    while at < stop:
        lead = data[at]
        if lead < 0x80:
            at += 1
            continue
        more = 1 if 0xC2 <= lead < 0xE0 else 2 if 0xE0 <= lead < 0xF0 else 3 if 0xF0 <= lead < 0xF5 else 0
        if more == 0 or at + more >= stop:
            return False
        second = data[at + 1]
        low, high = 0x80, 0xC0
        if lead == 0xE0:
            low = 0xA0
        elif lead == 0xED:
            high = 0xA0
        elif lead == 0xF0:
            low = 0x90
        elif lead == 0xF4:
            high = 0x90
        if second < low or second >= high:
            return False
        for i in range(2, more + 1):
            if data[at + i] & 0xC0 != 0x80:
                return False
        at += more + 1
    return True


@part
def wire_of(kind: int) -> int:
    """Wire type of a single value."""
    if kind in (DOUBLE, FIXED64, SFIXED64):
        return 1
    if kind in (FLOAT, FIXED32, SFIXED32):
        return 5
    if kind in (BYTES, STRING, MESSAGE):
        return 2
    if kind == GROUP:
        return 3
    return 0


@routine
def find(number: NDArray[np.int64], low: int, high: int, code: int) -> int:
    """Field of a type by its number on the wire; −1 for none.

    `number` of shape (fields,), rising from `low` to `high`.
    """
    end = high
    while low < end:
        middle = (low + end) >> 1
        if number[middle] < code:
            low = middle + 1
        else:
            end = middle
    return low if low < high and number[low] == code else -1


@routine
def number_at(wire: Wire, at: int, stop: int, kind: int) -> tuple[Any, int]:
    """One number as 64 bits, and the place behind it or −1."""
    wire_type = wire_of(kind)
    if wire_type != 0:
        width = 8 if wire_type == 1 else 4
        if at + width > stop:
            return np.uint64(0), -1
        return wire.words[at] if wire_type == 1 else np.uint64(wire.halves[at]), at + width
    value, after = varint(wire.data, at, stop, 10)
    if kind == BOOL:
        value = np.uint64(1) if value != 0 else np.uint64(0)
    elif kind == SINT32:
        value &= np.uint64(0xFFFFFFFF)
        value = (value >> np.uint64(1)) ^ (np.uint64(0) - (value & np.uint64(1)))
    elif kind == SINT64:
        value = (value >> np.uint64(1)) ^ (np.uint64(0) - (value & np.uint64(1)))
    return value, after


@routine
def add_hash(data: NDArray[np.uint8], at: int, stop: int, place: int, row: int, values: NDArray[np.uint64]) -> None:
    """Add one name to the hash of an array of names. `data` of shape (bytes,), `values` of shape (columns, rows)."""
    mark = values[place, row] ^ np.uint64(0xCBF29CE484222325)
    for i in range(at, stop):
        mark = (mark ^ np.uint64(data[i])) * np.uint64(0x100000001B3)
    values[place, row] = (mark ^ np.uint64(stop - at)) * np.uint64(0x100000001B3)
