"""MCAP files: chunked or not, with or without index, complete, cut off or damaged."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from replay.arrays.blocks import release
from replay.arrays.column_store import ColumnStore
from replay.border import bordered
from replay.errors import LogError
from replay.log.raw_log import AttachmentInfo, Clock, LogSummary, RawLog, TopicInfo, Window
from replay.log.reading_notes import Report
from replay.log.source_options import SourceOptions
from replay.readers.mcap import format as fmt
from replay.readers.mcap.chunk import name_channels, open_chunk
from replay.readers.mcap.file import McapFile, looks_like_mcap
from replay.readers.mcap.opening import open_file
from replay.readers.mcap.verify import account, check_data, counts_of, expected
from replay.readers.mcap.walk import walk_file
from replay.readers.messages.assemble import Assembler
from replay.readers.messages.connection import Block, Connection

_HELD = 64 << 20


class McapReader:
    """Reader of MCAP files."""

    format = "mcap"

    def matches(self, path: Path) -> bool:
        """Whether the file starts with MCAP's magic bytes, give or take two, or ends with them."""
        if not path.is_file():
            return False
        with path.open("rb") as file:
            head = file.read(len(fmt.MAGIC))
            file.seek(max(path.stat().st_size - len(fmt.MAGIC), 0))
            return looks_like_mcap(head, file.read(len(fmt.MAGIC)))

    def summarise(self, path: Path, options: SourceOptions) -> LogSummary:
        """List topics and counts from the summary; the records are walked only where it does not tell all.

        Raises
        ------
        LogError
            Where nothing in the file can be read.
        """
        report = Report()
        return summary_of(open_files([path], path, report, walk=False), path, self.format, report)

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
        """Decode the given topics and time.

        Raises
        ------
        LogError
            Where nothing in the file can be read.
        """
        return read_files(
            [path], path, self.format, Report(store=store or ColumnStore()), topics, clock, window, texts=texts
        )


def read_files(
    files: list[Path],
    source: Path,
    name: str,
    report: Report,
    topics: Collection[str] | None,
    clock: Clock,
    window: Window | None = None,
    unpack: Callable[[Iterable[Block]], Iterator[list[Block]]] | None = None,
    texts: bool = False,
) -> RawLog:
    """Read the files of one recording as one log; a file that cannot be read is damage unless it is the only one.

    Without a window every record of every file is walked and held against index and statistics; with one, only what
    the index places inside it is opened. `unpack` expands messages that were compressed one by one; `texts` are channels where wanted.
    """
    opened = open_files(files, source, report, walk=window is None)
    assembler = Assembler(clock, report, texts)
    for file in opened:
        if window is None:
            for number, count in expected(file)[0].items():
                if number in file.names.channels:
                    assembler.expect(file.names.channels[number], count)
        for blocks in blocks_of(file, topics, window):
            for part in (blocks,) if unpack is None else unpack(blocks):
                assembler.add(part)
        release(file.data)
    return assembler.finish(summary_of(opened, source, name, report))


def open_files(files: list[Path], source: Path, report: Report, walk: bool = False) -> list[McapFile]:
    """Open the files of one recording; raises `LogError` where none can be opened.

    Parameters
    ----------
    files : list[Path]
        The files.
    source : Path
        What the user gave.
    report : Report
        Takes losses.
    walk : bool
        Whether to walk over all records even where the summary accounts for them.
    """
    opened, last = [], LogError(f"{source}: no MCAP file in it")
    for path in files:
        try:
            with bordered(path, "mcap"):
                opened.append(open_file(path, report, walk))
        except LogError as error:
            last = error
            report.lost(str(error))
    if not opened:
        raise last
    return opened


def _split(
    file: McapFile,
    data: NDArray[np.uint8],
    run: tuple[int, int],
    verified: bool,
    topics: Collection[str] | None,
    window: Window | None,
    place: str,
) -> Iterator[list[Block]]:
    """Blocks of one stretch of records, one per channel, some hundred thousand messages at a time."""
    at, stop = run
    while at < stop:
        census = file.scanner.census(data, at, stop)
        for op, body, size in census.names.tolist():
            file.names.take(op, data[body : body + size].tobytes(), verified, place)
        np.add.at(file.found.counts, census.channels, census.counts)
        file.found.bounds[0] = min(file.found.bounds[0], census.bounds[0])
        file.found.bounds[1] = max(file.found.bounds[1], census.bounds[1])
        file.strange += census.unknown
        known = {int(n): file.names.connection(int(n)) for n in census.channels}
        for n, count in zip(census.channels.tolist(), census.counts.tolist(), strict=True):
            if known[n] is None:
                file.lost("unnamed", f"{count} messages {place} belong to channel {n}, which is not named")
        wanted = np.array([c is not None and (topics is None or c.topic in topics) for c in known.values()], np.bool_)
        blocks = []
        for group in file.scanner.collect(data, at, census, wanted, window):
            connection = known[group.channel]
            if connection is not None:
                blocks.append(Block(connection, data, group.body, group.size, group.log, group.publish))
        yield blocks
        if census.end <= at:
            file.lost("bytes", f"the records {place} end {stop - at} bytes early")
            return
        at = census.end


