"""Opening an MCAP file by its summary where that accounts for every byte, else by a walk over all records."""

from __future__ import annotations

from pathlib import Path

from replay.errors import LogError
from replay.log.raw_log import AttachmentInfo
from replay.log.reading_notes import Report
from replay.readers.mcap import format as fmt
from replay.readers.mcap.file import McapFile, mapped_bytes
from replay.readers.mcap.summary import Summary, read_summary
from replay.readers.mcap.walk import listed_chunks, take_listed_names, take_record, walk_file

_FOOTER_SIZE = 29


def open_file(path: Path, report: Report, walk: bool = True) -> McapFile:
    """Open a file.

    Parameters
    ----------
    path : Path
        The file.
    report : Report
        Takes losses.
    walk : bool
        Whether to walk over all records whatever the summary says; else only where the summary does not account for
        every byte of the file.

    Raises
    ------
    LogError
        Where the file is empty, unreadable, not MCAP or holds no record.
    """
    file = McapFile(path, mapped_bytes(path), report)
    data = file.data
    if data[: len(fmt.MAGIC)].tobytes() != fmt.MAGIC:
        file.lost("magic", f"it starts with {data[:8].tobytes()!r}, not as an MCAP file does; the rest was read")
    at = len(data) - _FOOTER_SIZE - len(fmt.MAGIC)
    if data[-len(fmt.MAGIC) :].tobytes() == fmt.MAGIC:
        file.summary = read_summary(data, at)
    if file.summary is not None:
        take_listed_names(file, file.summary)
        if not walk and file.summary.covers(data):
            _take_summary(file, file.summary)
            return file
    walk_file(file)
    if (
        not len(file.chunks)
        and not file.runs
        and file.cut < 0
        and not file.names.channels
        and not (file.summary or file.data_end[0] >= 0)
    ):
        raise LogError(
            f"{path} ends after {len(data)} bytes without a channel or message; the recording was stopped before "
            "anything was written, copy or record it again"
        )
    return file


def _take_summary(file: McapFile, summary: Summary) -> None:
    """Take everything from a summary that accounts for the whole file."""
    file.chunks = listed_chunks(summary)
    file.indexes = summary.indexes.copy()
    file.indexes[:, 2] = -1
    for entry in summary.metadata:
        if entry.offset >= summary.start or file.data[entry.offset] != fmt.METADATA:
            file.lost(
                "index", f"the index lists metadata {entry.name[:80]!r} at byte {entry.offset}, where there is none"
            )
            continue
        take_record(file, fmt.METADATA, entry.offset, entry.offset + entry.length)
    end = len(fmt.MAGIC) + 9 + int.from_bytes(file.data[len(fmt.MAGIC) + 1 : len(fmt.MAGIC) + 9].tobytes(), "little")
    take_record(file, fmt.HEADER, len(fmt.MAGIC), end)
    file.attachments = [
        AttachmentInfo(a.name, a.media_type, a.data_size, a.log_time, a.create_time) for a in summary.attachments
    ]
