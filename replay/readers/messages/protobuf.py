"""Columnar decoding of protobuf messages: a compiled walk fills one column for each number that the data hold.

Numbers whose absence means 0 (proto3 without ``optional``) have a sample wherever their message is present; all others
have one where they are on the wire. Text, bytes, maps and groups do not become columns. An enumeration's number stays a
number even where the schema has no name for it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from replay.readers.common.compiled import plain
from replay.readers.messages import protobuf_kernel as kernel
from replay.readers.messages.cdr import Outcome, Part
from replay.readers.messages.cdr_layout import MAX_ELEMENTS
from replay.readers.messages.cdr_rows import views
from replay.readers.messages.protobuf_places import Places, Rows, Slots, make_root
from replay.readers.messages.protobuf_schema import NUMBERS, Schema
from replay.readers.messages.protobuf_wire import Wire

MAX_PLACES = 50_000
_CELLS = 1 << 21
_MAX_ROWS = 8192
_MAX_GROUPS = 24
_MAX_KNOWN = 64
_LAST_SECOND = 9_000_000_000


class Decoder:
    """Decodes payloads of one message type; remembers the places it has met.

    Parameters
    ----------
    schema : Schema
        The type of all payloads.
    outcome : Outcome
        Counts of undecodable and slowly decoded messages, added to.
    """

    def __init__(self, schema: Schema, outcome: Outcome) -> None:
        self.schema, self.outcome = schema, outcome
        t = schema.tables
        fields = int(t.first[1])
        self.places = Places(np.zeros(1, np.int64), *np.full((5, 64 + 2 * fields), -1, np.int64))
        self.slots = Slots(np.zeros(1, np.int64), *np.full((8, 64 + fields), -1, np.int64))
        self.visit = 0
        self.paths: dict[tuple[int, bytes], dict[int, str]] = {}
        make_root(self.places, self.slots, t)

    def decode(self, data: NDArray[np.uint8], starts: NDArray[np.int64], lengths: NDArray[np.int64]) -> Iterator[Part]:
        """Decode payloads into columns.

        Parameters
        ----------
        data : NDArray[np.uint8], shape (b,)
            Bytes that hold all payloads.
        starts, lengths : NDArray[np.int64], shape (n,)
            Place of each payload in `data`.

        Yields
        ------
        Part
            Numbers that stand in the same rows; rows of undecodable messages stand in none.
        """
        _, _, halves, words = views(data)
        wire = Wire(plain(data), words, halves)
        at = 0
        while at < len(starts):
            size = len(self.places.slot)
            n = min(len(starts) - at, max(_CELLS // size, 16), _MAX_ROWS)
            room = n // 64 * 64 + 72  # so that places start in different cache sets
            values, present = np.zeros((size, room), np.uint64), np.zeros((size, room), np.uint8)
            rows = Rows(starts[at : at + n], lengths[at : at + n], values, present, np.zeros(n, np.uint8))
            done = kernel.walk(wire, rows, self.visit, MAX_ELEMENTS, self.schema.tables, self.places, self.slots)
            self.visit += n
            if done:
                yield from self._parts(data, at, values[:, :done], present[:, :done], rows.status[:done])
            at += done
            if done < n and not self._grow():  # this message asks for more places than are allowed
                self._refuse(np.array([kernel.TOO_MANY]))
                at += 1

    def _grow(self) -> bool:
        """Double the room for places and slots; False where that is too much."""
        if len(self.places.slot) >= MAX_PLACES:
            return False
        self.places = Places(self.places.used, *map(_doubled, self.places[1:]))
        self.slots = Slots(self.slots.used, *map(_doubled, self.slots[1:]))
        return True

    def _refuse(self, states: NDArray[Any]) -> None:
        self.outcome.bad += len(states)
        if len(states):
            self.outcome.reason = self.outcome.reason or kernel.REASONS[int(states[0])]

    def _parts(
        self, data: NDArray[np.uint8], first: int, values: NDArray[Any], present: NDArray[Any], status: NDArray[Any]
    ) -> Iterator[Part]:
        good = status == kernel.OK
        self._refuse(status[~good])
        if not good.all():
            values, present = values[:, good], present[:, good]
        if not values.shape[1]:
            return
        rows = np.flatnonzero(good) + first
        groups = self._groups(values)
        if len(groups) > _MAX_GROUPS:
            self.outcome.slow += len(rows)
        for pick in groups:
            one = slice(None) if pick is None else pick
            yield from self._columns(data, rows[one], values[:, one], present[:, one])

    def _groups(self, values: NDArray[np.uint64]) -> list[NDArray[np.int64] | None]:
        """Rows by what names their elements and how many there are; None stands for all rows."""
        decisive = self._decisive()
        if not decisive:
            return [None]
        mark = _mark(values[decisive])
        if (mark == mark[0]).all():
            return [None]
        which = np.unique(mark, return_inverse=True)[1]
        return [np.flatnonzero(which == i) for i in range(int(which.max()) + 1)]

    def _decisive(self) -> list[int]:
        """Places of the counts of arrays and of the hashes of names, where there are names at all."""
        slots, made = self.slots, int(self.slots.used[0])
        if not self.schema.tables.key.any():
            return []
        heads = np.flatnonzero(slots.counter[:made] >= 0)
        named = self.schema.tables.key[slots.field[heads]]
        return [*slots.counter[heads].tolist(), *(slots.counter[heads[named]] + 1).tolist()]

    def _columns(
        self, data: NDArray[np.uint8], rows: NDArray[np.int64], values: NDArray[Any], present: NDArray[Any]
    ) -> Iterator[Part]:
        """Columns of rows whose elements have the same names."""
        t, slots, places = self.schema.tables, self.slots, self.places
        paths = self._paths(data, values, present)
        whole: dict[str, NDArray[Any]] = {}
        parts: dict[str, tuple[NDArray[np.bool_], NDArray[Any]]] = {}
        for place, path in paths.items():
            slot = places.slot[place]
            field = slots.field[slot]
            there = present[slots.message[slot] if t.implicit[field] else place].view(np.bool_)
            count = np.count_nonzero(there)
            if count == len(rows):
                whole[path] = _typed(values[place], int(t.kind[field]))
            elif count:
                parts[path] = there, _typed(values[place, there], int(t.kind[field]))
        if self.schema.stamp is not None:
            self._take_stamp(self.schema.stamp, len(rows), whole, parts)
        yield Part(rows, whole, self._skipped())
        for path, (there, column) in parts.items():
            yield Part(rows[there], {path: column}, ())

    @staticmethod
    def _take_stamp(
        stamp: tuple[str, str, str],
        count: int,
        whole: dict[str, NDArray[Any]],
        parts: dict[str, tuple[NDArray[np.bool_], NDArray[Any]]],
    ) -> None:
        """Give the stamp its common names, in all rows: 0 where it is absent or beyond 64-bit nanoseconds."""
        path, *leaves = stamp
        full = []
        for leaf in leaves:
            column = np.zeros(count, np.int64)
            if f"{path}.{leaf}" in whole:
                column[:] = whole.pop(f"{path}.{leaf}")
            elif f"{path}.{leaf}" in parts:
                there, some = parts.pop(f"{path}.{leaf}")
                column[there] = some
            full.append(column)
        far = (full[0] > _LAST_SECOND) | (full[0] < -_LAST_SECOND)
        for column, name in zip(full, ("sec", "nanosec"), strict=True):
            column[far] = 0
            whole[f"{path}.{name}"] = column

    def _skipped(self) -> tuple[str, ...]:
        long = np.flatnonzero(self.slots.long[: self.slots.used[0]] == 1)
        return tuple(self._slot_path(int(s), lambda slot, i: f"[{i}]") for s in long)

    def _paths(self, data: NDArray[np.uint8], values: NDArray[Any], present: NDArray[Any]) -> dict[int, str]:
        """Path of each place of a number, elements named as in the first row."""
        slots, places, t = self.slots, self.places, self.schema.tables
        decisive = self._decisive()
        key = int(places.used[0]), values[decisive, 0].tobytes()
        known = self.paths.get(key)
        if known is not None:
            return known
        names = self._names(data, values[:, 0], present[:, 0]) if decisive else {}

        def label(slot: int, index: int) -> str:
            node, count = slots.message[slot], values[slots.counter[slot], 0] if names else 0
            while names:
                first, kind = int(places.first[node]), places.kind[node]
                for beside in range(first, first + int(t.first[kind + 1] - t.first[kind])):
                    if len(names.get(beside, ())) == count and count:
                        return f"[{names[beside][index]}]" if index < count else f"[{index}]"
                if places.slot[node] < 0:
                    break
                node = slots.message[places.slot[node]]
            return f"[{index}]"

        found = {}
        for place in range(1, int(places.used[0])):
            slot, index = int(places.slot[place]), int(places.element[place])
            field = slots.field[slot]
            if t.kind[field] < len(NUMBERS) and (index >= 0 or not t.repeated[field]):
                found[place] = self._slot_path(slot, label) + (label(slot, index) if index >= 0 else "")
        if len(self.paths) > _MAX_KNOWN:
            self.paths.clear()
        self.paths[key] = found
        return found

    def _slot_path(self, slot: int, label: Callable[[int, int], str]) -> str:
        """Path of a field, without an index of its own."""
        parts = []
        while True:
            parts.append(self.schema.fields[self.slots.field[slot]].name)
            node = self.slots.message[slot]
            slot, index = int(self.places.slot[node]), int(self.places.element[node])
            if slot < 0:
                return "".join(reversed(parts))
            parts.append((label(slot, index) if index >= 0 else "") + ".")

    def _names(self, data: NDArray[np.uint8], values: NDArray[Any], present: NDArray[Any]) -> dict[int, list[str]]:
        """Arrays of distinct names in one row, by their slots."""
        slots, made = self.slots, int(self.slots.used[0])
        names = {}
        for slot in np.flatnonzero(self.schema.tables.key[slots.field[:made]]).tolist():
            place, held = int(slots.place[slot]), []
            while place >= 0 and present[place]:
                start, size = int(values[place]) >> 20, int(values[place]) & 0xFFFFF
                text = data[start : start + size].tobytes().rstrip(b"\0").decode("utf-8", "replace").strip()
                held.append(text)
                place = int(self.places.following[place])
            if all(held) and len(set(held)) == len(held):
                names[slot] = held
        return names


def _doubled(numbers: NDArray[np.int64]) -> NDArray[np.int64]:
    """Room for twice as many numbers."""
    return np.concatenate([numbers, np.full(len(numbers), -1, np.int64)])


def _mark(columns: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """One number for each column of a matrix, equal where the columns are."""
    mark = np.zeros(columns.shape[1], np.uint64)
    for row in columns:
        mark = (mark ^ row) * np.uint64(0x9E3779B97F4A7C15)
        mark ^= mark >> np.uint64(29)
    return mark


def _typed(cells: NDArray[np.uint64], kind: int) -> NDArray[Any]:
    """Cells of 64 bits as numbers of their kind, in an array of their own."""
    dtype = np.dtype(NUMBERS[kind])
    if dtype.kind == "f" and dtype.itemsize == 4:
        return cells.astype(np.uint32).view(dtype)
    return cells.astype(dtype) if dtype.kind != "f" else cells.copy().view(dtype)
