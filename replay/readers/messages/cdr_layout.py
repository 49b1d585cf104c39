"""Where each number of one serialised message lies (CDR and ROS 1)."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import Nodetype

from replay.readers.messages.definitions import MAX_DEPTH, TIME, MessageType
from replay.readers.messages.encodings import Dialect, Field, LayoutError, dialect_of, is_number, type_of, width_of
from replay.readers.messages.fields import Index, Path, Place, Scope, is_key_list, place_of, text_of

MAX_ELEMENTS = 64
MAX_STEPS = 300_000
PLACEHOLDER = "structure_needs_at_least_one_member"


@dataclass(frozen=True)
class Slot:
    """One number in a payload: its path, byte offset and type (``?`` for truth values)."""

    path: str
    offset: int
    dtype: str

    @property
    def size(self) -> int:
        """Bytes that it takes."""
        return width_of(self.dtype)


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
        Offset and content of what fixes the layout: encapsulation, length words, ends of strings, names that serve as
        keys.
    skipped : tuple[str, ...]
        Arrays too long to become channels.
    dialect : Dialect
        Serialisation.
    counts : Mapping[Place, int]
        Length of every sequence.
    names : Mapping[Place, tuple[bytes, ...]]
        Raw strings of every array of names that may key others.
    texts : tuple[tuple[str, int, int], ...]
        Path, offset and bytes of every text but those that name elements of an array beside them.
    long : tuple[str, ...]
        Arrays of texts too long to become channels.
    """

    size: int
    slots: tuple[Slot, ...]
    checks: tuple[tuple[int, bytes], ...]
    skipped: tuple[str, ...]
    dialect: Dialect
    counts: Mapping[Place, int]
    names: Mapping[Place, tuple[bytes, ...]]
    texts: tuple[tuple[str, int, int], ...] = ()
    long: tuple[str, ...] = ()

    @cached_property
    def naming(self) -> frozenset[Place]:
        """Messages that hold an array of names."""
        return frozenset(place[:-1] for place in self.names)

    def words(self) -> tuple[NDArray[np.int64], NDArray[np.uint64], NDArray[np.uint64]]:
        """Offset, mask and content of words of eight bytes that hold every checked byte of a payload of eight or more.

        Returns
        -------
        tuple[NDArray[np.int64], NDArray[np.uint64], NDArray[np.uint64]], each of shape (k,)
            Words lie inside the payload; bytes outside the checks are masked.
        """
        whole, mask = np.zeros(self.size, np.uint8), np.zeros(self.size, np.uint8)
        for at, content in self.checks:
            whole[at : at + len(content)] = np.frombuffer(content, np.uint8)
            mask[at : at + len(content)] = 255
        at_words = np.minimum(np.unique(np.flatnonzero(mask) // 8) * 8, self.size - 8)
        cells = at_words[:, None] + np.arange(8)
        masks, words = (np.ascontiguousarray(a[cells]).view(np.uint64)[:, 0] for a in (mask, whole))
        return at_words, masks, words


class _Walk:
    """One pass over one payload."""

    def __init__(self, kind: MessageType, data: bytes) -> None:
        self.kind, self.data, self.end = kind, data, len(data)
        self.checks: list[tuple[int, bytes]] = []
        self.slots: list[tuple[Path, int, str]] = []
        self.skipped: list[Path] = []
        self.counts: dict[Place, int] = {}
        self.names: dict[Place, tuple[bytes, ...]] = {}
        self.texts: list[tuple[Path, int, int]] = []
        self.long: list[Path] = []
        self.steps = 0
        self.dialect = dialect_of(data, kind.ros1)
        self.base = self.pos = self.dialect.base
        if self.dialect.head:
            self.checks.append((0, self.dialect.head))

    def run(self) -> Layout:
        self.message((), self.kind.name, None, True)
        if self.end - self.pos > self.dialect.slack:
            raise LayoutError(f"{self.end - self.pos} bytes follow the last field; the definition does not fit")
        slots = tuple(Slot(text_of(p), o, t) for p, o, t in self.slots)
        skipped = tuple(text_of(p) for p in self.skipped)
        long = tuple(text_of(p) for p in self.long)
        return Layout(
            self.end, slots, tuple(self.checks), skipped, self.dialect, self.counts, self.names, self.free_texts(), long
        )

    def free_texts(self) -> tuple[tuple[str, int, int], ...]:
        """Texts but for the names that stand in the paths of numbers."""
        used = {part.label() for path, _, _ in self.slots for part in path if isinstance(part, Index)}
        keys = {
            (*place, i)
            for place, raw in self.names.items()
            if used >= {f"[{r.rstrip(bytes(1)).decode('utf-8', 'replace').strip()}]" for r in raw}
            for i in range(len(raw))
        }
        end = 1 if self.dialect.head else 0  # the zero byte behind it
        return tuple((text_of(p), at, size - end) for p, at, size in self.texts if place_of(p) not in keys)

    def take(self, size: int, align: int) -> int:
        """Reserve `size` bytes, aligned in CDR, and return where they start."""
        self.step()
        at, align = self.pos, min(align, self.dialect.align)
        if align:
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
        value: int = struct.unpack_from(f"{self.dialect.order}I", self.data, at)[0]
        return value

    def string(self) -> tuple[int, int]:
        length = self.word()
        at = self.take(length, 1)
        if self.dialect.head:
            if not length or self.data[self.pos - 1]:
                raise LayoutError(f"the string at byte {at} does not end with a zero byte")
            self.checks.append((self.pos - 1, b"\0"))
        return at, length

    def message(self, path: Path, name: str, parent: Scope | None, emit: bool) -> None:
        self.step()
        if len(path) > 2 * MAX_DEPTH:
            raise LayoutError("messages are nested too deep")
        scope = Scope(parent)
        fields = self.kind.fields[name]
        if self.kind.ros1 and name == TIME:
            self.number((*path, "sec"), "u4", emit)
            self.number((*path, "nanosec"), "u4", emit)
            return
        if not fields and not self.kind.ros1:
            self.take(1, 1)
        for label, (kind, value) in fields:
            if label == PLACEHOLDER:
                if not self.kind.ros1:
                    self.take(1, 1)
            elif kind in (Nodetype.ARRAY, Nodetype.SEQUENCE):
                stop = self.box(value[0])
                self.array((*path, label), value[0], value[1], kind == Nodetype.ARRAY, scope, emit)
                if stop is not None and stop != self.pos:
                    raise LayoutError(f"the collection at byte {stop} is of another size than stated")
            else:
                self.one((*path, label), (kind, value), scope, emit)

    def box(self, kind: Field) -> int | None:
        """Read the size of a collection where the serialisation states it, and return where it ends."""
        if not self.dialect.boxed or is_number(kind):
            return None
        size = self.word()
        return self.pos + size

    def one(self, path: Path, kind: Field, scope: Scope, emit: bool) -> None:
        if kind[0] == Nodetype.NAME:
            self.message(path, kind[1], scope, emit)
        elif kind[1][0] == "string":
            at, size = self.string()
            if emit:
                self.texts.append((path, at, size))
        else:
            self.number(path, type_of(kind[1][0]), emit)

    def number(self, path: Path, dtype: str, emit: bool) -> None:
        size = width_of(dtype)
        at = self.take(size, size)
        if emit:
            self.slots.append((path, at, dtype))

    def array(self, path: Path, kind: Field, count: int, fixed: bool, scope: Scope, emit: bool) -> None:
        if not fixed:
            count = self.counts[place_of(path)] = self.word()
        if kind[0] == Nodetype.BASE and kind[1][0] == "string":
            self.strings(path, count, fixed, scope, emit)
            return
        wanted = emit and count <= MAX_ELEMENTS
        if emit and not wanted:
            self.skipped.append(path)
        if kind[0] == Nodetype.BASE:
            dtype = type_of(kind[1][0])
            size = width_of(dtype)
            at = self.take(size * count, size) if count else self.pos
            if wanted:
                self.slots += [((*path, Index(i, count, fixed, scope)), at + size * i, dtype) for i in range(count)]
            return
        plain = count > MAX_ELEMENTS and self.plain(kind[1])
        met: dict[int, tuple[int, int]] = {}
        i = 0
        while i < count:
            self.message((*path, Index(i, count, fixed, scope)), kind[1], scope, wanted)
            i += 1
            if plain:  # elements of one size: their pattern repeats once an alignment has come back
                before = met.setdefault((self.pos - self.base) % 8, (i, self.pos))
                if before[0] < i:
                    laps = (count - i) // (i - before[0])
                    self.take(laps * (self.pos - before[1]), 1)
                    i += laps * (i - before[0])
                    plain = False

    def plain(self, name: str) -> bool:
        """Whether a message holds numbers alone."""
        return all(
            kind == Nodetype.NAME or is_number((kind, value))
            for within in self.kind.inside(name)
            for _, (kind, value) in self.kind.fields[within]
        )

    def strings(self, path: Path, count: int, fixed: bool, scope: Scope, emit: bool) -> None:
        short = count <= MAX_ELEMENTS
        keys = is_key_list(str(path[-1])) and short
        if emit and not short:
            self.long.append(path)
        names = []
        for i in range(count):
            at, length = self.string()
            if emit and short:
                self.texts.append(((*path, Index(i, count, fixed, scope)), at, length))
            if keys:
                names.append(self.data[at : at + length])
                self.checks.append((at, names[-1]))
        if names:
            self.names[place_of(path)] = tuple(names)
            scope.add(fixed, tuple(names))


def layout_of(kind: MessageType, payload: bytes) -> Layout:
    """Walk one payload.

    Raises
    ------
    LayoutError
        Where the payload does not fit the definition.
    """
    walk = _Walk(kind, payload)
    try:
        return walk.run()
    except LayoutError as error:
        error.steps = walk.steps
        raise
