"""Recordings of TwinCAT Scope (``.svdx``), read without Beckhoff's tools; experimental.

The format is not published. What does not fit the known layout to the byte is refused rather than guessed.
"""

from __future__ import annotations

import mmap
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from replay.arrays.blocks import blocks
from replay.arrays.column_store import ColumnStore
from replay.arrays.compiling import njit
from replay.errors import LogError
from replay.log.raw_log import Channel, Clock, LogSummary, RawLog, TopicInfo, Window
from replay.log.reading_notes import Report
from replay.log.source_options import SourceOptions
from replay.readers.tables.columns import ArrayColumn, pick
from replay.readers.tables.time_cells import FILETIME_EPOCH
from replay.readers.twincat.svdx_layout import HOW, Block, BlockHead, Frame, is_svdx, read_frame, read_head

_TYPES = {
    "BIT": "u1", "BOOL": "u1", "BYTE": "u1", "USINT": "u1", "UINT8": "u1", "SINT": "i1", "INT8": "i1",
    "WORD": "<u2", "UINT": "<u2", "UINT16": "<u2", "INT": "<i2", "INT16": "<i2",
    "DWORD": "<u4", "UDINT": "<u4", "UINT32": "<u4", "DINT": "<i4", "INT32": "<i4",
    "LWORD": "<u8", "ULINT": "<u8", "UINT64": "<u8", "LINT": "<i8", "INT64": "<i8",
    "REAL": "<f4", "REAL32": "<f4", "LREAL": "<f8", "REAL64": "<f8",
}  # fmt: skip
_SEGMENT = 12
_ROWS = 1 << 18
_LATEST = FILETIME_EPOCH + 2**62 // 100
_EXPERIMENTAL = "reading .svdx is experimental: compare with a text export of the same recording once"


class SvdxReader:
    """Reader of Scope recordings."""

    format = "svdx"

    def matches(self, path: Path) -> bool:
        """Whether the head's lengths add up to the file's size and its first block is of the known version."""
        if not path.is_file():
            return False
        with path.open("rb") as file:
            return is_svdx(file, path.stat().st_size)

    def summarise(self, path: Path, options: SourceOptions) -> LogSummary:
        """List the channels from the XML and the heads of segments; no sample is decoded.

        Raises
        ------
        LogError
            Where a length does not fit.
        """
        report = Report()
        topics: list[TopicInfo] = []
        ends: list[int] = []
        with _mapped(path) as (data, frame):
            for name, block, facts, head, dtype in _channels(path, data, frame, report):
                starts, counts = _segments(path, data, block, head, dtype.itemsize)
                topics.append(_topic(name, facts, head, int(counts.sum())))
                if len(starts):
                    size = 4 + dtype.itemsize
                    last = int(starts[-1]) + _SEGMENT + (int(counts[-1]) - 1) * size
                    first = _ns(_u64(data, int(starts[0])) + _u32(data, int(starts[0]) + _SEGMENT))
                    ends += [first, _ns(_u64(data, int(starts[-1])) + _u32(data, last))]
        start, stop = (min(ends), max(ends)) if ends else (0, 0)
        said = tuple(report.notes), tuple(report.damage)
        return LogSummary(str(path), self.format, start, stop, tuple(topics), *said)

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
        """Read all channels.

        Raises
        ------
        LogError
            Where a length does not fit, with its byte.
        """
        report = Report(store=store or ColumnStore())
        channels: dict[str, Channel] = {}
        infos: list[TopicInfo] = []
        with _mapped(path) as (data, frame):
            for name, block, facts, head, dtype in _channels(path, data, frame, report):
                stamps, values = _samples(path, data, block, head, dtype, window, report.store)
                gain = _scaling(path, facts) if options.scale else None
                if gain is not None:
                    values = values * gain[0] + gain[1]
                channels[name] = Channel(
                    name, "", facts.get("Name", name), stamps, values, _unit(facts), facts.get("DataType", "")
                )
                infos.append(_topic(name, facts, head, len(stamps)))
        used = [c.stamps for c in channels.values() if len(c.stamps)]
        start, stop = (int(min(s.min() for s in used)), int(max(s.max() for s in used))) if used else (0, 0)
        said = tuple(report.notes), tuple(report.damage)
        summary = LogSummary(str(path), self.format, start, stop, tuple(infos), *said)
        return RawLog(str(path), self.format, clock, channels, summary, report.store)


@contextmanager
def _mapped(path: Path) -> Iterator[tuple[NDArray[np.uint8], Frame]]:
    try:
        with path.open("rb") as file:
            frame = read_frame(path, file, path.stat().st_size)
            yield np.frombuffer(mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ), np.uint8), frame
    except OSError as error:
        raise LogError(f"{path} cannot be read: {error.strerror or error}") from error


