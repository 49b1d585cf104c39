"""All numbers of one topic while a log is read: tables that share its messages batch by batch, joined at the end."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from replay.arrays.column_store import ColumnStore
from replay.readers.messages.cdr_layout import MAX_ELEMENTS
from replay.readers.messages.cdr_program import Spec
from replay.readers.messages.cdr_rows import FREE, OpenTable
from replay.readers.messages.tables import SIZES, Budget, Cells, Rows, Table

_FEWEST_TAKEN, _MOST_SHAPES = 16, 8


@dataclass(frozen=True)
class Part:
    """Numbers of some rows of a batch.

    Attributes
    ----------
    rows : NDArray[np.int64], shape (m,)
        Row numbers, increasing.
    columns : Mapping[str, NDArray], each of shape (m,)
        Values by field path.
    skipped : tuple[str, ...]
        Arrays too long to become channels.
    texts : Mapping[str, Sequence[str]], each of shape (m,)
        Texts by field path, where they are asked for.
    """

    rows: Rows
    columns: Mapping[str, NDArray[Any]]
    skipped: tuple[str, ...]
    texts: Mapping[str, Sequence[str]] = field(default_factory=dict)


@dataclass
class Store:
    """All numbers of one topic.

    Attributes
    ----------
    count : int
        Messages of the batches that have ended.
    expected : int
        How many are foretold; 0 where nothing is known.
    budget : Budget or None
        Where room for them is taken from.
    columns : ColumnStore
        Where long columns stand.
    skipped : set[str]
        Arrays too long to become channels.
    """

    expected: int = 0
    budget: Budget | None = None
    columns: ColumnStore = field(default_factory=ColumnStore)
    count: int = 0
    skipped: set[str] = field(default_factory=set)
    tables: dict[frozenset[Spec], Table] = field(default_factory=dict)
    parts: dict[str, list[tuple[Rows, NDArray[Any]]]] = field(default_factory=dict)
    owner: NDArray[np.int32] = field(default_factory=lambda: np.empty(0, np.int32))
    opened: dict[int, tuple[Table, int]] = field(default_factory=dict)

    def table(self, specs: Iterable[Spec]) -> Table:
        """Return the table of these columns."""
        specs = tuple(dict.fromkeys(specs))
        key = frozenset(specs)
        if key not in self.tables:
            expected = 0 if self.tables else self.expected
            self.tables[key] = Table(len(self.tables), specs, self.columns, expected, self.budget)
        return self.tables[key]

    def begin(self, rows: int) -> None:
        """Start a batch of so many messages; nobody owns any of them yet."""
        self.owner = np.full(rows, FREE, np.int32)
        self.opened = {}

    def room(self, table: Table) -> int:
        """Return where in the table's grid the batch stands."""
        if table.number not in self.opened:
            self.opened[table.number] = table, table.open(len(self.owner))
        return self.opened[table.number][1]

    def open(self, table: Table) -> OpenTable:
        """Return the table's room for the batch."""
        first = self.room(table)
        return OpenTable(self.owner, table.number, first, *table.grid.cells)

    def add(self, part: Part) -> None:
        """Add numbers of some rows; where they are all that many rows hold, these stand in a table of their own."""
        self.skipped.update(part.skipped)
        if part.columns and self._take(part):
            return
        rows = part.rows + self.count
        for path, values in part.columns.items():
            self.parts.setdefault(path, []).append((rows, values))

    def _take(self, part: Part) -> bool:
        """Copy a part into a table, unless its rows are few or have a table already."""
        specs = [Spec(path, values.dtype.str[1:]) for path, values in part.columns.items()]
        known = frozenset(specs) in self.tables or len(self.tables) < _MOST_SHAPES
        if not known or len(part.rows) < _FEWEST_TAKEN or (self.owner[part.rows] != FREE).any():
            return False
        table = self.table(specs)
        at = self.room(table) + part.rows
        for spec, values in zip(specs, part.columns.values(), strict=True):
            size = values.dtype.itemsize
            table.grid.cells[SIZES.index(size)][table.place[spec], at] = values.view(f"u{size}")
        self.owner[part.rows] = table.number
        return True

    def end(self) -> None:
        """End the batch: each table keeps the rows that it owns."""
        rows = len(self.owner)
        for table, _ in self.opened.values():
            mine = self.owner == table.number
            count = int(np.count_nonzero(mine))
            if count:
                table.close(None if count == rows else np.flatnonzero(mine), rows, self.count)
        self.count += rows
        self.opened = {}

    @property
    def held(self) -> int:
        """Bytes in memory."""
        return sum(t.held for t in self.tables.values())

    def spill(self) -> None:
        """Send all tables to temporary files."""
        for table in self.tables.values():
            table.spill()

    def finish(self) -> dict[str, Cells]:
        """Return rows (None for all) and values by path, in recorded order; the store is empty then."""
        found: dict[str, list[Cells]] = {}
        for table in self.tables.values():
            for path, cells in self._visible(table):
                found.setdefault(path, []).append(cells)
        self.tables = {}
        for path, parts in self.parts.items():
            found.setdefault(path, []).extend(parts)
        self.parts = {}
        joined: dict[tuple[int, ...], tuple[Rows | None, NDArray[np.int64] | None]] = {}
        kept = [rows for cells in found.values() for rows, _ in cells]  # so that no identity is used twice
        out = {path: self._join(found.pop(path), joined) for path in list(found)}
        del kept
        return out

    def _visible(self, table: Table) -> Iterable[tuple[str, Cells]]:
        rows, columns = table.finish()
        if rows is None and table.count < self.count:
            rows = np.arange(table.count)
        hidden = {s.path: c for s, c in zip(table.specs, columns, strict=True) if s.dtype == "#"}
        self.skipped.update(path for path, counts in hidden.items() if (counts > MAX_ELEMENTS).any())
        guarded: dict[tuple[str, int], tuple[NDArray[np.int64], Rows]] = {}
        for i, spec in enumerate(table.specs):
            values, columns[i] = columns[i], np.empty(0)
            if spec.dtype == "#":
                continue
            if not spec.guard:
                yield spec.path, (rows, values)
                continue
            key = spec.guard, spec.number
            if key not in guarded:
                counts = hidden[spec.guard]
                there = np.flatnonzero((counts > spec.number) & (counts <= MAX_ELEMENTS))
                guarded[key] = there, there if rows is None else rows[there]
            there, named = guarded[key]
            if len(there):
                yield spec.path, (named, values[there])

    def _join(
        self, cells: list[Cells], joined: dict[tuple[int, ...], tuple[Rows | None, NDArray[np.int64] | None]]
    ) -> Cells:
        """Bring the values of several tables into recorded order."""
        if len(cells) == 1:
            rows, values = cells[0]
            return None if len(values) == self.count else rows, values
        key = tuple(id(rows) for rows, _ in cells)
        if key not in joined:
            every = np.concatenate([np.arange(self.count) if rows is None else rows for rows, _ in cells])
            order = None if np.all(every[1:] > every[:-1]) else np.argsort(every, kind="stable")
            joined[key] = None if len(every) == self.count else every if order is None else every[order], order
        rows, order = joined[key]
        values = np.concatenate([v for _, v in cells])
        return rows, values if order is None else values[order]
