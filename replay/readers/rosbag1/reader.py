"""ROS 1 bags (format 2.0): indexed or not, complete, cut off or damaged; and folders with the parts of a split one."""

from __future__ import annotations

import bz2
from collections import Counter
from collections.abc import Collection, Iterator
from pathlib import Path

import lz4.frame
import numpy as np
from numpy.typing import NDArray

from replay.arrays.column_store import ColumnStore
from replay.errors import LogError
from replay.log.raw_log import Clock, LogSummary, RawLog, TopicInfo, Window
from replay.log.reading_notes import Report
from replay.log.source_options import SourceOptions
from replay.readers.common.inflate import Expansion, InflateError, Inflater
from replay.readers.messages.assemble import Assembler
from replay.readers.messages.connection import Block, Connection
from replay.readers.rosbag1 import parts
from replay.readers.rosbag1.bag import Bag, Chunk
from replay.readers.rosbag1.connections import take_connection
from replay.readers.rosbag1.file import MAGIC, open_bag
from replay.readers.rosbag1.reconcile import check_messages
from replay.readers.rosbag1.records_kernel import CONNECTION, MESSAGE, BagRecords, scan_bag

_LOOK, _RECORDS = 4 << 20, 3
_SMALLEST = 43  # bytes of a message's record
_MOST = 64 << 20  # of a chunk whose stated size is wrong
_PIECE = 1 << 20
_MAGICS = {b"\x04\x22\x4d\x18": "lz4", b"BZh": "bz2"}


class Ros1BagReader:
    """Reader of ROS 1 bags."""

    format = "bag"

    def matches(self, path: Path) -> bool:
        """Whether the file starts with a bag's magic line, or is called a bag and holds a bag's records.

        Of a folder: whether it holds the numbered parts of one split bag.
        """
        if path.is_dir():
            return bool(parts.parts_in(path))
        with path.open("rb") as file:
            head = file.read(len(MAGIC))
            if head == MAGIC or path.suffix != ".bag":
                return head == MAGIC
            return len(scan_bag(np.frombuffer(file.read(_LOOK), np.uint8)).op) >= _RECORDS

    def summarise(self, path: Path, options: SourceOptions) -> LogSummary:
        """List topics and counts from the index, opening chunks only where it is absent.

        Raises
        ------
        LogError
            Where nothing in the bag can be read.
        """

        def summarise(part: Path) -> LogSummary:
            reading = _Reading(open_bag(part, Report(), whole=False), (), None)
            for _ in reading.blocks():
                pass
            return reading.summary()

        return parts.over_parts(path, summarise) if path.is_dir() else summarise(path)

    def read(
        self,
        path: Path,
        options: SourceOptions,
        topics: Collection[str] | None = None,
        clock: Clock = "header",
        window: Window | None = None,
        store: ColumnStore | None = None,
        texts: bool = False,
    ) -> RawLog:
        """Decode the given topics and time; chunks that the index places outside are not opened.

        Raises
        ------
        LogError
            Where nothing in the bag can be read.
        """
        assembler = Assembler(clock, report := Report(store=store or ColumnStore()), texts)

        def take(part: Path) -> LogSummary:
            mine = Report() if path.is_dir() else report
            reading = _Reading(open_bag(part, mine, whole=window is None), topics, window)
            reading.foretell(assembler)
            for blocks in reading.blocks():
                assembler.add(blocks)
            return reading.summary()

        return assembler.finish(parts.over_parts(path, take) if path.is_dir() else take(path))


