"""Decompression with a cap on what comes out, whatever the file declares."""

from __future__ import annotations

import bz2

import lz4.frame
import numpy as np
import zstandard
from numpy.typing import NDArray

MAX_CHUNK = 512 << 20


class InflateError(Exception):
    """Compressed bytes cannot be expanded; the text says why."""


class Inflater:
    """Expands chunks one after another."""

    def expand(self, compression: str, data: NDArray[np.uint8], size: int) -> NDArray[np.uint8]:
        """Expand a chunk to exactly its declared size; see `inflate`.

        The result is valid until the next call; nothing may keep a view of it longer.
        """
        return np.frombuffer(inflate(compression, data.tobytes(), size), np.uint8)


def inflate(compression: str, data: bytes, size: int) -> bytes:
    """Expand a chunk to exactly its declared size.

    Parameters
    ----------
    compression : str
        Empty or ``none``, ``lz4``, ``zstd`` or ``bz2``.
    data : bytes
        Compressed bytes.
    size : int
        Declared size [bytes].

    Raises
    ------
    InflateError
        Where the declared size is beyond `MAX_CHUNK`, the compression unknown or the bytes damaged.
    """
    if size > MAX_CHUNK:
        raise InflateError(f"it declares {size} bytes; at most {MAX_CHUNK} are expanded")
    if compression in ("", "none"):
        out = data
    elif compression not in ("lz4", "zstd", "bz2"):
        raise InflateError(f"its compression {compression[:20]!r} is not known; expected lz4, zstd, bz2 or none")
    else:
        try:
            out = _expand(compression, data, size)
        except (RuntimeError, ValueError, OSError, EOFError, MemoryError, zstandard.ZstdError) as error:
            raise InflateError(f"its {compression} data are damaged ({type(error).__name__})") from error
    if len(out) != size:
        raise InflateError(f"it expands to {'more than ' if len(out) > size else ''}{len(out)} bytes, not {size}")
    return out


def _expand(compression: str, data: bytes, size: int) -> bytes:
    if compression == "lz4":
        out: bytes = lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=size + 1)
        return out
    if compression == "bz2":
        return bz2.BZ2Decompressor().decompress(data, max_length=size + 1)
    window = zstandard.ZstdDecompressor(max_window_size=1 << 28)
    with window.stream_reader(data, read_across_frames=True) as stream:
        return stream.read(size + 1)
