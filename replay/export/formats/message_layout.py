"""Messages of one constant layout as NumPy rows, and their order in a recording."""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Dialect = Literal["cdr", "ros1"]


class Layout:
    """Byte template of a message with varying fields; CDR aligns every field to its size, ROS 1 none.

    Parameters
    ----------
    dialect : str
        ``cdr`` (little-endian, with encapsulation header) or ``ros1``.
    """

    def __init__(self, dialect: Dialect) -> None:
        self._aligned = dialect == "cdr"
        self._bytes = bytearray(b"\x00\x01\x00\x00" if self._aligned else b"")
        self._names: list[str] = []
        self._formats: list[tuple[str, tuple[int, ...]]] = []
        self._offsets: list[int] = []

    def _align(self, size: int) -> None:
        if self._aligned:
            self._bytes += bytes(-(len(self._bytes) - 4) % size)

    def constant(self, code: str, *values: float) -> None:
        """Append fixed numbers; `code` as in `struct`."""
        for value in values:
            self._align(struct.calcsize(code))
            self._bytes += struct.pack("<" + code, value)

    def text(self, value: str) -> None:
        """Append a fixed string; in CDR it ends in NUL, which its length counts."""
        data = value.encode() + (b"\0" if self._aligned else b"")
        self.constant("I", len(data))
        self._bytes += data

    def varying(self, name: str, code: str, *shape: int) -> None:
        """Append a number, or an array of fixed shape, that differs from message to message."""
        dtype = np.dtype("<" + code)
        self._align(dtype.itemsize)
        self._names.append(name)
        self._formats.append((dtype.str, shape))
        self._offsets.append(len(self._bytes))
        self._bytes += bytes(dtype.itemsize * int(np.prod(shape)))

    def doubles(self, name: str | None, count: int = 0) -> None:
        """Append a sequence of doubles: `count` varying ones under a name, or none."""
        self.constant("I", count if name else 0)
        if name and count:
            self.varying(name, "f8", count)

    @property
    def template(self) -> NDArray[np.uint8]:
        """Bytes of one message, varying fields zero; shape (size,)."""
        return np.frombuffer(bytes(self._bytes), np.uint8)

    @property
    def dtype(self) -> np.dtype[np.void]:
        """Structured type of the varying fields."""
        return np.dtype(
            {
                "names": self._names,
                "formats": self._formats,
                "offsets": self._offsets,
                "itemsize": len(self._bytes),
            }
        )


@dataclass(frozen=True)
class TopicBatch:
    """All messages of one topic that share a layout.

    Attributes
    ----------
    topic, type_name : str
        ``/joint_states``, ``sensor_msgs/msg/JointState``.
    layout : Layout
        Layout of one message.
    fields : Mapping[str, NDArray]
        Values of the varying fields, each of shape (n,) or (n, k).
    log_stamps : NDArray[np.int64], shape (n,)
        When the recorder received each message [ns since 1970], not decreasing.
    """

    topic: str
    type_name: str
    layout: Layout
    fields: Mapping[str, NDArray[np.generic]]
    log_stamps: NDArray[np.int64]

    @property
    def size(self) -> int:
        """Bytes of one message."""
        return self.layout.template.size

    def encode(self, start: int, stop: int) -> NDArray[np.uint8]:
        """Bytes of messages start…stop, shape (stop − start, size)."""
        octets = np.tile(self.layout.template, (stop - start, 1))
        rows = octets.view(self.layout.dtype)[:, 0]
        for name, values in self.fields.items():
            rows[name] = values[start:stop]
        return octets


@dataclass(frozen=True)
class Piece:
    """Consecutive messages of one batch within a chunk.

    Attributes
    ----------
    batch, start, stop : int
        Place in the list of batches; messages start…stop of it.
    offsets : NDArray[np.int64], shape (stop − start,)
        Byte in the chunk at which each message's record begins.
    """

    batch: int
    start: int
    stop: int
    offsets: NDArray[np.int64]


@dataclass(frozen=True)
class ChunkPlan:
    """Which messages one chunk holds.

    Attributes
    ----------
    size : int
        Bytes of all records.
    start_ns, stop_ns : int
        First and last log stamp.
    pieces : tuple[Piece, ...]
        One per batch that takes part.
    """

    size: int
    start_ns: int
    stop_ns: int
    pieces: tuple[Piece, ...]


def plan_chunks(batches: Sequence[TopicBatch], overhead: int, chunk_size: int) -> Iterator[ChunkPlan]:
    """Order all messages by log stamp and cut them into chunks.

    Parameters
    ----------
    batches : Sequence[TopicBatch]
        Messages.
    overhead : int
        Bytes of a record before its message.
    chunk_size : int
        Bytes after which a chunk ends.
    """
    counts = [b.log_stamps.size for b in batches]
    stamps = np.concatenate([b.log_stamps for b in batches])
    owner = np.repeat(np.arange(len(batches)), counts)
    order = np.argsort(stamps, kind="stable")
    stamps, owner = stamps[order], owner[order]
    ends = np.cumsum(np.array([b.size + overhead for b in batches])[owner])
    total = int(ends[-1]) if ends.size else 0
    cuts = np.unique(np.searchsorted(ends, np.arange(0, total + chunk_size, chunk_size)))
    cuts[-1] = ends.size
    done = np.zeros(len(batches), np.int64)
    for low, high in zip(cuts[:-1].tolist(), cuts[1:].tolist(), strict=True):
        base = int(ends[low - 1]) if low else 0
        begins = np.concatenate([[base], ends[low : high - 1]]) - base
        pieces = []
        for i in range(len(batches)):
            mine = np.flatnonzero(owner[low:high] == i)
            if mine.size:
                start = int(done[i])
                done[i] += mine.size
                pieces.append(Piece(i, start, start + mine.size, begins[mine]))
        yield ChunkPlan(int(ends[high - 1]) - base, int(stamps[low]), int(stamps[high - 1]), tuple(pieces))


def place_rows(chunk: NDArray[np.uint8], offsets: NDArray[np.int64], rows: NDArray[np.uint8]) -> None:
    """Copy rows of equal length into a chunk, each to its offset.

    `chunk` of shape (bytes,), `offsets` of shape (k,), `rows` of shape (k, length).
    """
    windows = np.lib.stride_tricks.sliding_window_view(chunk, rows.shape[1], writeable=True)
    windows[offsets] = rows
