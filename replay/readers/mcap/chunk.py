"""Opening one chunk of an MCAP file, whole or as much of it as can be believed.

What is believed. A chunk whose checksum is wrong is left out as a whole: one wrong value in it would be taken for a
fault of the machine, and nothing tells which of its messages are right. A chunk that the end of the file cuts off, or
that ends in nothing but zeros as after a power failure, lost its end but its beginning stands as it was written: the
messages that its decompressed beginning completes are taken, and said to be unverified because the checksum covers
the whole chunk. A checksum that differs in a single bit was itself damaged: by chance that happens once in 10⁸. A chunk without a checksum cannot be verified in any case: what can be decompressed is taken up to
the damage. Nothing is ever taken from behind a place at which decompression failed.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from io import BytesIO
from typing import NamedTuple

import lz4.frame
import numpy as np
import zstandard
from numpy.typing import NDArray

from replay.readers.common.inflate import InflateError
from replay.readers.mcap import format as fmt
from replay.readers.mcap import scan
from replay.readers.mcap.file import McapFile

_FIXED = 49
_PIECE = 1 << 16
_ZEROS = 512
_FRAME_HEAD = 32
_COMPRESSIONS = ("", "none", "lz4", "zstd", "bz2")
_FRAMES = {b"\x28\xb5\x2f\xfd": "zstd", b"\x04\x22\x4d\x18": "lz4"}


@dataclass(frozen=True)
class Chunk:
    """An opened chunk.

    Attributes
    ----------
    data : NDArray[np.uint8], shape (b,)
        Its records, valid until the next chunk is opened.
    runs : list[tuple[int, int]]
        Stretches of complete records.
    verified : bool
        Whether its checksum is right.
    """

    data: NDArray[np.uint8]
    runs: list[tuple[int, int]]
    verified: bool


class _Head(NamedTuple):
    size: int
    crc: int
    compression: str
    body: int
    packed: int


def _head(data: NDArray[np.uint8], start: int, end: int, cut: bool) -> _Head | None:
    """Read a chunk's head; where its lengths disagree, that of the record and the frame's first bytes tell the rest."""
    raw = data[start + 9 : min(end, start + 9 + 64)].tobytes()
    if len(raw) < _FIXED - 9:
        return None
    size, crc, stated = (int.from_bytes(raw[a:b], "little") for a, b in ((16, 24), (24, 28), (28, 32)))
    fits: list[tuple[int, int]] = []
    for text in (stated, 0, 3, 4):
        if text > 16 or 40 + text > len(raw):
            continue
        packed = int.from_bytes(raw[32 + text : 40 + text], "little")
        left = end - (start + _FIXED + text)
        if packed > left if cut else left - 64 <= packed <= left:
            fits.append((text, min(packed, left)))
    if not fits and not cut:
        fits = [(n, end - start - _FIXED - n) for n in (4, 3) if _frame(data, start + _FIXED + n)]
        fits += [(0, end - start - _FIXED)] if stated == 0 else []
    if not fits:
        return None
    text, packed = fits[0]
    body = start + _FIXED + text
    name = raw[32 : 32 + text].decode("ascii", "replace")
    return _Head(size, crc, name if name in _COMPRESSIONS else _frame(data, body) or name, body, packed)


def _frame(data: NDArray[np.uint8], body: int) -> str:
    """Compression whose frames begin as these bytes do, or nothing."""
    return _FRAMES.get(data[body : body + 4].tobytes(), "")


def open_chunk(file: McapFile, row: int) -> Chunk | None:
    """Open a chunk by its row in `file.chunks`; None where nothing in it can be believed (which is reported)."""
    start, end = (int(n) for n in file.chunks[row, :2])
    cut = start == file.cut
    where = f"the chunk at byte {start}"
    head = _head(file.data, start, end, cut) if file.data[start : start + 9].size == 9 else None
    if head is None:
        file.lost("chunk", f"{where} was left out: its head is damaged{file.held(row)}")
        return None
    packed = file.data[head.body : head.body + head.packed]
    if cut and head.size <= file.inflater.most:
        return _beginning(file, where, head, packed, "is cut off by the end of the file")
    if not file.expansion.allows(head.compression, head.size):
        file.lost("size", f"{where} was left out: {file.expansion.why}")
        return None
    reason = ""
    for size in _sizes(file, start, head, packed):
        try:
            data = file.inflater.expand(head.compression, packed, size)
        except InflateError as error:
            reason = reason or str(error)
            continue
        if size != head.size:
            file.lost("size", f"{where} states {head.size} bytes, but holds {size}")
        if not head.crc:
            file.bare = file.bare or bool(len(data))
            return Chunk(data, _runs(file, where, data), False)
        differs = zlib.crc32(data.data) ^ head.crc
        if differs.bit_count() == 1:
            file.lost("checksum", f"one bit of the checksum of {where} was wrong, its content is not")
        if differs.bit_count() <= 1:
            return Chunk(data, [(0, len(data))], True)
        reason = "its checksum differs"
    return _in_part(file, row, where, head, packed, reason)


def _sizes(file: McapFile, start: int, head: _Head, packed: NDArray[np.uint8]) -> Iterator[int]:
    """Full sizes that a chunk may have, the likeliest first: as its head, the summary and its frame say."""
    yield head.size
    others, summary = [], file.summary
    if summary is not None and len(summary.chunks):
        row = int(np.searchsorted(summary.chunks[:, 2], start))
        if row < len(summary.chunks) and summary.chunks[row, 2] == start:
            others.append(int(summary.chunks[row, 6]))
    first = packed[:_FRAME_HEAD].tobytes()
    try:
        if head.compression == "zstd":
            others.append(int(zstandard.get_frame_parameters(first).content_size))
        elif head.compression == "lz4":
            others.append(int(lz4.frame.get_frame_info(first)["content_size"]))
        else:
            others.append(len(packed))
    except (zstandard.ZstdError, RuntimeError, ValueError):
        pass
    yield from (s for s in dict.fromkeys(others) if 0 < s <= file.inflater.most and s != head.size)


def take_names(file: McapFile, row: int, chunk: Chunk) -> None:
    """Take the schemas and channels of a chunk."""
    place = f"in the chunk at byte {file.chunks[row, 0]}"
    for run in chunk.runs:
        for op, body, size in file.scanner.census(chunk.data, *run).names.tolist():
            file.names.take(op, chunk.data[body : body + size].tobytes(), chunk.verified, place)


def name_channels(file: McapFile) -> bool:
    """Open chunks until every channel in the indexes has its name, for summaries that do not repeat the names.

    Returns
    -------
    bool
        Whether all are named: the summary or the indexes tell every channel.
    """
    for row in _first_rows(file):
        if not file.names.ready[file.indexes[file.indexes[:, 0] == row, 1]].all():
            _open_for_names(file, row)
    indexed = np.zeros(len(file.chunks), np.bool_)
    indexed[file.indexes[:, 0]] = True
    for row in np.flatnonzero(~indexed).tolist():
        if file.names.ready[file.names.named > 0].all():
            break
        _open_for_names(file, row)
    listed = file.summary is not None and any(op == fmt.CHANNEL for op, _, _ in file.summary.names)
    return listed or bool(indexed.all())


def _first_rows(file: McapFile) -> list[int]:
    """Rows of the chunks that hold the first messages of channels whose name or schema is not yet known."""
    late = file.indexes[file.names.ready[file.indexes[:, 1]] == 0]
    first = np.unique(late[:, 1], return_index=True)[1]
    return sorted(set(late[first, 0].tolist()))


def _open_for_names(file: McapFile, row: int) -> None:
    chunk = open_chunk(file, row)
    if chunk is not None:
        take_names(file, row, chunk)


def _in_part(file: McapFile, row: int, where: str, head: _Head, packed: NDArray[np.uint8], reason: str) -> Chunk | None:
    """Take the beginning of a damaged chunk where it can be believed."""
    if not head.crc and head.compression in ("lz4", "zstd") and head.size <= file.inflater.most:
        return _beginning(file, where, head, packed, f"is damaged ({reason})")
    if head.compression in ("lz4", "zstd") and len(packed) > _ZEROS and not packed[-_ZEROS:].any():
        kept = packed[: int(np.flatnonzero(packed)[-1]) + 1] if packed.any() else packed[:0]
        return _beginning(file, where, head, kept, f"ends in {len(packed) - len(kept)} zeros")
    file.lost("chunk", f"{where} was left out: {reason}{file.held(row)}")
    return None


def _beginning(file: McapFile, where: str, head: _Head, packed: NDArray[np.uint8], reason: str) -> Chunk:
    """Take the complete messages that the beginning of a chunk holds."""
    data = _expand_beginning(head.compression, packed, head.size)
    runs = _runs(file, where, data, cut=True)
    count = sum(int(file.scanner.census(data, *run).counts.sum()) for run in runs)
    file.bare = True
    file.lost("part", f"{where} {reason}; {count} messages that its first {len(data)} bytes hold were taken unverified")
    return Chunk(data, runs, False)


def _runs(file: McapFile, where: str, data: NDArray[np.uint8], cut: bool = False) -> list[tuple[int, int]]:
    """Stretches of complete records in bytes that no checksum covers."""
    rows = scan.walk(data, 0, len(data), file.names.named.copy(), scan.Tally(), inside=True).rows
    runs: list[tuple[int, int]] = []
    for op, start, stop, _ in rows.tolist():
        if op == fmt.MESSAGE:
            runs.append((start, stop))
        elif not (cut and stop == len(data)):
            file.lost("bytes", f"{where}: its bytes {start} to {stop} hold no message and were left out")
    return runs


def _expand_beginning(compression: str, packed: NDArray[np.uint8], size: int) -> NDArray[np.uint8]:
    """Expand as much as can be, at most `size` bytes, up to the end or the first damaged place."""
    raw = packed.tobytes()
    if compression not in ("lz4", "zstd"):
        return packed[:size] if compression in ("", "none") else packed[:0]
    parts, count = [], 0
    try:
        if compression == "zstd":
            stream = zstandard.ZstdDecompressor(max_window_size=1 << 28).stream_reader(BytesIO(raw))
            while count < size and (part := stream.read(min(_PIECE, size - count))):
                parts.append(part)
                count += len(part)
        else:
            frame = lz4.frame.LZ4FrameDecompressor()
            part = frame.decompress(raw, max_length=min(_PIECE, size))
            while part:
                parts.append(part)
                count += len(part)
                if frame.eof or count >= size:
                    break
                part = frame.decompress(b"", max_length=min(_PIECE, size - count))
    except (zstandard.ZstdError, RuntimeError, ValueError, EOFError, MemoryError):
        pass
    return np.frombuffer(b"".join(parts), np.uint8)
