"""Columns that outgrow memory: gathered block by block, kept in an unnamed temporary file once they are long.

A mission of hours has more samples than memory has room. A `Column` takes its blocks one after another; it ends as a
plain array while all long ones together are smaller than `ROOM`, else as a map of a temporary file, which the system
may drop from memory and load again at will. The file has no name from the start, so that it vanishes with the process however that ends. Set TMPDIR
to a folder on a disk with room (not on a memory file system).
"""

from __future__ import annotations

import math
import mmap
import os
import tempfile
import weakref
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from typing import IO, Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from replay.errors import LogError

SPILL_BYTES = 16 << 20
FLUSH_BYTES = 4 << 20
ROOM = 512 << 20
BLOCK = 1 << 19
_MAPS: weakref.WeakSet[mmap.mmap] = weakref.WeakSet()


class _Memory:
    """Count of the long columns that stay in memory."""

    def __init__(self) -> None:
        self.used = 0

    def has_room(self, size: int) -> bool:
        """Whether a column of `size` bytes may stay in memory."""
        return size <= SPILL_BYTES or self.used + size <= ROOM

    def counted(self, array: NDArray[Any]) -> NDArray[Any]:
        """The same array, counted for as long as it lives."""
        if array.nbytes > SPILL_BYTES:
            self.used += array.nbytes
            weakref.finalize(array, self._forget, array.nbytes)
        return array

    def _forget(self, size: int) -> None:
        self.used -= size


_MEMORY = _Memory()


class Column:
    """One growing column.

    Parameters
    ----------
    dtype : DTypeLike
        Number type of the column; blocks are converted to it.
    width : tuple[int, ...]
        Shape of one row; empty for plain numbers.
    rows : int or None
        How many there will be, where that is known: the column is then filled in place.
    """

    def __init__(self, dtype: DTypeLike, width: tuple[int, ...] = (), rows: int | None = None) -> None:
        self.dtype: np.dtype[Any] = np.dtype(dtype)
        self.size = 0
        self._whole: NDArray[Any] | None = None
        if rows is not None and _MEMORY.has_room(rows * math.prod(width) * self.dtype.itemsize):
            self._whole = _MEMORY.counted(np.empty((rows, *width), self.dtype))
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
        if self._held > FLUSH_BYTES if self._file is not None else not _MEMORY.has_room(self._held):
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
            return _MEMORY.counted(np.concatenate(parts)) if parts else np.empty((0, *self._width), self.dtype)
        self._flush()
        with self._file as file:
            mapped = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_WRITE)
        _MAPS.add(mapped)
        return np.frombuffer(mapped, self.dtype).reshape(-1, *self._width)


def scratch(shape: tuple[int, ...], dtype: DTypeLike) -> NDArray[Any]:
    """Zeros to be filled in by a compiled scan; in a temporary file where they are many.

    Raises
    ------
    LogError
        Where the temporary folder has no room left.
    """
    kind = np.dtype(dtype)
    size = kind.itemsize * math.prod(shape)
    if _MEMORY.has_room(size):
        return _MEMORY.counted(np.zeros(shape, kind))
    try:
        with tempfile.TemporaryFile(prefix="mfhca-") as file:
            if hasattr(os, "posix_fallocate"):  # a map of a file with holes would fault where the disk is full
                os.posix_fallocate(file.fileno(), 0, size)
            else:
                file.truncate(size)
            mapped = mmap.mmap(file.fileno(), size, access=mmap.ACCESS_WRITE)
    except OSError as error:
        raise _no_room(error) from error
    _MAPS.add(mapped)
    return np.frombuffer(mapped, kind).reshape(shape)


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


def blocks(size: int, multiple: int = 1) -> Iterator[slice]:
    """Cut ``range(size)`` into slices of about `BLOCK` steps; all but the last are a multiple of `multiple` long."""
    step = max(BLOCK // multiple, 1) * multiple
    return (slice(at, min(at + step, size)) for at in range(0, size, step))


def in_blocks(function: Callable[..., NDArray[Any]], *arrays: NDArray[Any]) -> NDArray[Any]:
    """Apply a function of whole rows, one block of rows after another, so that only blocks of it are in memory.

    Parameters
    ----------
    function : Callable
        Takes as many arrays as are given, each of shape (m, …), and returns one of m rows; a row of the result may
        depend on the same row of the arguments alone.
    *arrays : NDArray
        Of n rows each.

    Returns
    -------
    NDArray, n rows
        Spilled where long.
    """
    size = len(arrays[0])
    if size <= BLOCK:
        return function(*arrays)
    column: Column | None = None
    for part in blocks(size):
        values = np.asarray(function(*(a[part] for a in arrays)))
        if column is None:
            column = Column(values.dtype, values.shape[1:], size)
        column.append(values)
        release(*arrays)
    assert column is not None
    return column.finish()


def keep(values: NDArray[Any]) -> NDArray[Any]:
    """The same numbers, spilled where they are long; the argument should be let go of."""
    if _MEMORY.has_room(values.nbytes):
        return _MEMORY.counted(values)
    return in_blocks(np.copy, values)


def beside(columns: Sequence[NDArray[Any]]) -> NDArray[Any]:
    """Columns of n rows side by side, shape (n, columns); spilled where long."""
    return in_blocks(lambda *parts: np.stack(parts, axis=1), *columns)


def release(*arrays: NDArray[Any] | None) -> None:
    """Let go of the memory of spilled columns until they are read again; plain arrays stay as they are."""
    for array in arrays:
        base: Any = array
        while isinstance(base, np.ndarray):
            base = base.base
        if isinstance(base, memoryview):
            base = base.obj
        if isinstance(base, mmap.mmap):
            _let_go(base)


def release_all() -> None:
    """Let go of the memory of all spilled columns: for the end of a stage."""
    for mapped in list(_MAPS):
        _let_go(mapped)


def _let_go(mapped: mmap.mmap) -> None:
    if hasattr(mapped, "madvise"):  # not on Windows
        mapped.madvise(mmap.MADV_DONTNEED)
