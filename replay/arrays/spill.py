"""Names of `replay.arrays.column_store` for code that has no store of its own yet."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

from numpy.typing import DTypeLike, NDArray

from replay.arrays import column_store
from replay.arrays.blocks import release
from replay.arrays.column_store import ColumnStore

__all__ = ["STORE", "Column", "beside", "blocks", "in_blocks", "keep", "release", "scratch"]

STORE = ColumnStore()


class Column(column_store.Column):
    """As `ColumnStore.column`."""

    def __init__(self, dtype: DTypeLike, width: tuple[int, ...] = (), rows: int | None = None) -> None:
        super().__init__(STORE, dtype, width, rows)


def blocks(size: int, multiple: int = 1) -> Iterator[slice]:
    """As `ColumnStore.blocks`."""
    return STORE.blocks(size, multiple)


def in_blocks(function: Callable[..., NDArray[Any]], *arrays: NDArray[Any]) -> NDArray[Any]:
    """As `ColumnStore.map`."""
    return STORE.map(function, *arrays)


def keep(values: NDArray[Any]) -> NDArray[Any]:
    """As `ColumnStore.keep`."""
    return STORE.keep(values)


def beside(columns: Sequence[NDArray[Any]]) -> NDArray[Any]:
    """As `ColumnStore.beside`."""
    return STORE.beside(columns)


def scratch(shape: tuple[int, ...], dtype: DTypeLike) -> NDArray[Any]:
    """As `ColumnStore.zeros`."""
    return STORE.zeros(shape, dtype)
