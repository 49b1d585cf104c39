"""The summary section of an MCAP file: what it lists, and whether that accounts for every byte of the data."""

from __future__ import annotations

import zlib
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from replay.readers.mcap import format as fmt
from replay.readers.mcap import scan
from replay.readers.mcap.records import BAD_RECORD, AttachmentIndex, Footer, MetadataIndex, Statistics, parse

_FOOTER_SIZE = 29
_CRC_SIZE = 4
_BEYOND = 1 << 60  # no file is as long


@dataclass(frozen=True)
class Summary:
    """What the summary section lists.

    Attributes
    ----------
    start, stop : int
        Its first byte, and the footer's.
    checked : bool
        Whether it has a checksum, and it is right.
    sound : bool
        Whether all its records could be read, none of them is one of the data, and its checksum, if any, is right.
    names : tuple[tuple[int, bytes, int], ...]
        Opcode, content and place of schema and channel records.
    statistics : Statistics or None
        Counts.
    chunks : NDArray[np.int64], shape (n, 7)
        As `replay.readers.mcap.scan.chunk_indexes` returns them, in the order of their places.
    indexes : NDArray[np.int64], shape (m, 3)
        Row in `chunks`, channel and place of each message index, in the order of rows.
    attachments : tuple[AttachmentIndex, ...]
        Attachments.
    metadata : tuple[MetadataIndex, ...]
        Metadata records.
    """

    start: int
    stop: int
    checked: bool
    sound: bool
    names: tuple[tuple[int, bytes, int], ...]
    statistics: Statistics | None
    chunks: NDArray[np.int64]
    indexes: NDArray[np.int64]
    attachments: tuple[AttachmentIndex, ...]
    metadata: tuple[MetadataIndex, ...]

    def covers(self, data: NDArray[np.uint8]) -> bool:
        """Whether listed chunks and plain records between them fill the data section, so that no chunk is missing.

        `data` of shape (bytes,).
        """
        if not (self.sound and self.checked):
            return False
        stated = self.statistics
        if stated is not None and stated.chunk_count != len(self.chunks):
            return False
        if not len(self.chunks):
            return stated is not None
        if (self.chunks[:, 2:5] > self.start).any() or (self.chunks[:, 3] < 49).any():
            return False
        starts = self.chunks[:, 2]
        stops = starts + self.chunks[:, 3] + self.chunks[:, 4]
        if stops[-1] > self.start:
            return False
        edges = np.concatenate(([len(fmt.MAGIC)], stops)), np.concatenate((starts, [self.start]))
        if (edges[1] < edges[0]).any():
            return False
        gaps = np.flatnonzero(edges[1] > edges[0])
        return all(_plain(data, int(edges[0][i]), int(edges[1][i])) for i in gaps)


def _plain(data: NDArray[np.uint8], start: int, stop: int) -> bool:
    """Whether a stretch holds sound records only, none of them a chunk, messages or of unknown type."""
    found = scan.walk(data, start, stop, np.zeros(fmt.CHANNELS, np.uint8), scan.Tally())
    op, flag = found.rows[:, 0], found.rows[:, 3]
    odd = (op == fmt.HOLE) | (op == fmt.CHUNK) | (op == fmt.MESSAGE) | (op == fmt.FOOTER) | (op > fmt.DATA_END)
    return not odd.any() and not flag.any()


def read_summary(data: NDArray[np.uint8], footer: int, place: int | None = None) -> Summary | None:
    """Read the summary section that a footer points to; None where there is none.

    Parameters
    ----------
    data : NDArray[np.uint8], shape (b,)
        The file.
    footer : int
        Where the footer record starts.
    place : int or None
        Where the summary starts, if not where the footer says.
    """
    if footer < len(fmt.MAGIC) or footer + _FOOTER_SIZE > len(data) or data[footer] != fmt.FOOTER:
        return None
    ends = parse(fmt.FOOTER, data[footer + 9 : footer + _FOOTER_SIZE].tobytes())
    if not isinstance(ends, Footer) or not ends.summary_start:
        return None
    start = ends.summary_start if place is None else place
    if not len(fmt.MAGIC) <= start < footer:
        return None
    crc = zlib.crc32(data[start : footer + _FOOTER_SIZE - _CRC_SIZE].data) if ends.summary_crc else 0
    found = scan.walk(data, start, footer, np.zeros(fmt.CHANNELS, np.uint8), scan.Tally())
    right = crc == ends.summary_crc
    sound = found.end == footer and right and not _flawed(found.rows)
    return summary_from(data, found.rows, (start, footer), bool(crc) and right, sound)


def summary_from(
    data: NDArray[np.uint8], rows: NDArray[np.int64], place: tuple[int, int], checked: bool, sound: bool
) -> Summary:
    """Gather the summary from the rows of a walk over it.

    `data` of shape (bytes,), `rows` of shape (records, columns).
    """
    listed = rows[(rows[:, 0] == fmt.CHUNK_INDEX) & (rows[:, 3] == fmt.SOUND)]
    chunks, indexes = scan.chunk_indexes(data, listed)
    chunks[:, 2:], indexes[:, 2] = _bounded(chunks[:, 2:]), _bounded(indexes[:, 2])
    if (chunks[1:, 2] < chunks[:-1, 2]).any():
        order = np.argsort(chunks[:, 2], kind="stable")
        chunks, indexes[:, 0] = chunks[order], np.argsort(order, kind="stable")[indexes[:, 0]]
        indexes = indexes[np.argsort(indexes[:, 0], kind="stable")]
    names: list[tuple[int, bytes, int]] = []
    statistics: Statistics | None = None
    attachments, metadata = [], []
    for op, at, stop, _ in rows[(rows[:, 0] != fmt.CHUNK_INDEX) & (rows[:, 0] != fmt.HOLE)].tolist():
        raw = data[at + 9 : stop].tobytes()
        if op in (fmt.SCHEMA, fmt.CHANNEL):
            names.append((op, raw, at))
            continue
        try:
            record = parse(op, raw)
        except BAD_RECORD:
            sound = False
            continue
        if isinstance(record, Statistics):
            statistics = record
        elif isinstance(record, AttachmentIndex):
            attachments.append(record)
        elif isinstance(record, MetadataIndex):
            metadata.append(record)
    return Summary(
        *place, checked, sound, tuple(names), statistics,
        chunks, indexes, tuple(attachments), tuple(metadata),
    )  # fmt: skip


def _bounded(places: NDArray[np.int64]) -> NDArray[np.int64]:
    """Places and lengths as stated, those beyond any file as `_BEYOND`, so that no sum of them leaves its 64 bits."""
    return np.where((places < 0) | (places > _BEYOND), _BEYOND, places)


def _flawed(rows: NDArray[np.int64]) -> bool:
    """Whether any row is a hole, of the data section, or had to be mended; unknown records of a later version are no flaw."""
    op, flag = rows[:, 0], rows[:, 3]
    data = (op == fmt.CHUNK) | (op == fmt.MESSAGE) | (op == fmt.ATTACHMENT)
    return bool((data | (op == fmt.HOLE) | ((flag == fmt.MENDED) & (op <= fmt.DATA_END))).any())
