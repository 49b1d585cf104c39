"""Where each number of one serialised message lies (CDR and ROS 1)."""

from __future__ import annotations

import re
import struct
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import Nodetype

from replay.readers.definitions import MAX_DEPTH, TIME, MessageType

MAX_ELEMENTS = 64
MAX_STEPS = 50_000

_DTYPES = {
    "bool": "u1",
    "byte": "u1",
    "octet": "u1",
    "char": "u1",
    "int8": "i1",
    "uint8": "u1",
    "int16": "i2",
    "uint16": "u2",
    "int32": "i4",
    "uint32": "u4",
    "float32": "f4",
    "int64": "i8",
    "uint64": "u8",
    "float64": "f8",
}
_KEYS = re.compile(r"(^|_)(names?|joints?|labels?|symbols?|keys?)$|Names?$|Symbols?$", re.ASCII)
_PLACEHOLDER = "structure_needs_at_least_one_member"


class LayoutError(Exception):
    """A payload does not fit its definition; the text says where."""


@dataclass(frozen=True)
class Slot:
    """One number in a payload: its path, byte offset and type."""

    path: str
    offset: int
    dtype: np.dtype[Any]


@dataclass(frozen=True)
class Layout:
    """Places of all numbers in payloads that agree in length and in every checked byte.

    Attributes
    ----------
    size : int
        Payload length [bytes].
    slots : tuple[Slot, ...]
        Numbers in message order.
    checks : tuple[tuple[int, bytes], ...]
        Offset and content of what fixes the layout: encapsulation, length words, names that serve as keys.
    skipped : tuple[str, ...]
        Arrays too long to become channels.
    """

    size: int
    slots: tuple[Slot, ...]
    checks: tuple[tuple[int, bytes], ...]
    skipped: tuple[str, ...]

    @cached_property
    def span(self) -> int:
        """Bytes from the start that hold every slot and check."""
        ends = [s.offset + s.dtype.itemsize for s in self.slots] + [o + len(b) for o, b in self.checks]
        return max(ends, default=0)

    @cached_property
    def fixed(self) -> tuple[NDArray[np.int64], NDArray[np.uint8]]:
        """Offset and value of every checked byte."""
        at = [np.arange(o, o + len(b)) for o, b in self.checks]
        value = b"".join(b for _, b in self.checks)
        return np.concatenate(at) if at else np.empty(0, np.int64), np.frombuffer(value, np.uint8)


@dataclass
class _Scope:
    """Arrays of names inside one message, which key the arrays beside them."""

    parent: _Scope | None
    keys: list[tuple[bool, list[str]]] = field(default_factory=list)


@dataclass(frozen=True)
class _Index:
    number: int
    length: int
    fixed: bool
    scope: _Scope

    def label(self) -> str:
        scope: _Scope | None = self.scope
        while scope is not None:
            for fixed, names in scope.keys:
                if fixed == self.fixed and len(names) == self.length and len(set(names)) == len(names) and all(names):
                    return f"[{names[self.number]}]"
            scope = scope.parent
        return f"[{self.number}]"


_Path = tuple[str | _Index, ...]