def blocks_of(file: McapFile, topics: Collection[str] | None, window: Window | None) -> Iterator[list[Block]]:
    """Blocks of a file in the order of places; then what was found is held against what should be there."""
    if not len(file.chunks):
        walk_file(file)
    skipped = set() if topics is None and window is None else _skipped(file, topics, window)
    order: list[tuple[int, int, int]] = [(start, stop, -1) for start, stop in file.runs]
    order += [(int(c[0]), int(c[1]), i) for i, c in enumerate(file.chunks) if i not in skipped]
    file.bare |= bool(file.runs)
    held = 0
    for start, stop, row in sorted(order):
        if start - held > _HELD:  # pages of the file that were read count as memory of this process
            release(file.data)
            held = start
        if row < 0:
            yield from _split(file, file.data, (start, stop), False, topics, window, f"at byte {start}")
        else:
            yield from _chunk_blocks(file, row, topics, window)
    if window is None:
        late = account(file, file.found, topics, skipped)
        for row in late:
            yield from _chunk_blocks(file, row, topics, window)
        if late:
            account(file, file.found, topics, set())
        check_data(file, whole=not skipped or bool(late))
        file.read_whole, file.read_topics = True, None if topics is None else frozenset(topics)


def _chunk_blocks(
    file: McapFile, row: int, topics: Collection[str] | None, window: Window | None
) -> Iterator[list[Block]]:
    chunk = open_chunk(file, row)
    if chunk is None:
        return
    place = f"in the chunk at byte {file.chunks[row, 0]}"
    for run in chunk.runs:
        yield from _split(file, chunk.data, run, chunk.verified, topics, window, place)


def _skipped(file: McapFile, topics: Collection[str] | None, window: Window | None) -> set[int]:
    """Rows of chunks that hold no wanted message by an index whose checksum is right."""
    if file.summary is None or not file.summary.checked or not file.summary.sound or not name_channels(file):
        return set()
    skip: NDArray[np.bool_] = np.zeros(len(file.chunks), np.bool_)
    if window is not None:
        first, last = file.chunks[:, 2], file.chunks[:, 3]
        skip |= ((last < window[0]) | (first >= window[1])) & (last >= first) & (last > 0)
    if topics is not None:
        wanted = [n for n, c in file.names.channels.items() if c.topic in topics]
        indexed, holding = np.zeros(len(skip), np.bool_), np.zeros(len(skip), np.bool_)
        indexed[file.indexes[:, 0]] = True
        unnamed = file.names.named[file.indexes[:, 1]] == 0
        holding[file.indexes[np.isin(file.indexes[:, 1], wanted) | unnamed, 0]] = True
        skip |= indexed & ~holding
    return set(np.flatnonzero(skip).tolist())


def summary_of(files: list[McapFile], source: Path, name: str, report: Report) -> LogSummary:
    """Summarise the files of one recording."""
    totals: dict[Connection, int] = {}
    bounds: list[int] = []
    metadata: dict[str, str] = {}
    attachments: list[AttachmentInfo] = []
    for file in files:
        counts, edges = counts_of(file)
        bounds += [b for b in edges if 0 <= b < 2**63]
        for number, connection in file.names.channels.items():
            totals[connection] = totals.get(connection, 0) + counts.get(number, 0)
        for key, value in file.metadata.items():
            metadata.setdefault(key, value)
        if file.bare:
            metadata["integrity"] = "unverifiable"
        if file.strange:
            report.note(f"{file.path.name}: {file.strange} records of unknown type in its chunks were left out")
        attachments += file.attachments
        file.losses.say_rest()
    metadata.setdefault("integrity", "checksums")
    topics = tuple(TopicInfo(c.topic, c.type_name, n, c.encoding, (), c.why_not()) for c, n in totals.items())
    start, stop = (min(bounds), max(bounds)) if bounds else (0, 0)
    if not any(totals.values()):
        report.note(f"{source.name} holds no messages")
    return LogSummary(
        str(source), name, start, stop, topics, tuple(report.notes), tuple(report.damage), metadata, tuple(attachments)
    )  # fmt: skip
