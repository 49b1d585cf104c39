"""Every record of an MCAP file in its place, as our own walk finds it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from replay.errors import LogError
from replay.log.reading_notes import Report
from replay.readers.mcap import format as fmt
from replay.readers.mcap import scan
from replay.readers.mcap.chunk import open_chunk
from replay.readers.mcap.file import McapFile
from replay.readers.mcap.opening import open_file
from replay.readers.mcap.records import BAD_RECORD, Record, parse


def records_of(path: Path) -> Iterator[Record]:
    """Yield the records in the order of their places, those in chunks where the chunk stands.

    Message indexes, records of unknown type and bytes that hold no record are passed over.

    Raises
    ------
    LogError
        Where the file cannot be opened or a record cannot be parsed.
    """
    file = open_file(path, Report())
    rows = scan.walk(file.data, len(fmt.MAGIC), len(file.data), file.names.named.copy(), scan.Tally()).rows
    for op, start, stop, _ in rows.tolist():
        if op == fmt.CHUNK:
            yield from _of_chunk(file, start)
        elif fmt.HOLE < op < fmt.SHORT:
            yield from _of_run(file, file.data, start, stop, f"at byte {start}")


def _of_chunk(file: McapFile, start: int) -> Iterator[Record]:
    chunk = open_chunk(file, int(np.searchsorted(file.chunks[:, 0], start)))
    if chunk is None:
        return
    for first, stop in chunk.runs:
        yield from _of_run(file, chunk.data, first, stop, f"in the chunk at byte {start}")


def _of_run(file: McapFile, data: NDArray[np.uint8], at: int, stop: int, place: str) -> Iterator[Record]:
    while at + 9 <= stop:
        end = at + 9 + int.from_bytes(data[at + 1 : at + 9].tobytes(), "little")
        try:
            record = parse(int(data[at]), data[at + 9 : end].tobytes())
        except BAD_RECORD as error:
            raise LogError(f"{file.path}: a record {place} is damaged ({type(error).__name__})") from error
        if record is not None:
            yield record
        at = end
