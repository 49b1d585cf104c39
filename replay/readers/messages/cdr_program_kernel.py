"""Compiled walk over serialised messages along a program, whatever the lengths of their strings and sequences.

Rows that have an owner are skipped; the table becomes the owner of each row that fits. Payload bytes are untrusted:
every offset is checked against the payload's end before it is used.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from replay.arrays.compiling import njit
from replay.readers.common.compiled import part, routine
from replay.readers.messages.cdr_kernel import turn2, turn4, turn8
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
from replay.readers.messages.cdr_rows import BAD, FREE, Ints, OpenTable, Payloads, Steps

FITS, OTHER_SHAPE, DAMAGED = 0, 1, 2
_DEEP = 80
_FREE_STEPS, _STEPS_PER_BYTE = 4096, 16


class _Row(NamedTuple):
    """One payload: where alignment counts from, where it ends, and its place in the table's cells."""

    base: int
    end: int
    slot: int


class _Step(NamedTuple):
    """Operation and operands; see `replay.readers.messages.cdr_program`."""

    op: int
    a: int
    b: int
    c: int
    d: int


@part
def _aligned(pos: int, base: int, align: int) -> int:
    return base + ((pos - base + align - 1) & ~(align - 1))


@part
def _length(payloads: Payloads, steps: Steps, row: _Row, pos: int) -> tuple[int, int]:
    """Length word at a place, and the place behind it or −1."""
    if steps.biggest:
        pos = _aligned(pos, row.base, 4)
    if pos + 4 > row.end:
        return 0, -1
    word = turn4(payloads.b4[pos]) if steps.swap else payloads.b4[pos]
    return int(np.int64(word)), pos + 4


@routine
def _string(payloads: Payloads, steps: Steps, row: _Row, pos: int) -> int:
    """Walk over one string; return where it ends, or −1."""
    size, pos = _length(payloads, steps, row, pos)
    if pos < 0:
        return -1
    pos += size
    if pos > row.end or (len(steps.head) > 0 and (size < 1 or payloads.b1[pos - 1] != 0)):
        return -1
    return pos


@part
def _copy(payloads: Payloads, swap: bool, table: OpenTable, size: int, pos: int, place: int, slot: int) -> None:
    """Copy one number of 1, 2, 4 or 8 bytes to its column."""
    if size == 8:
        word8 = payloads.b8[pos]
        table.out8[place, slot] = turn8(word8) if swap else word8
    elif size == 4:
        word4 = payloads.b4[pos]
        table.out4[place, slot] = turn4(word4) if swap else word4
    elif size == 2:
        word2 = payloads.b2[pos]
        table.out2[place, slot] = turn2(word2) if swap else word2
    else:
        table.out1[place, slot] = payloads.b1[pos]


@part
def _numbers(
    payloads: Payloads,
    steps: Steps,
    table: OpenTable,
    row: _Row,
    step: _Step,
    count: int,
    pos: int,
    shift: int,
    mute: int,
) -> tuple[int, int]:
    """Take the numbers of NUMBERS, SEQUENCE or MUTES; return the place behind them and the row's state."""
    many = count
    if step.op == NUMBERS:
        many = step.c
    elif step.op == MUTES:
        if step.b >= 0:
            many = step.b
        elif count < step.c:
            return pos, OTHER_SHAPE
    elif count > step.c and count <= MAX_ELEMENTS:
        return pos, OTHER_SHAPE
    if many == 0:
        return pos, FITS
    size = step.a
    align = min(size, steps.biggest)
    if align:
        pos = _aligned(pos, row.base, align)
    if many * size > row.end - pos:
        return pos, DAMAGED
    if mute == 0 and step.op != MUTES:
        if step.op == SEQUENCE:
            table.out4[steps.places[shift + step.d], row.slot] = count
        if step.op == NUMBERS or count <= step.c:
            for k in range(many):
                place = steps.places[shift + step.b + k]
                _copy(payloads, steps.swap, table, size, pos + k * size, place, row.slot)
    return pos + many * size, FITS


@part
def _texts(payloads: Payloads, steps: Steps, row: _Row, step: _Step, count: int, pos: int) -> tuple[int, int]:
    """Walk over what STRING, STRINGS or NAME stands for; return the place behind it and the row's state."""
    if step.op == STRINGS:
        if count < step.a:
            return pos, OTHER_SHAPE
        if count * 4 > row.end - pos:
            return pos, DAMAGED
        for _ in range(count):
            pos = _string(payloads, steps, row, pos)
            if pos < 0:
                return pos, DAMAGED
        return pos, FITS
    after = _string(payloads, steps, row, pos)
    if after < 0:
        return pos, DAMAGED
    if step.op == STRING:
        return after, FITS
    if steps.biggest:
        pos = _aligned(pos, row.base, 4)
    if after - pos - 4 != step.b:
        return pos, OTHER_SHAPE
    state = FITS
    for k in range(step.b):
        if payloads.b1[pos + 4 + k] != steps.names[step.a + k]:
            state = OTHER_SHAPE
    return after, state


