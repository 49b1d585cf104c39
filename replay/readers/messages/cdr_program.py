"""Programs: how to walk over payloads of one shape whose strings and sequences may have any length.

A shape is what names the numbers: the encapsulation, the names that key arrays and the lengths of arrays that they may
key. One payload gives the shape; everything else stays free, up to a number of elements per sequence that grows with
what the log holds. Numbers of elements that a row lacks are told apart by hidden columns, which hold the counts.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import Nodetype

from replay.readers.messages.cdr_layout import MAX_ELEMENTS, PLACEHOLDER, Layout
from replay.readers.messages.definitions import TIME, MessageType
from replay.readers.messages.encodings import Dialect, Field, is_number, type_of, width_of
from replay.readers.messages.fields import Index, Path, Place, Scope, is_key_list, place_of, text_of

# a number field n times: size, column, n
NUMBERS = 0
# free sequence of numbers: size, first column, most elements, hidden column
SEQUENCE = 1
# a sequence must have this length: n
COUNT = 2
STRING = 3
# free sequence of strings: fewest
STRINGS = 4
# a string must be this: offset in the names, size
NAME = 5
# free sequence of messages: place of its end, hidden column, most elements, columns of one element
LOOP = 6
# numbers that become no channels: size, how many (−1: a length word says), fewest
MUTES = 7
# messages that become no channels: place of their end, how many (−1: a length word says), fewest
MUTE = 8
END = 9
# XCDR2: size in bytes of a collection, and its end
DOPEN, DCLOSE = 10, 11

MAX_COLUMNS = 4096
MAX_STEPS = 1 << 17
_WIDTH = 5


class TooWide(Exception):
    """A program would need too many columns or steps."""


@dataclass(frozen=True)
class Spec:
    """One column: its path, number type (``?`` for truth values) and the hidden count that must exceed `number`."""

    path: str
    dtype: str
    guard: str = ""
    number: int = 0


@dataclass(frozen=True)
class Program:
    """Steps for the compiled walk, and the columns that it fills.

    Attributes
    ----------
    ops : NDArray[np.int64], shape (n, 5)
        Operation and operands.
    names : NDArray[np.uint8]
        Bytes of all names, one after another.
    specs : tuple[Spec, ...]
        Columns; hidden ones have the dtype ``#``.
    shape : tuple
        What two programs have in common that differ in the number of elements alone.
    dialect : Dialect
        Serialisation.
    """

    ops: NDArray[np.int64]
    names: NDArray[np.uint8]
    specs: tuple[Spec, ...]
    shape: tuple[object, ...]
    dialect: Dialect


@dataclass
class Compiler:
    """Compiles the program of one payload's shape.

    Parameters
    ----------
    kind : MessageType
        The type.
    layout : Layout
        The payload's layout, which has its lengths and names.
    room : Mapping[Place, int]
        Most elements of free sequences, by field.
    """

    kind: MessageType
    layout: Layout
    room: Mapping[Place, int]
    ops: list[list[int]] = field(default_factory=list)
    names: bytearray = field(default_factory=bytearray)
    specs: list[tuple[Path, str, str, int]] = field(default_factory=list)
    exact: list[object] = field(default_factory=list)
    guard: tuple[str, int] = ("", 0)
    visits: int = 0

    def run(self) -> Program:
        """Compile.

        Raises
        ------
        TooWide
            Where the columns or steps are too many.
        """
        self.message((), self.kind.name, None, True, False)
        specs = tuple(Spec(text_of(p), t, g, n) for p, t, g, n in self.specs)
        ops = np.array([o + [0] * (_WIDTH - len(o)) for o in self.ops], np.int64).reshape(-1, _WIDTH)
        names = np.frombuffer(bytes(self.names) or b"\0", np.uint8)
        return Program(ops, names, specs, (self.layout.dialect, *self.exact), self.layout.dialect)

    def column(self, path: Path, dtype: str, guard: tuple[str, int] | None = None) -> int:
        """Add a column and return its number.

        Raises
        ------
        TooWide
            Where it would need too many columns or steps.
        """
        if len(self.specs) >= MAX_COLUMNS:
            raise TooWide
        self.specs.append((path, dtype, *(self.guard if guard is None else guard)))
        return len(self.specs) - 1

    def message(self, path: Path, name: str, parent: Scope | None, emit: bool, loose: bool) -> None:
        """Compile one message; `loose` where it stands in a free sequence, so that no sample tells its lengths.

        Raises
        ------
        TooWide
            Where it would need too many columns or steps.
        """
        self.visits += 1 + len(self.kind.fields[name])
        if self.visits > MAX_STEPS:  # a definition may name parts in parts without end, none of which a message fills
            raise TooWide
        scope = Scope(parent)
        fields = self.kind.fields[name]
        if self.kind.ros1 and name == TIME:
            self.number((*path, "sec"), "u4", emit)
            self.number((*path, "nanosec"), "u4", emit)
            return
        if not fields and not self.kind.ros1:
            self.ops.append([MUTES, 1, 1])
        for label, (kind, value) in fields:
            if label == PLACEHOLDER:
                if not self.kind.ros1:
                    self.ops.append([MUTES, 1, 1])
            elif kind in (Nodetype.ARRAY, Nodetype.SEQUENCE):
                length = value[1] if kind == Nodetype.ARRAY else -1
                boxed = self.layout.dialect.boxed and not is_number(value[0])
                if boxed:
                    self.ops.append([DOPEN])
                self.array((*path, label), value[0], length, scope, emit, loose)
                if boxed:
                    self.ops.append([DCLOSE])
            elif kind == Nodetype.NAME:
                self.message((*path, label), value, scope, emit, loose)
            elif value[0] == "string":
                self.ops.append([STRING])
            else:
                self.number((*path, label), type_of(value[0]), emit)

    def number(self, path: Path, dtype: str, emit: bool) -> None:
        """Compile one number."""
        size = width_of(dtype)
        self.ops.append([NUMBERS, size, self.column(path, dtype), 1] if emit else [MUTES, size, 1])

    def array(self, path: Path, kind: Field, length: int, scope: Scope, emit: bool, loose: bool) -> None:
        """Compile an array (`length` as defined) or a sequence (−1)."""
        fixed, counted = length >= 0, -1
        if not loose and not fixed:
            counted = self.layout.counts.get(place_of(path), -1)
        if kind[0] == Nodetype.BASE and kind[1][0] == "string":
            self.strings(path, length, counted, scope, loose)
            return
        if fixed and (length > MAX_ELEMENTS or not emit):
            self.silent(path, kind, length, 0, scope)
        elif not emit:
            self.silent(path, kind, -1, 0, scope)
        elif fixed:
            self.elements(path, kind, length, True, scope, loose)
        elif self.free(place_of(path), kind, loose):
            self.sequence(path, kind, scope)
        else:
            self.exact.append((place_of(path), counted if counted <= MAX_ELEMENTS else -1))
            if counted > MAX_ELEMENTS:
                self.silent(path, kind, -1, MAX_ELEMENTS + 1, scope)
            else:
                self.ops.append([COUNT, counted])
                self.elements(path, kind, counted, False, scope, loose)

    def free(self, place: Place, kind: Field, loose: bool) -> bool:
        """Whether nothing names the elements of a sequence, nor anything inside them."""
        if loose:
            return True
        if any(place[:n] in self.layout.naming for n in range(len(place))):
            return False
        return not (kind[0] == Nodetype.NAME and self.keyed(kind[1]))

    def keyed(self, name: str) -> bool:
        """Whether a message, or one inside it, may hold an array of names."""
        return any(
            kind in (Nodetype.ARRAY, Nodetype.SEQUENCE)
            and value[0][0] == Nodetype.BASE
            and value[0][1][0] == "string"
            and is_key_list(label)
            for within in self.kind.inside(name)
            for label, (kind, value) in self.kind.fields[within]
        )

    def elements(self, path: Path, kind: Field, count: int, fixed: bool, scope: Scope, loose: bool) -> None:
        """Compile a known number of elements."""
        paths: list[Path] = [(*path, Index(i, count, fixed, scope)) for i in range(count)]
        if kind[0] == Nodetype.BASE:
            dtype = type_of(kind[1][0])
            columns = [self.column(p, dtype) for p in paths]
            if columns:
                self.ops.append([NUMBERS, width_of(dtype), columns[0], count])
            return
        for p in paths:
            self.message(p, kind[1], scope, True, loose)

    def sequence(self, path: Path, kind: Field, scope: Scope) -> None:
        """Compile a sequence of any length."""
        most = self.room.get(tuple(p for p in place_of(path) if isinstance(p, str)), 0)
        hidden = self.column(path, "#", ("", 0))
        text = text_of(path)
        outer, bare = self.guard, Scope(None)
        if kind[0] == Nodetype.BASE:
            dtype = type_of(kind[1][0])
            for i in range(most):
                self.column((*path, Index(i, most, False, bare)), dtype, (text, i))
            self.ops.append([SEQUENCE, width_of(dtype), hidden + 1, most, hidden])
            return
        at = len(self.ops)
        self.ops.append([LOOP])
        for i in range(most):
            self.guard = (text, i)
            body = len(self.ops)
            self.message((*path, Index(i, most, False, bare)), kind[1], bare, True, True)
            if i:
                del self.ops[body:]
        stride = (len(self.specs) - hidden - 1) // most if most else 0
        self.guard = outer
        if not most:
            self.message((*path, Index(0, 1, False, bare)), kind[1], bare, False, True)
        self.ops.append([END])
        self.ops[at] = [LOOP, len(self.ops) - 1, hidden, most, stride]

    def silent(self, path: Path, kind: Field, length: int, fewest: int, scope: Scope) -> None:
        """Compile an array that becomes no channel."""
        if kind[0] == Nodetype.BASE:
            dtype = type_of(kind[1][0])
            self.ops.append([MUTES, width_of(dtype), length, fewest])
        elif length != 0:
            at = len(self.ops)
            self.ops.append([MUTE])
            self.message((*path, Index(0, 1, False, scope)), kind[1], scope, False, True)
            self.ops.append([END])
            self.ops[at] = [MUTE, len(self.ops) - 1, length, fewest]

    def strings(self, path: Path, length: int, counted: int, scope: Scope, loose: bool) -> None:
        """Compile an array of strings, which may be names.

        Raises
        ------
        TooWide
            Where it would need too many columns or steps.
        """
        names = None if loose else self.layout.names.get(place_of(path))
        if names is not None:
            scope.add(length >= 0, names)
            self.exact.append((place_of(path), names))
            if length < 0:
                self.ops.append([COUNT, len(names)])
            for name in names:
                self.ops.append([NAME, len(self.names), len(name)])
                self.names += name
        elif length >= 0:
            self.visits += length
            if self.visits > MAX_STEPS:
                raise TooWide
            self.ops += [[STRING]] * length
        elif counted == 0 and is_key_list(str(path[-1])):
            self.exact.append((place_of(path), ()))
            self.ops.append([COUNT, 0])
        else:
            long = counted > MAX_ELEMENTS and is_key_list(str(path[-1]))
            self.exact += [(place_of(path), None)] if long else []
            self.ops.append([STRINGS, MAX_ELEMENTS + 1 if long else 0])
