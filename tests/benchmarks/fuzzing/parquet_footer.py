"""Footers of Parquet files taken apart as Thrift, with other numbers, texts and lists, and put together whole again."""

from __future__ import annotations

import random
from dataclasses import dataclass
from typing import Any

from tests.benchmarks.fuzzing.damage import FAR

_TRUE, _FALSE, _BYTE, _I16, _I32, _I64, _DOUBLE, _BINARY, _LIST, _SET, _MAP, _STRUCT = range(1, 13)
_NUMBERS = (_BYTE, _I16, _I32, _I64)


@dataclass
class Struct:
    """Fields of a Thrift struct in compact form: number, type, value."""

    fields: list[list[Any]]


@dataclass
class Sequence:
    """A list or set: type of its elements, and these."""

    kind: int
    items: list[Any]


class _Source:
    def __init__(self, raw: bytes) -> None:
        self.raw, self.at = raw, 0

    def byte(self) -> int:
        self.at += 1
        return self.raw[self.at - 1]

    def varint(self) -> int:
        out = shift = 0
        while True:
            byte = self.byte()
            out |= (byte & 0x7F) << shift
            if byte < 0x80:
                return out
            shift += 7

    def value(self, kind: int) -> Any:
        if kind in (_TRUE, _FALSE):
            return kind == _TRUE
        if kind == _BYTE:
            return self.byte()
        if kind in _NUMBERS:
            number = self.varint()
            return (number >> 1) ^ -(number & 1)
        if kind in (_DOUBLE, _BINARY):
            size = 8 if kind == _DOUBLE else self.varint()
            self.at += size
            return self.raw[self.at - size : self.at]
        if kind in (_LIST, _SET):
            head = self.byte()
            count = head >> 4 if head >> 4 != 15 else self.varint()
            inner = head & 15
            return Sequence(inner, [self.byte() == 1 if inner <= _FALSE else self.value(inner) for _ in range(count)])
        assert kind == _STRUCT, kind
        fields, number = [], 0
        while (head := self.byte()) & 15:
            kind = head & 15
            if head >> 4:
                number += head >> 4
            else:
                number = self.value(_I16)
            fields.append([number, kind, self.value(kind)])
        return Struct(fields)


def parsed(raw: bytes) -> Struct:
    """Take a footer apart."""
    return _Source(raw).value(_STRUCT)


def _varint(value: int) -> bytes:
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes([*out, value])


def _written(kind: int, value: Any) -> bytes:
    if kind in (_TRUE, _FALSE):
        return b""
    if kind == _BYTE:
        return bytes([value % 256])
    if kind in _NUMBERS:
        return _varint(((value << 1) ^ (value >> 63)) % 2**64)
    if kind == _DOUBLE:
        return bytes(value)
    if kind == _BINARY:
        return _varint(len(value)) + value
    if isinstance(value, Sequence):
        count = len(value.items)
        head = bytes([count << 4 | value.kind]) if count < 15 else bytes([0xF0 | value.kind]) + _varint(count)
        return head + b"".join(
            bytes([1 if v else 2]) if value.kind <= _FALSE else _written(value.kind, v) for v in value.items
        )
    out = b""
    for number, inner, content in value.fields:
        inner = (_TRUE if content else _FALSE) if inner in (_TRUE, _FALSE) else inner
        out += bytes([inner]) + _written(_I16, number) + _written(inner, content)
    return out + b"\0"


def with_lies(raw: bytes, source: random.Random) -> tuple[bytes, str]:
    """Another footer of the same grammar, and what was changed."""
    tree, done = parsed(raw), []
    for _ in range(source.choice((1, 1, 1, 2, 3))):
        places = list(_places(tree, ()))
        numbers = [p for p in places if p[1] in _NUMBERS]
        holder, kind, key, path = source.choice(numbers if source.random() < 0.7 else places)
        old = holder[key]
        if kind in _NUMBERS:
            new = source.choice((*FAR, -1, -(2**31), -(2**63), old + 1, old - 1, old * 2, -old, *range(12)))
            holder[key] = (new + 2**63) % 2**64 - 2**63
        elif kind == _BINARY:
            holder[key] = source.choice(
                (b"", b"x" * 70_000, b"\xff\xfe", b"a.b", b"t", old + b"\0", old[::-1], b"\x1b[31m\n")
            )
        elif isinstance(old, Sequence):
            items = old.items
            old.items = source.choice((items[:-1], items + items[:1], items[::-1], [], items * 40, items[:1]))
        elif isinstance(old, Struct):
            fields = old.fields
            way = source.random()
            if way < 0.5 and fields:
                fields.pop(source.randrange(len(fields)))
            elif way < 0.7 and fields:
                fields.append(source.choice(fields))
            else:
                fields.append([source.randrange(1, 30), _I32, source.choice(FAR) % 2**31])
        else:
            holder[key] = not old
        done.append(".".join(map(str, path)))
    return _written(_STRUCT, tree), f"footer fields {', '.join(done)}"


def _places(value: Any, path: tuple[int, ...]) -> Any:
    if isinstance(value, Struct):
        for field in value.fields:
            yield field, field[1], 2, (*path, field[0])
            yield from _places(field[2], (*path, field[0]))
    elif isinstance(value, Sequence):
        for k, item in enumerate(value.items):
            yield value.items, value.kind, k, (*path, k)
            yield from _places(item, (*path, k))
