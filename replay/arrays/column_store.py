"""Columns that outgrow memory: gathered block by block, kept in an unnamed temporary file once they are long.

A mission of hours has more samples than memory has room. Whoever reads one makes a `ColumnStore`, which the mission's
log, signals and timeline carry with them. A column of the store takes its blocks one after another; it ends as a plain
array while all long ones of the store together are smaller than its `room`, else as a map of a temporary file, which the
system may drop from memory and load again at will. The file has no name from the start, so that it vanishes with the
column, and with the process however that ends. Set TMPDIR to a folder on a disk with room (not on a memory file system).
"""

from __future__ import annotations

import math
import mmap
import os
import tempfile
import threading
import weakref
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import IO, Any, TypeVar

import numpy as np
from numpy.typing import DTypeLike, NDArray

from replay.arrays.blocks import BLOCK, blocks, release, unload
from replay.arrays.freed_memory import give_back
from replay.errors import LogError

State = TypeVar("State")


@dataclass(eq=False)
class ColumnStore:
    """Memory of the columns of one mission, and work on them block by block.

    Attributes
    ----------
    block : int
        Rows per block.
    always : int
        Columns up to this size stay in memory [bytes].
    room : int
        What all longer columns together may take in memory [bytes].
    flush : int
        What a column that goes to a file gathers before it is written [bytes].
    used : int
        What the longer columns take in memory now [bytes].
    """

    block: int = BLOCK
    always: int = 8 << 20
    room: int = 128 << 20
    flush: int = 4 << 20
    used: int = field(default=0, init=False)
    _maps: weakref.WeakSet[mmap.mmap] = field(default_factory=weakref.WeakSet, init=False, repr=False)
    _mapping: threading.Lock = field(
        default_factory=threading.Lock, init=False, repr=False
    )  # families make columns at once
    _ones: dict[int, NDArray[np.float64]] = field(default_factory=dict, init=False, repr=False)

    def column(self, dtype: DTypeLike, width: tuple[int, ...] = (), rows: int | None = None) -> Column:
        """Return a growing column; see `Column`."""
        return Column(self, dtype, width, rows)

    def blocks(self, size: int, multiple: int = 1) -> Iterator[slice]:
        """Cut ``range(size)`` into slices of about `block` rows; all but the last hold a multiple of `multiple`."""
        return blocks(size, multiple, self.block)

    def map(self, function: Callable[..., NDArray[Any]], *columns: NDArray[Any]) -> NDArray[Any]:
        """Apply a function of whole rows, one block of rows after another, so that only blocks of it are in memory.

        Parameters
        ----------
        function : Callable
            Takes as many arrays as are given, each of shape (m, …), and returns one of m rows; a row of the result may
            depend on the same row of the arguments alone.
        *columns : NDArray
            Of n rows each.

        Returns
        -------
        NDArray, n rows
            In a temporary file where long.
        """
        if len(columns[0]) <= self.block:
            return function(*columns)
        (out,), _ = self.scan(lambda _, *parts: ((np.asarray(function(*parts)),), None), None, *columns)
        return out

    def scan(
        self,
        kernel: Callable[..., tuple[tuple[NDArray[Any], ...], State]],
        state: State,
        *columns: NDArray[Any],
        multiple: int = 1,
    ) -> tuple[tuple[NDArray[Any], ...], State]:
        """Run a recursion over the rows, one block of rows after another, its state carried from block to block.

        Parameters
        ----------
        kernel : Callable
            Takes the state and as many arrays as are given, each of shape (m, …); returns arrays of m rows each, and the
            state for the next block.
        state : State
            Before the first row.
        *columns : NDArray
            Of n rows each.
        multiple : int
            All blocks but the last hold a multiple of so many rows.

        Returns
        -------
        tuple[tuple[NDArray, ...], State]
            What the kernel returned, of n rows each, in temporary files where long; and its state after the last row.
        """
        size = len(columns[0])
        out: list[Column] = []
        for part in self.blocks(size, multiple) if size else (slice(0, 0),):
            rows, state = kernel(state, *(column[part] for column in columns))
            if part.stop == size and not out:
                return rows, state
            out = out or [self.column(x.dtype, x.shape[1:], size) for x in rows]
            for column, values in zip(out, rows, strict=True):
                column.append(values)
            release(*columns)
        return tuple(column.finish() for column in out), state

    def keep(self, values: NDArray[Any]) -> NDArray[Any]:
        """Return the same numbers, in a temporary file where they are long; the argument should be let go of.

        Of any shape (n, …), which stays.
        """
        return self._counted(values) if self._has_room(values.nbytes) else self.map(np.copy, values)

    def beside(self, columns: Sequence[NDArray[Any]]) -> NDArray[Any]:
        """Columns of n rows side by side, shape (n, columns)."""
        return self.map(lambda *parts: np.stack(parts, axis=1), *columns)

    def zeros(self, shape: tuple[int, ...], dtype: DTypeLike) -> NDArray[Any]:
        """Zeros to be filled in by a compiled scan; in a temporary file where they are many.

        Of the asked shape.

        Raises
        ------
        LogError
            Where the temporary folder has no room left.
        """
        kind = np.dtype(dtype)
        size = kind.itemsize * math.prod(shape)
        if self._has_room(size):
            return self._counted(np.zeros(shape, kind))
        try:
            with tempfile.TemporaryFile(prefix="mfhca-") as file:
                if hasattr(os, "posix_fallocate"):  # a map of a file with holes would fault where the disk is full
                    os.posix_fallocate(file.fileno(), 0, size)
                else:
                    file.truncate(size)
                return self._mapped(file, size, kind).reshape(shape)
        except OSError as error:
            raise _no_room(error) from error

    def ones(self, size: int) -> NDArray[np.float64]:
        """Ones, shape (size,): one column for all that ask, who must not change it."""
        if size not in self._ones:
            self._ones[size] = self.keep(np.ones(size))
        return self._ones[size]

    def release(self) -> None:
        """Let go of the memory of all columns in temporary files until they are read again."""
        with self._mapping:
            maps = list(self._maps)
        for mapped in maps:
            unload(mapped)

    def end_stage(self) -> None:
        """Let go of all that nobody needs now: `release`, and of a long mission what was freed between arrays that are still in use."""
        self.release()
        if len(self._maps):
            give_back()

    def _has_room(self, size: int) -> bool:
        """Whether a column of `size` bytes may stay in memory."""
        return size <= self.always or self.used + size <= self.room

    def _counted(self, array: NDArray[Any]) -> NDArray[Any]:
        """The same array, counted for as long as it lives."""
        if array.nbytes > self.always:
            self.used += array.nbytes
            weakref.finalize(array, self._forget, array.nbytes)
        return array

    def _forget(self, size: int) -> None:
        self.used -= size

    def _mapped(self, file: IO[bytes], size: int, dtype: np.dtype[Any]) -> NDArray[Any]:
        """Numbers of a temporary file, shape (n,); `size` 0 for all of it."""
        mapped = mmap.mmap(file.fileno(), size, access=mmap.ACCESS_WRITE)
        with self._mapping:
            self._maps.add(mapped)
        return np.frombuffer(mapped, dtype)


