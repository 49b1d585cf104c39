"""Messages of an MCAP log within a part of its time, as they were written."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from replay.arrays.blocks import release
from replay.export.clips.mcap import Definitions, Records
from replay.log.reading_notes import Report
from replay.readers.mcap import format as fmt
from replay.readers.mcap.chunk import open_chunk
from replay.readers.mcap.opening import open_file
from replay.readers.mcap.records import BAD_RECORD, Channel, Schema, parse
from replay.readers.mcap.scan import Census
from replay.readers.mcap.walk import walk_file

_HEAD = 9 + fmt.MESSAGE_HEAD
_LARGE = 4096
_HELD = 64 << 20
_EVER = (-(2**63), 2**63 - 1)


class _Stretch(NamedTuple):
    """Counted records: their bytes, where they begin, and what stands there."""

    data: NDArray[np.uint8]
    start: int
    census: Census


class ClipSource:
    """One MCAP file from which parts are copied.

    Opening reads the whole file once for the log stamps that its pieces really hold; `messages` opens only pieces that
    hold some of the asked time.

    Parameters
    ----------
    path : Path
        The file.
    topic : str
        Topic whose log stamps are kept in `log_stamps`, sorted.

    Raises
    ------
    LogError
        Where nothing in the file can be read.
    """

    def __init__(self, path: Path, topic: str) -> None:
        self._file = open_file(path, Report(), walk=False)
        if not len(self._file.chunks):
            walk_file(self._file)
        self._pieces = [(start, stop, -1) for start, stop in self._file.runs]
        self._pieces += [(int(c[0]), int(c[1]), i) for i, c in enumerate(self._file.chunks)]
        self._pieces.sort()
        self._bounds: list[tuple[int, int]] = []
        stamps: list[NDArray[np.int64]] = []
        held = 0
        for piece in self._pieces:
            if piece[0] - held > _HELD:  # pages of the file that were read count as memory of this process
                release(self._file.data)
                held = piece[0]
            first, last = 2**63 - 1, -1
            for data, start, census in self._stretches(piece):
                first, last = min(first, census.bounds[0]), max(last, census.bounds[1])
                wanted = np.array([self._topic(n) == topic for n in census.channels.tolist()], np.bool_)
                stamps += [g.log for g in self._file.scanner.collect(data, start, census, wanted, _EVER)]
            self._bounds.append((first, last))
        self.log_stamps = np.sort(np.concatenate(stamps)) if stamps else np.empty(0, np.int64)

    def _topic(self, number: int) -> str | None:
        connection = self._file.names.connection(number)
        return None if connection is None else connection.topic

    def _stretches(self, piece: tuple[int, int, int]) -> Iterator[_Stretch]:
        start, stop, row = piece
        verified = False
        if row < 0:
            data, runs = self._file.data, [(start, stop)]
        else:
            chunk = open_chunk(self._file, row)
            if chunk is None:
                return
            data, runs, verified = chunk.data, chunk.runs, chunk.verified
        for at, end in runs:
            while at < end:
                census = self._file.scanner.census(data, at, end)
                for op, body, size in census.names.tolist():
                    self._file.names.take(op, data[body : body + size].tobytes(), verified, f"at byte {start}")
                yield _Stretch(data, at, census)
                if census.end <= at:
                    break
                at = census.end

    def define(self, definitions: Definitions) -> dict[int, int]:
        """Add this file's channels to those of a clip; gives the new number of each."""
        schemas: dict[int, Schema] = {}
        channels: list[Channel] = []
        for op, raw in self._file.names.records:
            try:
                record = parse(op, raw)
            except BAD_RECORD:
                continue
            if isinstance(record, Schema):
                schemas[record.id] = record
            elif isinstance(record, Channel):
                channels.append(record)
        numbers = {}
        for c in channels:
            schema = schemas.get(c.schema_id)
            number = 0 if schema is None else definitions.schema(schema.name, schema.encoding, schema.data)
            numbers[c.id] = definitions.channel(c.topic, c.message_encoding, c.metadata, number)
        return numbers

    def messages(self, start_ns: int, stop_ns: int, numbers: dict[int, int]) -> Iterator[Records]:
        """Messages of all topics with log stamps in [start, stop), in the order of places.

        Parameters
        ----------
        start_ns, stop_ns : int
            On the log's clock.
        numbers : dict[int, int]
            From `define`.
        """
        for piece, (first, last) in zip(self._pieces, self._bounds, strict=True):
            if last < start_ns or first >= stop_ns:
                continue
            for data, start, census in self._stretches(piece):
                wanted = np.array([n in numbers for n in census.channels.tolist()], np.bool_)
                groups = self._file.scanner.collect(data, start, census, wanted, (start_ns, stop_ns))
                if not groups:
                    continue
                body, size, log = (
                    np.concatenate([getattr(g, name) for g in groups]) for name in ("body", "size", "log")
                )
                channels = np.repeat([numbers[g.channel] for g in groups], [g.body.size for g in groups])
                order = np.argsort(body, kind="stable")
                yield _copied(data, body[order], size[order], channels[order], log[order])


def _copied(
    data: NDArray[np.uint8],
    body: NDArray[np.int64],
    size: NDArray[np.int64],
    channels: NDArray[np.int64],
    log: NDArray[np.int64],
) -> Records:
    """Copy messages with their heads, under their new channel numbers."""
    lengths = size + _HEAD
    offsets = np.cumsum(lengths) - lengths
    out = np.empty(int(lengths.sum()), np.uint8)
    if out.size > _LARGE * body.size:  # images and the like: few and long, copied one by one
        for at, place, length in zip(offsets.tolist(), (body - _HEAD).tolist(), lengths.tolist(), strict=True):
            out[at : at + length] = data[place : place + length]
    else:
        out[:] = data[np.repeat(body - _HEAD - offsets, lengths) + np.arange(out.size)]
    # Heads are written anew: opcode, length, channel; sequence and stamps stay.
    heads = np.empty((body.size, 11), np.uint8)
    heads[:, 0] = fmt.MESSAGE
    heads[:, 1:9] = (size + fmt.MESSAGE_HEAD).astype("<u8").view(np.uint8).reshape(-1, 8)
    heads[:, 9:] = channels.astype("<u2").view(np.uint8).reshape(-1, 2)
    out[offsets[:, None] + np.arange(11)] = heads
    return Records(out, offsets, channels.astype(np.int64), log)