@part
def _begin(payloads: Payloads, steps: Steps, start: int, end: int) -> int:
    """State of a row by where its payload lies and by its first bytes."""
    if start < 0 or end < start or end > payloads.limit or (len(steps.head) and end - start < 4):
        return DAMAGED
    state = FITS
    for k in range(len(steps.head)):
        if payloads.b1[start + k] != steps.head[k]:
            state = OTHER_SHAPE
    return state


@part
def _has_length(step: _Step) -> bool:
    """Whether a length word stands before what a step takes."""
    op = step.op
    return op in (COUNT, SEQUENCE, STRINGS, LOOP, DOPEN) or (op in (MUTES, MUTE) and step.b < 0)


@part
def _rounds(step: _Step, count: int) -> int:
    """How often the steps of LOOP or MUTE are taken; −1 where the shape is another."""
    if step.op == MUTE and step.b >= 0:
        return step.b
    if (step.op == MUTE and count < step.c) or (step.op == LOOP and count > step.c and count <= MAX_ELEMENTS):
        return -1
    return count


@part
def _walk(payloads: Payloads, steps: Steps, table: OpenTable, row: _Row, loops: Ints, ends: Ints) -> int:
    """Follow the program over one payload; return the row's state.

    `loops` is a stack of loops (first step, rounds left, shift of columns before it and in each round, whether nothing
    in it is kept), `ends` one of the collections that state their size.
    """
    pos, state = row.base, FITS
    pc, depth, opened, shift, mute, done = 0, 0, 0, 0, 0, 0
    size = row.end - row.base + (4 if len(steps.head) else 0)
    most = _FREE_STEPS + _STEPS_PER_BYTE * (size + len(steps.ops))
    while state == FITS and pc < len(steps.ops):
        step = _Step(steps.ops[pc, 0], steps.ops[pc, 1], steps.ops[pc, 2], steps.ops[pc, 3], steps.ops[pc, 4])
        op, count = step.op, 0
        pc += 1
        done += 1
        if done > most:  # elements may take no bytes
            return DAMAGED
        if _has_length(step):
            count, pos = _length(payloads, steps, row, pos)
            if pos < 0:
                return DAMAGED
        if op in (NUMBERS, SEQUENCE, MUTES):
            pos, state = _numbers(payloads, steps, table, row, step, count, pos, shift, mute)
        elif op in (STRING, STRINGS, NAME):
            pos, state = _texts(payloads, steps, row, step, count, pos)
        elif op == COUNT:
            state = FITS if count == step.a else OTHER_SHAPE
        elif op in (LOOP, MUTE):
            count = _rounds(step, count)
            if count < 0:
                return OTHER_SHAPE
            silent = op == MUTE or count > MAX_ELEMENTS
            if op == LOOP and mute == 0:
                table.out4[steps.places[shift + step.b], row.slot] = count
            if count == 0:
                pc = step.a + 1
            else:
                loops[depth, 0], loops[depth, 1], loops[depth, 2] = pc, count, shift
                loops[depth, 3], loops[depth, 4] = 0 if silent else step.d, silent
                depth += 1
                mute += 1 if silent else 0
        elif op == END:
            loops[depth - 1, 1] -= 1
            if loops[depth - 1, 1] > 0:
                pc = loops[depth - 1, 0]
                shift += loops[depth - 1, 3]
            else:
                depth -= 1
                shift = loops[depth, 2]
                mute -= loops[depth, 4]
        elif op == DOPEN:
            if count > row.end - pos:
                return DAMAGED
            ends[opened] = pos + count
            opened += 1
        elif op == DCLOSE:
            opened -= 1
            if ends[opened] != pos:
                state = DAMAGED
    return DAMAGED if state == FITS and row.end - pos > steps.slack else state


@part
def _take(payloads: Payloads, steps: Steps, table: OpenTable, loops: Ints, ends: Ints) -> tuple[int, int, int, int]:
    taken, bad, left, first_bad = 0, 0, -1, -1
    for i in range(len(payloads.starts)):
        slot = payloads.slots[i]
        if table.owner[slot] != FREE:
            continue
        start = payloads.starts[i]
        end = start + payloads.lengths[i]
        state = _begin(payloads, steps, start, end)
        if state == FITS:
            row = _Row(start + 4 if len(steps.head) else start, end, table.first + slot)
            for k in steps.hidden:
                table.out4[steps.places[k], row.slot] = 0
            state = _walk(payloads, steps, table, row, loops, ends)
        if state == FITS:
            table.owner[slot] = table.number
            taken += 1
        elif state == DAMAGED:
            table.owner[slot] = BAD
            bad += 1
            if first_bad < 0:
                first_bad = i
        elif left < 0:
            left = i
    return taken, bad, left, first_bad


@njit(cache=True)
def take_program(payloads: Payloads, steps: Steps, table: OpenTable) -> tuple[int, int, int, int]:
    """Walk each row along a program; return how many fit, how many are damaged, the first row left and the first bad.

    A row is damaged where it fails although all that went before fitted, else it is left to another program.
    """
    return _take(payloads, steps, table, np.empty((_DEEP, 5), np.int64), np.empty(_DEEP, np.int64))
