"""Columns that outgrow memory: gathered block by block, kept in an unnamed temporary file once they are long.

A mission of hours has more samples than memory has room. A `Column` takes its blocks one after another; a short one
ends as a plain array, a long one as a read-only map of a temporary file, which the system may drop from memory and load
again at will. The file has no name from the start, so that it vanishes with the process however that ends. Set TMPDIR
to a folder on a disk with room (not on a memory file system).
"""

from __future__ import annotations

import mmap
import tempfile
from collections.abc import Iterator
from typing import IO, Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from replay.errors import LogError

SPILL_BYTES = 32 << 20
BLOCK = 1 << 20


class Column:
    """One growing column.

    Parameters
    ----------
    dtype : DTypeLike
        Number type of the column; blocks are converted to it.
    spill_bytes : int
        Size beyond which it moves to a temporary file [bytes].
    """

    def __init__(self, dtype: DTypeLike, spill_bytes: int = SPILL_BYTES) -> None:
        self.dtype: np.dtype[Any] = np.dtype(dtype)
        self.size = 0
        self._limit = spill_bytes
        self._parts: list[NDArray[Any]] = []
        self._held = 0
        self._file: IO[bytes] | None = None

    def append(self, values: NDArray[Any]) -> None:
        """Add a block, shape (m,); it is kept as it is, so the caller must not change it afterwards.

        Raises
        ------
        LogError
            Where the temporary folder has no room left.
        """
        block = np.ascontiguousarray(values, self.dtype)
        self.size += len(block)
        self._parts.append(block)
        self._held += block.nbytes
        if self._held > (self._limit if self._file is None else BLOCK):
            self._flush()

    def _flush(self) -> None:
        try:
            if self._file is None:
                self._file = tempfile.TemporaryFile(prefix="mfhca-")  # noqa: SIM115
            for part in self._parts:
                self._file.write(part.view(np.uint8).data)
            self._file.flush()
        except OSError as error:
            raise LogError(
                f"the temporary folder {tempfile.gettempdir()} cannot take the mission's columns: "
                f"{error.strerror or error}; set TMPDIR to a folder with more room"
            ) from error
        self._parts, self._held = [], 0

    def finish(self) -> NDArray[Any]:
        """Return all blocks as one array, shape (n,); the column must not be used afterwards."""
        if self._file is None:
            parts, self._parts = self._parts, []
            if len(parts) == 1:
                return parts[0]
            return np.concatenate(parts) if parts else np.empty(0, self.dtype)
        self._flush()
        with self._file as file:
            mapped = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
        return np.frombuffer(mapped, self.dtype)


def blocks(size: int, step: int = BLOCK) -> Iterator[slice]:
    """Cut ``range(size)`` into slices of at most `step`."""
    return (slice(at, min(at + step, size)) for at in range(0, size, step))


def release(*arrays: NDArray[Any] | None) -> None:
    """Let go of the memory of spilled columns until they are read again; plain arrays stay as they are."""
    for array in arrays:
        base: Any = array
        while isinstance(base, np.ndarray):
            base = base.base
        if isinstance(base, memoryview):
            base = base.obj
        if isinstance(base, mmap.mmap) and hasattr(base, "madvise"):
            base.madvise(mmap.MADV_DONTNEED)
