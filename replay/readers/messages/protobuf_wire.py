"""Compiled parts of protobuf's wire format: lengths, numbers, text."""

from __future__ import annotations

import numpy as np
from numba import njit

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


@njit(cache=True)
def varint(data, at, stop, most):  # type: ignore[no-untyped-def]
    """Value and the place behind it; place −1 where it is cut or longer than `most` bytes."""
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


@njit(cache=True)
def is_text(data, at, stop):  # type: ignore[no-untyped-def]
    """Whether bytes are UTF-8 without surrogates and overlong forms."""
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


@njit(cache=True)
def wire_of(kind):  # type: ignore[no-untyped-def]
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


@njit(cache=True)
def find(number, low, high, code):  # type: ignore[no-untyped-def]
    """Field of a type by its number on the wire; −1 for none."""
    end = high
    while low < end:
        middle = (low + end) >> 1
        if number[middle] < code:
            low = middle + 1
        else:
            end = middle
    return low if low < high and number[low] == code else -1


@njit(cache=True)
def number_at(data, words, halves, at, stop, kind):  # type: ignore[no-untyped-def]
    """One number as 64 bits, and the place behind it or −1."""
    wire = wire_of(kind)
    if wire != 0:
        width = 8 if wire == 1 else 4
        if at + width > stop:
            return np.uint64(0), -1
        return words[at] if wire == 1 else np.uint64(halves[at]), at + width
    value, after = varint(data, at, stop, 10)
    if kind == BOOL:
        value = np.uint64(1) if value != 0 else np.uint64(0)
    elif kind == SINT32:
        value &= np.uint64(0xFFFFFFFF)
        value = (value >> np.uint64(1)) ^ (np.uint64(0) - (value & np.uint64(1)))
    elif kind == SINT64:
        value = (value >> np.uint64(1)) ^ (np.uint64(0) - (value & np.uint64(1)))
    return value, after


@njit(cache=True)
def add_hash(data, at, stop, place, row, values):  # type: ignore[no-untyped-def]
    """Add one name to the hash of an array of names."""
    mark = values[place, row] ^ np.uint64(0xCBF29CE484222325)
    for i in range(at, stop):
        mark = (mark ^ np.uint64(data[i])) * np.uint64(0x100000001B3)
    values[place, row] = (mark ^ np.uint64(stop - at)) * np.uint64(0x100000001B3)