class Column:
    """One growing column.

    Parameters
    ----------
    store : ColumnStore
        Where its memory is counted.
    dtype : DTypeLike
        Number type of the column; blocks are converted to it.
    width : tuple[int, ...]
        Shape of one row; empty for plain numbers.
    rows : int or None
        How many there will be, where that is known: the column is then filled in place.
    """

    def __init__(
        self, store: ColumnStore, dtype: DTypeLike, width: tuple[int, ...] = (), rows: int | None = None
    ) -> None:
        self.store = store
        self.dtype: np.dtype[Any] = np.dtype(dtype)
        self.size = 0
        self._whole: NDArray[Any] | None = None
        if rows is not None and store._has_room(rows * math.prod(width) * self.dtype.itemsize):
            self._whole = store._counted(np.empty((rows, *width), self.dtype))
        self._width = width
        self._parts: list[NDArray[Any]] = []
        self._held = 0
        self._file: IO[bytes] | None = None

    def append(self, values: NDArray[Any]) -> None:
        """Add a block, shape (m, *width); it is kept as it is, so the caller must not change it afterwards.

        Raises
        ------
        LogError
            Where the temporary folder has no room left.
        """
        at, self.size = self.size, self.size + len(values)
        if self._whole is not None:
            self._whole[at : self.size] = values
            return
        block = np.ascontiguousarray(values, self.dtype)
        self._parts.append(block)
        self._held += block.nbytes
        if self._held > self.store.flush if self._file is not None else not self.store._has_room(self._held):
            self._flush()

    def _flush(self) -> None:
        try:
            if self._file is None:
                _allow_many_files()
                self._file = tempfile.TemporaryFile(prefix="mfhca-")  # noqa: SIM115
            for part in self._parts:
                self._file.write(part.data.cast("B") if part.size else b"")
            self._file.flush()
        except OSError as error:
            raise _no_room(error) from error
        self._parts, self._held = [], 0

    def finish(self) -> NDArray[Any]:
        """Return all blocks as one array, shape (n, *width); the column must not be used afterwards."""
        if self._whole is not None:
            return self._whole if self.size == len(self._whole) else self._whole[: self.size]
        if self._file is None:
            parts, self._parts = self._parts, []
            if len(parts) == 1:
                return parts[0]
            return self.store._counted(np.concatenate(parts)) if parts else np.empty((0, *self._width), self.dtype)
        self._flush()
        with self._file as file:
            return self.store._mapped(file, 0, self.dtype).reshape(-1, *self._width)


@cache
def _allow_many_files() -> None:
    """Let the process hold a file per column, as far as the system allows."""
    try:
        import resource
    except ImportError:  # Windows has no such limit
        return
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    most = 1 << 16 if hard == resource.RLIM_INFINITY else min(hard, 1 << 16)
    if soft != resource.RLIM_INFINITY and soft < most:
        resource.setrlimit(resource.RLIMIT_NOFILE, (most, hard))


def _no_room(error: OSError) -> LogError:
    return LogError(
        f"the temporary folder {tempfile.gettempdir()} cannot take the mission's columns: {error.strerror or error}; set "
        "TMPDIR to a folder with more room"
    )