def _channels(
    path: Path, data: NDArray[np.uint8], frame: Frame, report: Report
) -> Iterator[tuple[str, Block, dict[str, str], BlockHead, np.dtype[Any]]]:
    """Name, block, facts, head and number type of each channel that can be read."""
    report.note(f"{path.name}: {_EXPERIMENTAL}")
    taken: set[str] = set()
    read = 0
    with path.open("rb") as file:
        for block in frame.blocks:
            facts = frame.acquisitions.get(block.handle)
            if facts is None:
                report.lost(
                    f"{path.name}: its XML names no acquisition of handle {block.handle} (block at byte {block.offset}), so "
                    "the block was left out"
                )
                continue
            code = _TYPES.get(facts.get("DataType", "").strip().upper())
            name = base = facts.get("SymbolName") or facts.get("Name") or f"handle {block.handle}"
            if code is None:
                report.lost(
                    f"{path.name}: {name} is of type {facts.get('DataType', '')!r}, which holds no single number; left out"
                )
                continue
            number = 1
            while name in taken:
                name, number = f"{base} ({number})", number + 1
            taken.add(name)
            head = read_head(path, file, block)
            if not FILETIME_EPOCH < head.start < _LATEST:
                raise LogError(
                    f"{path}, byte {block.offset + 11}: {head.start} is not a time (FILETIME since 1970 expected); {HOW}"
                )
            read += 1
            yield name, block, facts, head, np.dtype(code)
    if not read:
        raise LogError(f"{path}: none of its {len(frame.blocks)} blocks holds a channel of numbers; {HOW}")


def _topic(name: str, facts: dict[str, str], head: BlockHead, count: int) -> TopicInfo:
    return TopicInfo(f"{name} ({head.period / 10_000:g} ms)", "table", count, "table", (name,))


@njit(cache=True)
def _walk(
    data: NDArray[np.uint8], at: int, stop: int, size: int, starts: NDArray[np.int64], counts: NDArray[np.int64]
) -> tuple[int, int]:
    """Follow the segments until one does not fit; returns the byte reached and their number."""
    n = 0
    while at + 12 <= stop and n < len(starts):
        count: Any = 0
        for k in range(4):
            count |= np.int64(data[at + 8 + k]) << (8 * k)
        if count == 0 or at + 12 + count * size > stop:
            break
        starts[n], counts[n] = at, count
        n += 1
        at += 12 + count * size
    return at, n


def _segments(
    path: Path, data: NDArray[np.uint8], block: Block, head: BlockHead, width: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Where segments begin in the file, and how many samples each holds; they must end where the block ends."""
    size = 4 + width
    at, stop = block.offset + head.samples, block.offset + block.length
    most = (stop - at) // (_SEGMENT + size)
    starts, counts = np.empty(most, np.int64), np.empty(most, np.int64)
    reached, n = _walk(data, at, stop, size, starts, counts)
    if reached != stop:
        raise LogError(
            f"{path}, byte {reached}: the segment of handle {block.handle} that begins here does not fit the block, which "
            f"ends at byte {stop}; {HOW}"
        )
    return starts[:n].copy(), counts[:n].copy()


def _samples(
    path: Path,
    data: NDArray[np.uint8],
    block: Block,
    head: BlockHead,
    dtype: np.dtype[Any],
    window: Window | None,
    store: ColumnStore,
) -> tuple[NDArray[np.int64], NDArray[Any]]:
    """Stamps [ns] and values of one block."""
    starts, counts = _segments(path, data, block, head, dtype.itemsize)
    row = np.dtype([("tick", "<u4"), ("value", dtype)])
    stamps, values = store.column(np.int64), ArrayColumn(store)
    at = 0
    while at < len(starts):
        first, count = int(starts[at]), int(counts[at])
        other = counts[at : at + _ROWS] != count
        run = min(int(other.argmax()) if other.any() else len(other), max(_ROWS // count, 1))
        part = data[first : first + run * (_SEGMENT + count * row.itemsize)].reshape(run, -1)
        zero = np.ascontiguousarray(part[:, :8]).view("<u8")
        if (zero < FILETIME_EPOCH).any() or (zero > _LATEST).any():
            raise LogError(
                f"{path}, byte {first}: {int(zero[0, 0])} is not a time (FILETIME since 1970 expected); {HOW}"
            )
        for s in blocks(count, _ROWS):
            cells = part[:, _SEGMENT + s.start * row.itemsize : _SEGMENT + s.stop * row.itemsize]
            rows = np.ascontiguousarray(cells).view(row)
            ns = ((zero.astype(np.int64) - FILETIME_EPOCH + rows["tick"].astype(np.int64)) * 100).ravel()
            keep = pick(ns, window)
            stamps.append(ns[keep])
            values.append(rows["value"].ravel()[keep].astype(dtype.newbyteorder("=")))
        at += run
    found = values.finish()
    return stamps.finish(), found if len(starts) else np.empty(0, dtype)


def _u64(data: NDArray[np.uint8], at: int) -> int:
    return int.from_bytes(data[at : at + 8].tobytes(), "little")


def _u32(data: NDArray[np.uint8], at: int) -> int:
    return int.from_bytes(data[at : at + 4].tobytes(), "little")


def _ns(filetime: int) -> int:
    return (min(max(filetime, 0), _LATEST) - FILETIME_EPOCH) * 100


def _scaling(path: Path, facts: dict[str, str]) -> tuple[float, float]:
    try:
        return float(facts.get("ScaleFactor") or 1), float(facts.get("Offset") or 0)
    except ValueError as error:
        raise LogError(
            f"{path}: ScaleFactor or Offset of {facts.get('SymbolName')} is not a number; drop scale = true"
        ) from error


def _unit(facts: dict[str, str]) -> str | None:
    return facts.get("Unit", "").partition("(")[0].strip() or None