class _Reading:
    """One pass over a bag: what is wanted, and counts of what was there."""

    def __init__(self, bag: Bag, topics: Collection[str] | None, window: Window | None) -> None:
        self.bag, self.topics, self.window = bag, topics, window
        self.inflater, self.expansion = Inflater(len(bag.data)), Expansion(len(bag.data))
        self.found: Counter[int] = Counter()
        self.stated: Counter[int] = Counter(bag.absent)
        self.skipped: Counter[int] = Counter()
        self.bounds: list[int] = []

    def foretell(self, assembler: Assembler) -> None:
        """Tell how many messages the index counts, as far as a bag of this size can hold them."""
        stated: Counter[int] = Counter()
        for chunk in self.bag.chunks:
            if chunk.stated is not None and self._may_hold(chunk, chunk.stated):
                stated.update(chunk.stated)
        room = sum(min(c.size, _MOST) for c in self.bag.chunks) // _SMALLEST
        for number, count in stated.items():
            if number in self.bag.connections and 0 < count <= room:
                assembler.expect(self.bag.connections[number], count)

    def blocks(self) -> Iterator[list[Block]]:
        """Messages in the order of the file, chunk by chunk; those outside of chunks where the first of them stands."""
        bag = self.bag
        places = [(int(r.head[np.argmax(r.op == MESSAGE)]), r) for r in bag.loose]
        parts: list[tuple[int, BagRecords | Chunk]] = [*places, *((c.start, c) for c in bag.chunks)]
        for _, part in sorted(parts, key=lambda p: p[0]):
            if isinstance(part, Chunk):
                yield self._chunk(part)
                continue
            count = int(np.count_nonzero(part.op == MESSAGE))
            bag.lost(f"{count} messages are outside of chunks (a chunk's header is damaged); they were read")
            yield list(self._split(bag.data, part))

    def _chunk(self, chunk: Chunk) -> list[Block]:
        """Blocks of one chunk, unless it holds nothing that is wanted."""
        stated = chunk.stated
        if stated is not None and not self._may_hold(chunk, stated):
            self.skipped.update(stated)
            self.bounds += [chunk.first_ns, chunk.last_ns]
            return []
        self.stated.update(stated or {})
        data = self._expand(chunk)
        if data is None:
            return []
        records = scan_bag(data)
        self._check(chunk, data, records)
        return list(self._split(data, records))

    def _may_hold(self, chunk: Chunk, stated: dict[int, int]) -> bool:
        """Whether a chunk may hold a wanted message; one that the index says too little about may."""
        if chunk.first_ns < 0 or any(n not in self.bag.connections for n in stated):
            return True
        if self.window is not None and (chunk.last_ns < self.window[0] or chunk.first_ns >= self.window[1]):
            return False
        return self.topics is None or any(self.bag.connections[n].topic in self.topics for n in stated)

    def _expand(self, chunk: Chunk) -> NDArray[np.uint8] | None:
        bag = self.bag
        packed = bag.data[chunk.body : chunk.body + chunk.packed]
        if chunk.compression == "none":
            if not chunk.cut and chunk.size != chunk.packed:
                bag.lost(f"the chunk at byte {chunk.start} states {chunk.size} bytes and holds {chunk.packed}")
            return packed
        reason = "it is cut off"
        if not self.expansion.allows(chunk.compression, chunk.size if not chunk.cut else _MOST):
            bag.lost(f"the chunk at byte {chunk.start} was left out: {self.expansion.why}")
            return None
        if not chunk.cut:
            try:
                return self.inflater.expand(chunk.compression, packed, chunk.size)
            except InflateError as error:
                reason = str(error)
        raw, complete = _expand_as_found(packed.tobytes())
        if raw and (complete or chunk.cut):
            bag.lost(f"the chunk at byte {chunk.start} was read as far as it can be expanded: {reason}")
            return np.frombuffer(raw, np.uint8)
        bag.lost(f"the chunk at byte {chunk.start} was left out: {reason}")
        return None

    def _check(self, chunk: Chunk, data: NDArray[np.uint8], records: BagRecords) -> None:
        """Take the connections of a chunk and say which of its bytes hold no record."""
        if records.lost or records.mended:
            self.bag.lost(
                f"the chunk at byte {chunk.start} is damaged: {records.lost} of its {len(data)} bytes hold no "
                f"complete record, the lengths of {records.mended} records are wrong"
            )
        elif not chunk.cut:
            check_messages(self.bag, chunk, records)
        for i in np.flatnonzero(records.op == CONNECTION).tolist():
            take_connection(self.bag, data, records, i)
            number = int(records.conn[i])
            if self.bag.listed and number not in self.bag.listed:
                self.bag.lost(
                    f"connection {number} ({self.bag.named(number)!r}) stands in the chunk at byte {chunk.start}, the index "
                    "section does not list it"
                )

    def _split(self, data: NDArray[np.uint8], records: BagRecords) -> Iterator[Block]:
        """Blocks of one buffer, one per connection."""
        rows = np.flatnonzero(records.op == MESSAGE)
        if not len(rows):
            return
        stamps, numbers = records.stamp[rows], records.conn[rows]
        self.bounds += [int(stamps.min()), int(stamps.max())]
        order = np.argsort(numbers, kind="stable")
        edges = np.flatnonzero(np.diff(numbers[order])) + 1
        for mine in np.split(rows[order], edges):
            number = int(records.conn[mine[0]])
            self.found[number] += len(mine)
            connection = self.bag.connections.get(number)
            if connection is None or (self.topics is not None and connection.topic not in self.topics):
                continue
            if self.window is not None:
                stamp = records.stamp[mine]
                mine = mine[(stamp >= self.window[0]) & (stamp < self.window[1])]
            if len(mine):
                yield Block(connection, data, records.body[mine], records.size[mine], records.stamp[mine])

    def summary(self) -> LogSummary:
        """Return the bag's contents: counts of what was opened as found, of the rest as its index states.

        Raises
        ------
        LogError
            Where a damaged bag holds neither connections nor messages.
        """
        bag, totals = self.bag, self.found + self.skipped
        if bag.report.damage and not bag.connections and not totals:
            raise LogError(f"{bag.path} holds nothing that can be read: {'; '.join(bag.report.damage[:3])}")
        if bag.renamed:
            pairs = [f"{topic[:80]} (there {own[:80]})" for topic, own in list(bag.renamed.values())[:6]]
            bag.report.note(
                f"{bag.path.name}: {len(bag.renamed)} topics have another name than in their publishers' headers, because "
                f"they were renamed or are damaged: {', '.join(pairs)}{' and more' if len(bag.renamed) > 6 else ''}"
            )
        beyond: list[str] = []
        for number in sorted(self.stated.keys() | self.found.keys()):
            stated, found = self.stated[number], self.found[number]
            connection = bag.connections.get(number)
            name = f"{connection.topic[:80]}" if connection else f"connection {number}"
            if self.stated and stated > found:
                bag.report.lost(
                    f"{bag.path.name}: {name}: {stated - found} of {stated} messages that the index counts were not found"
                )
            elif self._indexed() and stated < found:
                beyond.append(f"{name} {found} instead of {stated}")
            if connection is None and found:
                bag.lost(f"{found} messages belong to connection {number}, which is not named")
        if beyond:
            bag.report.lost(
                f"{bag.path.name}: what is left of the index names fewer messages than were read, so how many were recorded is "
                f"not known ({'; '.join(beyond[:6])}{' and more' if len(beyond) > 6 else ''})"
            )
        topics: dict[Connection, int] = {}
        for number, connection in bag.connections.items():
            topics[connection] = topics.get(connection, 0) + totals[number]
        infos = tuple(TopicInfo(c.topic, c.type_name, n, c.encoding, (), c.why_not()) for c, n in topics.items())
        bounds = [b for b in self.bounds if b >= 0]
        start, stop = (min(bounds), max(bounds)) if bounds else (0, 0)
        return LogSummary(
            str(bag.path), "bag", start, stop, infos, tuple(bag.report.notes), tuple(bag.report.damage),
            {"integrity": "unverifiable"},
        )  # fmt: skip

    def _indexed(self) -> bool:
        return bool(self.bag.chunks) and all(c.stated is not None for c in self.bag.chunks)


def _expand_as_found(packed: bytes) -> tuple[bytes, bool]:
    """Expand as far as possible by the data's own magic bytes: (result, whether the data end as they should)."""
    kind = next((k for m, k in _MAGICS.items() if packed.startswith(m)), "")
    out: list[bytes] = []
    size, at, ended = 0, 0, False
    stream = lz4.frame.LZ4FrameDecompressor() if kind == "lz4" else bz2.BZ2Decompressor()
    if not kind:
        return packed, bool(len(scan_bag(np.frombuffer(packed, np.uint8)).op))
    try:
        while not ended and size < _MOST and (at < len(packed) or not stream.needs_input):
            piece = packed[at : at + 4096] if stream.needs_input else b""
            at += len(piece)
            out.append(stream.decompress(piece, min(_PIECE, _MOST - size)))
            size, ended = size + len(out[-1]), stream.eof
    except (RuntimeError, OSError, EOFError, ValueError):
        pass
    return b"".join(out), ended
