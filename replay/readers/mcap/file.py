"""An opened MCAP file: where its chunks, messages, names and indexes lie."""

from __future__ import annotations

import mmap
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from replay.errors import LogError
from replay.log.raw_log import AttachmentInfo
from replay.log.reading_notes import Report
from replay.readers.common.inflate import Expansion, Inflater
from replay.readers.mcap import format as fmt
from replay.readers.mcap import scan
from replay.readers.mcap.channels import Names
from replay.readers.mcap.records import Statistics
from replay.readers.mcap.summary import Summary

_FOOTER_SIZE = 29
_SAME_KIND = 8


@dataclass
class Losses:
    """What is lost of one file, each sentence once and of each kind the first few.

    Attributes
    ----------
    name : str
        Of the file.
    report : Report
        Where the sentences go.
    """

    name: str
    report: Report
    _said: Counter[str] = field(default_factory=Counter)
    _texts: set[str] = field(default_factory=set)

    def lost(self, kind: str, text: str) -> None:
        """Report a loss once; beyond a few of one kind they are only counted."""
        if text in self._texts:
            return
        self._texts.add(text)
        self._said[kind] += 1
        if self._said[kind] <= _SAME_KIND:
            self.report.lost(f"{self.name}: {text}")

    def say_rest(self) -> None:
        """Report how many losses were not said one by one."""
        for kind, count in self._said.items():
            if count > _SAME_KIND:
                self.report.lost(f"{self.name}: {count - _SAME_KIND} more losses of the same kind ({kind})")
        self._said.clear()
        self._texts.clear()


@dataclass
class McapFile:
    """One opened file.

    Attributes
    ----------
    path : Path
        The file.
    data : NDArray[np.uint8], shape (b,)
        Its bytes.
    chunks : NDArray[np.int64], shape (n, 4)
        Start, end, first and last stated stamp [ns] of each chunk, in the order of places.
    indexes : NDArray[np.int64], shape (m, 3)
        Row in `chunks`, channel and number of messages (−1: not known) of each message index.
    orphans : NDArray[np.int64], shape (k, 2)
        Channel and number of messages of message indexes whose chunk was not found.
    runs : list[tuple[int, int]]
        Stretches of messages outside chunks.
    cut : int
        Start of a chunk that the end of the file cuts off, else −1.
    walked : bool
        Whether the whole file was walked, not only the summary.
    data_end : tuple[int, int]
        Place of the record that ends the data, −1 where none was met, and the checksum it states.
    unknown : list[tuple[int, int, int]]
        Opcode, place and number of records of unknown type.
    strange : int
        Number of records of unknown type in the chunks read.
    bare : bool
        Whether messages were met that no checksum covers.
    read_whole, read_topics : bool, frozenset[str] or None
        Whether all of its time was read, and which topics (None: all).
    loose, found : Tally
        Messages outside chunks that the walk met; messages that reading met.
    """

    path: Path
    data: NDArray[np.uint8]
    report: Report
    names: Names = field(init=False)
    summary: Summary | None = None
    chunks: NDArray[np.int64] = field(default_factory=lambda: np.empty((0, 4), np.int64))
    indexes: NDArray[np.int64] = field(default_factory=lambda: np.empty((0, 3), np.int64))
    orphans: NDArray[np.int64] = field(default_factory=lambda: np.empty((0, 2), np.int64))
    runs: list[tuple[int, int]] = field(default_factory=list)
    cut: int = -1
    walked: bool = False
    data_end: tuple[int, int] = (-1, 0)
    metadata: dict[str, str] = field(default_factory=dict)
    metadata_count: int = 0
    attachments: list[AttachmentInfo] = field(default_factory=list)
    unknown: list[tuple[int, int, int]] = field(default_factory=list)
    strange: int = 0
    bare: bool = False
    read_whole: bool = False
    read_topics: frozenset[str] | None = None
    loose: scan.Tally = field(default_factory=scan.Tally)
    found: scan.Tally = field(default_factory=scan.Tally)
    inflater: Inflater = field(init=False)
    expansion: Expansion = field(init=False)
    scanner: scan.Scanner = field(default_factory=scan.Scanner)
    losses: Losses = field(init=False)

    def __post_init__(self) -> None:
        self.losses = Losses(self.path.name, self.report)
        self.names = Names(self.losses.lost)  # not of the file: what refers to itself keeps its memory
        self.inflater, self.expansion = Inflater(len(self.data)), Expansion(len(self.data))

    @property
    def statistics(self) -> Statistics | None:
        """What the summary counts, where it has counts."""
        return None if self.summary is None else self.summary.statistics

    def lost(self, kind: str, text: str) -> None:
        """Report a loss; see `Losses.lost`."""
        self.losses.lost(kind, text)

    def held(self, row: int) -> str:
        """Say what the indexes say about a chunk's messages."""
        mine = self.indexes[slice(*np.searchsorted(self.indexes[:, 0], (row, row + 1)))]
        parts = [f"{n} of {self.names.topic(int(c))}" for _, c, n in mine.tolist() if n > 0]
        return (
            f"; by its index it held {', '.join(parts[:6])}{' and others' if len(parts) > 6 else ''}" if parts else ""
        )


def mapped_bytes(path: Path) -> NDArray[np.uint8]:
    """Map a file; raises `LogError` where it is empty, unreadable or not MCAP. Shape (bytes,)."""
    try:
        with path.open("rb") as source:
            if path.stat().st_size == 0:
                raise LogError(f"{path} is empty (0 bytes); the recording was not written, copy or record it again")
            mapped = mmap.mmap(source.fileno(), 0, access=mmap.ACCESS_READ)
    except (OSError, ValueError) as error:
        raise LogError(f"{path} cannot be read: {getattr(error, 'strerror', None) or error}") from error
    data = np.frombuffer(mapped, np.uint8)
    if not looks_like_mcap(data[: len(fmt.MAGIC)].tobytes(), data[-len(fmt.MAGIC) :].tobytes()):
        raise LogError(f"{path} does not start as an MCAP file; found {data[:8].tobytes()!r}")
    return data


def looks_like_mcap(head: bytes, tail: bytes) -> bool:
    """Whether a file's first bytes are MCAP's but for two, or its last bytes are."""
    same = sum(a == b for a, b in zip(head, fmt.MAGIC, strict=False))
    return same >= len(fmt.MAGIC) - 2 or tail == fmt.MAGIC
