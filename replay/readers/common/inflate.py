"""Decompression with a cap on what comes out, whatever the file declares."""

from __future__ import annotations

import cramjam
import numpy as np
from numpy.typing import NDArray

MAX_CHUNK = 512 << 20
_FREE_CHUNK, _CHUNK_TIMES = 128 << 20, 4
_FREE_BYTES, _MOST_TIMES, _SLOWER = 4 << 30, 4096, {"bz2": 32}
_COMMON_WINDOW, _MAX_WINDOW = 1 << 27, 1 << 28


class InflateError(Exception):
    """Compressed bytes cannot be expanded; the text says why."""


def most_of_one(file_bytes: int) -> int:
    """Most bytes that one chunk of a file of this size may expand to: recorders' chunks are a few MB at most."""
    return min(MAX_CHUNK, max(_FREE_CHUNK, _CHUNK_TIMES * file_bytes))


class Expansion:
    """What the chunks of one file may expand to together, so that no small file takes hours; slow codecs count more.

    Parameters
    ----------
    file_bytes : int
        Size of the file.
    """

    def __init__(self, file_bytes: int) -> None:
        self._left = _FREE_BYTES + _MOST_TIMES * file_bytes
        self.why = f"the chunks before it expand to more than {_MOST_TIMES} times the file"

    def allows(self, compression: str, size: int) -> bool:
        """Take a chunk into account; whether it may be expanded."""
        self._left -= min(size, MAX_CHUNK) * _SLOWER.get(compression, 1)
        return self._left >= 0


class Inflater:
    """Expands chunks one after another into one buffer: fresh memory for each would cost more than decompression.

    Parameters
    ----------
    file_bytes : int or None
        Size of the file that holds the chunks, which bounds what one of them may expand to; None: `MAX_CHUNK` does.
    """

    def __init__(self, file_bytes: int | None = None) -> None:
        self.most = MAX_CHUNK if file_bytes is None else most_of_one(file_bytes)
        self._room: NDArray[np.uint8] = np.empty(0, np.uint8)

    def expand(self, compression: str, data: NDArray[np.uint8], size: int) -> NDArray[np.uint8]:
        """Expand a chunk to exactly its declared size.

        Parameters
        ----------
        compression : str
            Empty or ``none``, ``lz4``, ``zstd`` or ``bz2``.
        data : NDArray[np.uint8], shape (b,)
            Compressed bytes.
        size : int
            Declared size [bytes].

        Returns
        -------
        NDArray[np.uint8], shape (size,)
            Valid until the next call; nothing may keep a view of it longer. Uncompressed data are returned as they are.

        Raises
        ------
        InflateError
            Where the declared size is beyond `most`, the compression unknown, the bytes damaged or of another
            size.
        """
        data = data.view(np.ndarray)
        if compression in ("", "none"):
            if len(data) != size:
                raise InflateError(f"it holds {len(data)} bytes, not {size}")
            return data
        if not 0 <= size <= self.most:
            raise InflateError(f"it declares {size} bytes; at most {self.most} are expanded of a file of this size")
        if compression not in ("lz4", "zstd", "bz2"):
            raise InflateError(f"its compression {compression[:20]!r} is not known; expected lz4, zstd, bz2 or none")
        if not size and not len(data):
            return data
        try:
            if len(self._room) < size:
                self._room = np.empty(size, np.uint8)
            room = self._room[:size]
            count = _expand(compression, data, room)
        except MemoryError as error:
            raise InflateError(f"its {size} bytes find no room in memory") from error
        if count != size:
            raise InflateError(f"it expands to {count} bytes, not {size}")
        return room


def _expand(compression: str, data: NDArray[np.uint8], room: NDArray[np.uint8]) -> int:
    """Expand into `room` and return how many bytes came out."""
    codec = {"lz4": cramjam.lz4, "zstd": cramjam.zstd, "bz2": cramjam.bzip2}[compression]
    try:
        return int(codec.decompress_into(data, room))
    except cramjam.DecompressionError as error:
        if "whole buffer" in str(error):
            raise InflateError(f"it expands to more than {len(room)} bytes") from error
        if compression == "zstd" and (count := _expand_wide(data, room)) is not None:
            return count
        raise InflateError(f"its {compression} data are damaged ({error})") from error


def _expand_wide(data: NDArray[np.uint8], room: NDArray[np.uint8]) -> int | None:
    """Expand zstd data of a window beyond the library's usual limit; None where that is not why they failed."""
    import zstandard

    raw, count = data.tobytes(), 0
    try:
        if not _COMMON_WINDOW < zstandard.get_frame_parameters(raw).window_size <= _MAX_WINDOW:
            return None
        window = zstandard.ZstdDecompressor(max_window_size=_MAX_WINDOW)
        with window.stream_reader(raw, read_across_frames=True) as stream:
            while count < len(room) and (got := stream.readinto(room[count:].data)):
                count += got
            if count == len(room) and stream.read(1):
                raise InflateError(f"it expands to more than {len(room)} bytes")
    except (zstandard.ZstdError, ValueError) as error:
        raise InflateError(f"its zstd data are damaged ({error})") from error
    return count


def inflate(compression: str, data: bytes, size: int) -> bytes:
    """Expand a chunk into bytes of its own; see `Inflater.expand`."""
    return Inflater().expand(compression, np.frombuffer(data, np.uint8), size).tobytes()
