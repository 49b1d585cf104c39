"""Structure of a ROS 1 bag: connections, chunks and what its index says about them."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from replay.log.reading_notes import Report
from replay.readers.messages.connection import Connection
from replay.readers.rosbag1.records_kernel import BagRecords

_MOST_TOLD = 200


@dataclass
class Chunk:
    """One chunk, and what the index section states about it.

    Attributes
    ----------
    start, body, packed, size : int
        Place of its record and of its data, their length, and their length when expanded [bytes].
    compression : str
        As stated.
    first_ns, last_ns : int
        Bounds of its stamps; both −1 where no index states them.
    stated : dict[int, int] or None
        Messages per connection, or None where no index states them.
    cut : bool
        Whether the file ends before the chunk does, or its length is not to be trusted.
    entries : list[tuple[int, int, int]]
        Connection, place and length [bytes] of what the index records behind it hold.
    """

    start: int
    body: int
    packed: int
    size: int
    compression: str
    first_ns: int = -1
    last_ns: int = -1
    stated: dict[int, int] | None = None
    cut: bool = False
    entries: list[tuple[int, int, int]] = field(default_factory=list)


@dataclass
class Bag:
    """One opened bag.

    Attributes
    ----------
    connections : dict[int, Connection]
        Streams by number.
    chunks : list[Chunk]
        In the order of the file.
    loose : list[BagRecords]
        Walks that met messages outside of chunks.
    renamed : dict[int, tuple[str, str]]
        Topic, and the one that the publisher's own header names, of connections where they differ.
    listed : set[int]
        Connections that stand outside of chunks, which is in the index section.
    absent : dict[int, int]
        Messages per connection of chunks that the index names and that are not in their place.
    """

    path: Path
    data: NDArray[np.uint8]
    report: Report
    connections: dict[int, Connection] = field(default_factory=dict)
    chunks: list[Chunk] = field(default_factory=list)
    loose: list[BagRecords] = field(default_factory=list)
    listed: set[int] = field(default_factory=set)
    absent: dict[int, int] = field(default_factory=dict)
    renamed: dict[int, tuple[str, str]] = field(default_factory=dict)
    raw: dict[int, bytes] = field(default_factory=dict)
    told: int = 0

    def named(self, number: int) -> str:
        """Topic of a connection, or its number where it is not named."""
        known = self.connections.get(number)
        return known.topic[:80] if known else f"connection {number}"

    def lost(self, text: str) -> None:
        """Report a loss in this file; of very many, the first ones."""
        self.told += 1
        if self.told <= _MOST_TOLD:
            self.report.lost(f"{self.path.name}: {text}")
        elif self.told == _MOST_TOLD + 1:
            self.report.lost(f"{self.path.name}: more than {_MOST_TOLD} places are damaged; the others are not listed")
