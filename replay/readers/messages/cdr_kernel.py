"""Compiled loops over serialised messages: rows of one fixed layout, and rows that follow one program.

Both skip rows that have an owner, copy the numbers of each row that fits into the columns of a table, and make the
table its owner. Payload bytes are untrusted: every offset is checked against the payload's end before it is used.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from replay.readers.messages.cdr_layout import MAX_ELEMENTS
from replay.readers.messages.cdr_program import (
    COUNT,
    DCLOSE,
    DOPEN,
    END,
    LOOP,
    MUTE,
    MUTES,
    NAME,
    NUMBERS,
    SEQUENCE,
    STRING,
    STRINGS,
)

FREE, BAD = -1, -2
_TILE = 32
_DEEP = 80
_FREE_STEPS, _STEPS_PER_BYTE = 4096, 16
_SHORT = 64
_NUMBERS = tuple(np.dtype(f"u{size}") for size in (1, 2, 4, 8))


def views(data: NDArray[np.uint8]) -> tuple[NDArray[Any], ...]:
    """View bytes as numbers of 1, 2, 4 and 8 bytes that start at every byte."""
    data = data.view(np.ndarray)
    if len(data) < _SHORT or not data.flags.c_contiguous:
        data = np.concatenate([data, np.zeros(_SHORT, np.uint8)])
    data.flags.writeable = False  # so are all views of it: one compiled version serves all
    size = len(data)
    return tuple(np.ndarray((size + 1 - d.itemsize,), d, data, strides=(1,)) for d in _NUMBERS)


@njit(cache=True)
def _turn8(v):  # type: ignore[no-untyped-def]
    v = ((v & np.uint64(0x00FF00FF00FF00FF)) << np.uint64(8)) | ((v >> np.uint64(8)) & np.uint64(0x00FF00FF00FF00FF))
    v = ((v & np.uint64(0x0000FFFF0000FFFF)) << np.uint64(16)) | ((v >> np.uint64(16)) & np.uint64(0x0000FFFF0000FFFF))
    return (v << np.uint64(32)) | (v >> np.uint64(32))


@njit(cache=True)
def _turn4(v):  # type: ignore[no-untyped-def]
    v = np.uint32(v)
    v = np.uint32((v & np.uint32(0x00FF00FF)) << np.uint32(8)) | np.uint32((v >> np.uint32(8)) & np.uint32(0x00FF00FF))
    return np.uint32(np.uint32(v << np.uint32(16)) | np.uint32(v >> np.uint32(16)))


@njit(cache=True)
def _turn2(v):  # type: ignore[no-untyped-def]
    return np.uint16((np.uint32(v) << np.uint32(8)) | (np.uint32(v) >> np.uint32(8)))


@njit(cache=True)
def _copy(numbers, source, offset, column, target, m):  # type: ignore[no-untyped-def]
    """Copy one number of each of m rows; indexes are unsigned, which spares a test for negative ones."""
    for k in range(m):
        column[np.uint64(target[k])] = numbers[np.uint64(source[k] + offset)]


@njit(cache=True)
def take_fixed(  # type: ignore[no-untyped-def]
    b1, b2, b4, b8, limit, starts, lengths, slots, owner, own, size, swap, check_at, check_mask, check_word,
    at1, to1, at2, to2, at4, to4, at8, to8, out1, out2, out4, out8, first,
):  # fmt: skip
    """Copy the rows of one layout; return how many there are and the first row left free, or −1."""
    taken, left = 0, -1
    source, target = np.empty(_TILE, np.int64), np.empty(_TILE, np.int64)
    for begin in range(0, len(starts), _TILE):
        m = 0
        for row in range(begin, min(begin + _TILE, len(starts))):
            if owner[slots[row]] != FREE:
                continue
            at = starts[row]
            fits = lengths[row] == size and at >= 0 and at + size <= limit
            if fits:
                wrong = np.uint64(0)
                for k in range(len(check_at)):
                    wrong |= (b8[at + check_at[k]] ^ check_word[k]) & check_mask[k]
                fits = wrong == 0
            if fits:
                owner[slots[row]] = own
                source[m], target[m] = at, first + slots[row]
                m += 1
            elif left < 0:
                left = row
        taken += m
        for c in range(len(at8)):
            _copy(b8, source, at8[c], out8[to8[c]], target, m)
        for c in range(len(at4)):
            _copy(b4, source, at4[c], out4[to4[c]], target, m)
        for c in range(len(at2)):
            _copy(b2, source, at2[c], out2[to2[c]], target, m)
        for c in range(len(at1)):
            _copy(b1, source, at1[c], out1[to1[c]], target, m)
        if swap:
            for k in range(m):
                for c in to8:
                    out8[c, target[k]] = _turn8(out8[c, target[k]])
                for c in to4:
                    out4[c, target[k]] = _turn4(out4[c, target[k]])
                for c in to2:
                    out2[c, target[k]] = _turn2(out2[c, target[k]])
    return taken, left


@njit(cache=True)
def _string(b1, b4, pos, base, end, align, swap, ended):  # type: ignore[no-untyped-def]
    """Walk over one string; return where it ends, or −1."""
    if align:
        pos = base + ((pos - base + 3) & ~3)
    if pos + 4 > end:
        return -1
    size = np.int64(_turn4(b4[pos]) if swap else b4[pos])
    pos += 4 + size
    if pos > end or (ended and (size < 1 or b1[pos - 1] != 0)):
        return -1
    return pos


@njit(cache=True)
def take_program(  # type: ignore[no-untyped-def]
    b1, b2, b4, b8, limit, starts, lengths, slots, owner, own, head, swap, biggest, slack, ops, names,
    places, hidden, out1, out2, out4, out8, first,
):  # fmt: skip
    """Walk each row along a program; return how many fit, how many are damaged, the first row left and the first bad.

    `head` are the bytes that start every payload (none in ROS 1), `biggest` the largest alignment (0: none).
    A row is damaged where it fails although all that went before fitted, else it is left to another program.
    """
    taken, bad, left, first_bad = 0, 0, -1, -1
    stack = np.empty((_DEEP, 5), np.int64)
    ends = np.empty(_DEEP, np.int64)
    for row in range(len(starts)):
        if owner[slots[row]] != FREE:
            continue
        pos, end = starts[row], starts[row] + lengths[row]
        slot = first + slots[row]
        state = 0  # 1 another shape, 2 damaged
        if pos < 0 or lengths[row] < 0 or end > limit or (len(head) and lengths[row] < 4):
            state = 2
        else:
            for k in range(len(head)):
                if b1[pos + k] != head[k]:
                    state = 1
        base = pos + 4 if len(head) else pos
        pos = base
        for k in range(len(hidden)):
            out4[places[hidden[k]], slot] = 0
        pc, depth, opened, shift, mute, steps = 0, 0, 0, 0, 0, 0
        limit_steps = _FREE_STEPS + _STEPS_PER_BYTE * (lengths[row] + len(ops))  # for elements that take no bytes
        while state == 0 and pc < len(ops):
            op, a, b, c, d = ops[pc, 0], ops[pc, 1], ops[pc, 2], ops[pc, 3], ops[pc, 4]
            pc += 1
            steps += 1
            if steps > limit_steps:
                state = 2
                break
            count = np.int64(0)
            if op in (COUNT, SEQUENCE, STRINGS, LOOP) or (op in (MUTES, MUTE) and b < 0):
                if biggest:
                    pos = base + ((pos - base + 3) & ~3)
                if pos + 4 > end:
                    state = 2
                    break
                count = np.int64(_turn4(b4[pos]) if swap else b4[pos])
                pos += 4
            if op in (NUMBERS, SEQUENCE, MUTES):
                many = count
                if op == NUMBERS:
                    many = c
                elif op == MUTES:
                    if b >= 0:
                        many = b
                    elif count < c:
                        state = 1
                        break
                elif count > c and count <= MAX_ELEMENTS:
                    state = 1
                    break
                if many == 0:
                    continue
                align = min(a, biggest)
                if align:
                    pos = base + ((pos - base + align - 1) & ~(align - 1))
                if many * a > end - pos:
                    state = 2
                    break
                if mute == 0 and op != MUTES:
                    if op == SEQUENCE:
                        out4[places[shift + d], slot] = count
                    if op == NUMBERS or count <= c:
                        for k in range(many):
                            place, q = places[shift + b + k], pos + k * a
                            if a == 8:
                                word8 = b8[q]
                                out8[place, slot] = _turn8(word8) if swap else word8
                            elif a == 4:
                                word4 = b4[q]
                                out4[place, slot] = _turn4(word4) if swap else word4
                            elif a == 2:
                                word2 = b2[q]
                                out2[place, slot] = _turn2(word2) if swap else word2
                            else:
                                out1[place, slot] = b1[q]
                pos += many * a
            elif op == COUNT:
                if count != a:
                    state = 1
            elif op == STRING:
                pos = _string(b1, b4, pos, base, end, biggest, swap, len(head) > 0)
                if pos < 0:
                    state = 2
            elif op == STRINGS:
                if count < a:
                    state = 1
                elif count * 4 > end - pos:
                    state = 2
                else:
                    for _ in range(count):
                        pos = _string(b1, b4, pos, base, end, biggest, swap, len(head) > 0)
                        if pos < 0:
                            state = 2
                            break
            elif op == NAME:
                after = _string(b1, b4, pos, base, end, biggest, swap, len(head) > 0)
                if after < 0:
                    state = 2
                    break
                if biggest:
                    pos = base + ((pos - base + 3) & ~3)
                if after - pos - 4 != b:
                    state = 1
                    break
                for k in range(b):
                    if b1[pos + 4 + k] != names[a + k]:
                        state = 1
                pos = after
            elif op in (LOOP, MUTE):
                if op == MUTE and b >= 0:
                    count = b
                elif (op == MUTE and count < c) or (op == LOOP and count > c and count <= MAX_ELEMENTS):
                    state = 1
                    break
                silent = op == MUTE or count > MAX_ELEMENTS
                if op == LOOP and mute == 0:
                    out4[places[shift + b], slot] = count
                if count == 0:
                    pc = a + 1
                else:
                    stack[depth, 0], stack[depth, 1], stack[depth, 2] = pc, count, shift
                    stack[depth, 3], stack[depth, 4] = 0 if silent else d, silent
                    depth += 1
                    mute += 1 if silent else 0
            elif op == END:
                stack[depth - 1, 1] -= 1
                if stack[depth - 1, 1] > 0:
                    pc = stack[depth - 1, 0]
                    shift += stack[depth - 1, 3]
                else:
                    depth -= 1
                    shift = stack[depth, 2]
                    mute -= stack[depth, 4]
            elif op == DOPEN:
                pos = base + ((pos - base + 3) & ~3)
                if pos + 4 > end:
                    state = 2
                    break
                size = np.int64(_turn4(b4[pos]) if swap else b4[pos])
                pos += 4
                if size > end - pos:
                    state = 2
                    break
                ends[opened] = pos + size
                opened += 1
            elif op == DCLOSE:
                opened -= 1
                if ends[opened] != pos:
                    state = 2
        if state == 0 and end - pos > slack:
            state = 2
        if state == 0:
            owner[slots[row]] = own
            taken += 1
        elif state == 2:
            owner[slots[row]] = BAD
            bad += 1
            if first_bad < 0:
                first_bad = row
        elif left < 0:
            left = row
    return taken, bad, left, first_bad
