"""Columns of a table while they are being read, and what their headers say."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from replay.arrays.blocks import blocks
from replay.arrays.column_store import Column, ColumnStore
from replay.log.raw_log import Window
from replay.readers.tables.row_kernel import MISSING, REAL


class CellColumn:
    """A growing column of 8-byte cells: integers first, doubles from the block on in which the parser met one."""

    def __init__(self, store: ColumnStore) -> None:
        self._store = store
        self._cells = store.column(np.int64)
        self._whole: int | None = None

    def append(self, cells: NDArray[np.int64], kind: int) -> None:
        """Add cells, shape (m,), of a kind of `row_kernel`; they are copied."""
        if kind == REAL and self._whole is None:
            self._whole = self._cells.size
        self._cells.append(np.array(cells))

    def finish(self) -> NDArray[Any]:
        """Return int64 where every cell is an integer, else float64 with NaN where cells are empty, shape (n,)."""
        cells = self._cells.finish()
        whole = len(cells) if self._whole is None else self._whole
        if whole == 0 and len(cells):
            return cells.view(np.float64)
        empty = any((cells[s] == MISSING).any() for s in blocks(whole))
        if whole == len(cells) and not empty:
            return cells
        reals = self._store.column(np.float64)
        for s in blocks(whole):
            part = cells[s]
            reals.append(np.where(part == MISSING, np.nan, part.astype(np.float64)))
        for s in blocks(len(cells) - whole):
            reals.append(cells[whole + s.start : whole + s.stop].view(np.float64))
        return reals.finish()

    def moments(self) -> NDArray[Any]:
        """Return the cells of dates as they are, shape (n,) [ns], `MISSING` where there is none."""
        return self._cells.finish()


class ArrayColumn:
    """A growing column of any number type but halves; blocks of another type than the first make it float64."""

    def __init__(self, store: ColumnStore) -> None:
        self._store = store
        self._parts: Column | None = None

    def append(self, values: NDArray[Any]) -> None:
        """Add values, shape (m,); halves, which hold no limit or sum that others work with, as float32."""
        if values.dtype == np.float16:
            values = values.astype(np.float32)
        if self._parts is None:
            self._parts = self._store.column(values.dtype)
        elif self._parts.dtype != values.dtype:
            before, common = self._parts.finish(), np.result_type(self._parts.dtype, values.dtype)
            self._parts = self._store.column(common)
            for s in blocks(len(before)):
                self._parts.append(before[s])
        self._parts.append(values)

    def finish(self) -> NDArray[Any]:
        """Return all blocks, shape (n,)."""
        return np.empty(0) if self._parts is None else self._parts.finish()


def pick(stamps: NDArray[np.int64], window: Window | None) -> NDArray[np.bool_]:
    """Return which stamps are there and lie in the window. Both of shape (n,); stamps in ns."""
    keep: NDArray[np.bool_] = stamps != MISSING
    if window is not None:
        keep &= (stamps >= window[0]) & (stamps < window[1])
    return keep


def compressed(values: NDArray[Any], keep: NDArray[np.bool_], store: ColumnStore) -> NDArray[Any]:
    """Return the kept values, as a column of the store; the same array where all are kept.

    From shape (n,) to (kept,).
    """
    if keep.all():
        return values
    if values.dtype == object:
        return values[keep]
    kept = store.column(values.dtype)
    for s in blocks(len(values)):
        kept.append(values[s][keep[s]])
    return kept.finish()


def unique_names(names: list[str]) -> tuple[list[str], list[str]]:
    """Stripped names, each once: a repeated one gets ``(2)``; and those that were repeated."""
    out: list[str] = []
    taken: set[str] = set()
    following: dict[str, Iterator[int]] = {}
    repeated: list[str] = []
    for i, raw in enumerate(names):
        base = name = raw.strip() or f"column {i + 1}"
        if name in taken:
            repeated.append(base)
            numbers = following.setdefault(base, iter(range(2, len(names) + 2)))
            while name in taken:
                name = f"{base} ({next(numbers)})"
        taken.add(name)
        out.append(name)
    return out, list(dict.fromkeys(repeated))


def unit_of(header: str) -> str | None:
    """Return the unit in a header like ``speed [rpm]`` or ``speed (rpm)``."""
    found = re.search(r"[\[(]([^\[\]()]{1,12})[\])]\s*$", header)
    if found is None:
        return None
    unit = found.group(1).strip()
    return None if not unit or unit.isdigit() else unit