class _Walk:
    """One pass over one payload."""

    def __init__(self, kind: MessageType, data: bytes) -> None:
        self.kind, self.data, self.end = kind, data, len(data)
        self.checks: list[tuple[int, bytes]] = []
        self.slots: list[tuple[_Path, int, str]] = []
        self.skipped: list[_Path] = []
        self.order, self.base, self.steps = "<", 0, 0
        if not kind.ros1:
            if self.end < 4:
                raise LayoutError(f"a payload of {self.end} bytes has no encapsulation header")
            if data[0] != 0 or data[1] > 1:
                raise LayoutError(f"encapsulation {data[0]:02x}{data[1]:02x} is not plain CDR")
            self.order, self.base = "<" if data[1] else ">", 4
            self.checks.append((0, data[:2]))
        self.pos = self.base

    def run(self) -> Layout:
        self.message((), self.kind.name, None, True)
        slack = 0 if self.kind.ros1 else 3
        if self.end - self.pos > slack:
            raise LayoutError(f"{self.end - self.pos} bytes follow the last field; the definition does not fit")
        slots = tuple(Slot(_text(p), o, np.dtype(self.order + t)) for p, o, t in self.slots)
        return Layout(self.end, slots, tuple(self.checks), tuple(_text(p) for p in self.skipped))

    def take(self, size: int, align: int) -> int:
        """Reserve `size` bytes, aligned in CDR, and return where they start."""
        self.step()
        at = self.pos
        if not self.kind.ros1:
            at = self.base + (at - self.base + align - 1) // align * align
        if at + size > self.end:
            raise LayoutError(f"a payload of {self.end} bytes ends inside a field at byte {at}")
        self.pos = at + size
        return at

    def step(self) -> None:
        """Count parts, so that no definition can make a payload endless."""
        self.steps += 1
        if self.steps > MAX_STEPS:
            raise LayoutError(f"a message has more than {MAX_STEPS} parts")

    def word(self) -> int:
        at = self.take(4, 4)
        self.checks.append((at, self.data[at : at + 4]))
        value: int = struct.unpack_from(f"{self.order}I", self.data, at)[0]
        return value

    def string(self) -> tuple[int, int]:
        length = self.word()
        return self.take(length, 1), length

    def message(self, path: _Path, name: str, parent: _Scope | None, emit: bool) -> None:
        self.step()
        if len(path) > 2 * MAX_DEPTH:
            raise LayoutError("messages are nested too deep")
        scope = _Scope(parent)
        fields = self.kind.fields[name]
        if self.kind.ros1 and name == TIME:
            self.number((*path, "sec"), "u4", emit)
            self.number((*path, "nanosec"), "u4", emit)
            return
        if not fields and not self.kind.ros1:
            self.take(1, 1)
        for label, (kind, value) in fields:
            if label == _PLACEHOLDER:
                if not self.kind.ros1:
                    self.take(1, 1)
            elif kind in (Nodetype.ARRAY, Nodetype.SEQUENCE):
                self.array((*path, label), value[0], value[1], kind == Nodetype.ARRAY, scope, emit)
            else:
                self.one((*path, label), (kind, value), scope, emit)

    def one(self, path: _Path, kind: Any, scope: _Scope, emit: bool) -> None:
        if kind[0] == Nodetype.NAME:
            self.message(path, kind[1], scope, emit)
        elif kind[1][0] == "string":
            self.string()
        else:
            self.number(path, _dtype(kind[1][0]), emit)

    def number(self, path: _Path, dtype: str, emit: bool) -> None:
        size = int(dtype[1])
        at = self.take(size, size)
        if emit:
            self.slots.append((path, at, dtype))

    def array(self, path: _Path, kind: Any, count: int, fixed: bool, scope: _Scope, emit: bool) -> None:
        if not fixed:
            count = self.word()
        if kind[0] == Nodetype.BASE and kind[1][0] == "string":
            self.strings(str(path[-1]), count, fixed, scope)
            return
        wanted = emit and count <= MAX_ELEMENTS
        if emit and not wanted:
            self.skipped.append(path)
        if kind[0] == Nodetype.BASE:
            dtype = _dtype(kind[1][0])
            size = int(dtype[1])
            at = self.take(size * count, size) if count else self.pos
            if wanted:
                self.slots += [((*path, _Index(i, count, fixed, scope)), at + size * i, dtype) for i in range(count)]
            return
        for i in range(count):
            self.message((*path, _Index(i, count, fixed, scope)), kind[1], scope, wanted)

    def strings(self, label: str, count: int, fixed: bool, scope: _Scope) -> None:
        keys = _KEYS.search(label) is not None and count <= MAX_ELEMENTS
        names = []
        for _ in range(count):
            at, length = self.string()
            if keys:
                raw = self.data[at : at + length]
                self.checks.append((at, raw))
                names.append(raw.rstrip(b"\0").decode("utf-8", "replace").strip())
        if names:
            scope.keys.append((fixed, names))


def _dtype(name: str) -> str:
    if name not in _DTYPES:
        raise LayoutError(f"fields of type {name} are not supported")
    return _DTYPES[name]


def _text(path: _Path) -> str:
    parts = [p.label() if isinstance(p, _Index) else f".{p}" for p in path]
    return "".join(parts).removeprefix(".")


def layout_of(kind: MessageType, payload: bytes) -> Layout:
    """Walk one payload.

    Raises
    ------
    LayoutError
        Where the payload does not fit the definition.
    """
    return _Walk(kind, payload).run()
