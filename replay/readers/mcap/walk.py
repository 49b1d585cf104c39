"""Walking all records of an MCAP file, and holding what was found against its summary."""

from __future__ import annotations

import zlib
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from replay.log.raw_log import AttachmentInfo
from replay.readers.mcap import format as fmt
from replay.readers.mcap import scan
from replay.readers.mcap.file import McapFile
from replay.readers.mcap.records import BAD_RECORD, MAX_RECORD, DataEnd, Header, Metadata, parse
from replay.readers.mcap.summary import Summary, read_summary, summary_from

_MOST_RECORDS = 1 << 18


def walk_file(file: McapFile) -> None:
    """Walk the whole file, where that was not yet done, and hold what was found against the summary."""
    if file.walked:
        return
    data, file.walked = file.data, True
    file.attachments, file.metadata_count = [], 0
    found = scan.walk(data, len(fmt.MAGIC), len(data), file.names.named.copy(), file.loose)
    rows = found.rows
    closed = bool(len(rows)) and rows[-1, 0] == fmt.FOOTER
    if closed and file.summary is None:
        file.summary = read_summary(data, int(rows[-1, 1]))
    ends = np.flatnonzero(rows[:, 0] == fmt.DATA_END)
    inside, behind = (rows[: ends[-1] + 1], rows[ends[-1] + 1 :]) if len(ends) else (rows, rows[:0])
    _say_ending(file, rows, closed)
    if closed:
        _check_footer(file, int(rows[-1, 1]), bool(len(ends)))
    if len(behind) > closed and (file.summary is None or not file.summary.sound):
        _mend_summary(file, behind, closed)
    if file.summary is not None:
        take_listed_names(file, file.summary)
        if closed and not file.summary.sound:
            file.lost("summary", "its summary is damaged (checksum or records); topics and counts may be wrong")
    if (behind[:, 0] == fmt.MESSAGE).any():  # what stands there is no part of the log and is not counted
        file.loose = scan.Tally()
        scan.walk(data, len(fmt.MAGIC), int(behind[0, 1]), file.names.named.copy(), file.loose)
    _say_left_behind(file, behind)
    _take_rows(file, inside, closed)
    if not closed:
        _find_cut(file, inside)
    _index_chunks(file, inside)


def _mend_summary(file: McapFile, behind: NDArray[np.int64], closed: bool) -> None:
    """Find a summary by the walk where the footer is missing or does not lead to it."""
    start, stop = int(behind[0, 1]), int(behind[-1, 1] if closed else behind[-1, 2])
    moved = read_summary(file.data, stop, start) if closed else None
    if moved is not None and moved.checked and moved.sound:
        file.lost("summary", f"its summary is at byte {start}, not where its footer says; its index was not used")
        file.summary = replace(moved, chunks=moved.chunks[:0], indexes=moved.indexes[:0])
    else:
        file.summary = summary_from(file.data, behind[behind[:, 3] == fmt.SOUND], (start, stop), False, False)


def _say_ending(file: McapFile, rows: NDArray[np.int64], closed: bool) -> None:
    if closed:
        end = int(rows[-1, 2])
        rest = file.data[end:]
        if rest.tobytes() != fmt.MAGIC:
            extra = len(rest) - len(fmt.MAGIC)
            text = f"{extra} bytes follow its end at byte {end + len(fmt.MAGIC)}; they were left out"
            if extra <= 0 or rest[: len(fmt.MAGIC)].tobytes() != fmt.MAGIC:
                text = f"its closing bytes after byte {end} are damaged or missing"
            file.lost("ending", text)
        return
    last = int(rows[-1, 1]) if len(rows) and rows[-1, 0] == fmt.HOLE else len(file.data)
    where = "after the data" if (rows[:, 0] == fmt.DATA_END).any() else "while data were written"
    file.report.lost(
        f"{file.path.name} ends without a footer ({where}): {len(file.data) - last} bytes after byte {last} "
        "hold no complete record"
    )


def _say_left_behind(file: McapFile, behind: NDArray[np.int64]) -> None:
    """Say which records of data stand behind the end of the data, where no recorder writes any."""
    for op, name in ((fmt.CHUNK, "chunk"), (fmt.MESSAGE, "message"), (fmt.ATTACHMENT, "attachment")):
        found = behind[behind[:, 0] == op]
        if len(found):
            count = int(found[:, 3].sum()) if op == fmt.MESSAGE else len(found)
            text = f"{count} {name}{'s' * (count > 1)} from byte {found[0, 1]} stand behind the end of its data and were left out"
            file.lost("record", text)


def _check_footer(file: McapFile, place: int, ended: bool) -> None:
    """Say where a footer contradicts what stands before it, as where the middle of a file is lost and its end is there."""
    stated = int.from_bytes(file.data[place + 9 : place + 17].tobytes(), "little")
    if stated and file.summary is None:
        file.lost(
            "summary", f"its footer names a summary at byte {stated}, where none is: what stood before it may be lost"
        )
    if not ended:
        file.lost("record", "the record that ends its data is missing or damaged: what stood there may be lost")


def _take_rows(file: McapFile, rows: NDArray[np.int64], closed: bool) -> None:
    op = rows[:, 0]
    runs = rows[op == fmt.MESSAGE]
    file.runs = [(a, b) for a, b in runs[:_MOST_RECORDS, 1:3].tolist()]
    if len(runs) > _MOST_RECORDS:
        count, at = int(runs[_MOST_RECORDS:, 3].sum()), int(runs[_MOST_RECORDS, 1])
        file.lost("record", f"{count} messages behind byte {at} were left out: the log is damaged in too many places")
    chunk = rows[op == fmt.CHUNK]
    file.chunks = np.concatenate((chunk[:, 1:3], scan.chunk_times(file.data, chunk)), axis=1)
    for _, start, _, _ in chunk[chunk[:, 3] == fmt.MENDED].tolist():
        file.lost(
            "mended",
            f"the opcode or a length of the chunk at byte {start} was damaged; it was recovered from the content",
        )
    plain = ~np.isin(op, (fmt.MESSAGE, fmt.CHUNK, fmt.MESSAGE_INDEX))
    few = rows[plain]
    if len(few) > _MOST_RECORDS:
        file.lost(
            "record", f"{len(few) - _MOST_RECORDS} records behind byte {few[_MOST_RECORDS, 1]} were left out: too many"
        )
    for code, start, stop, count in few[:_MOST_RECORDS].tolist():
        if code == fmt.HOLE:
            if closed or stop < len(file.data):
                file.lost("bytes", f"bytes {start} to {stop} hold no complete record and were left out")
        elif code > fmt.DATA_END:
            file.unknown.append((code, start, count))
        elif code in (fmt.SCHEMA, fmt.CHANNEL):
            file.names.take(code, file.data[start + 9 : stop].tobytes(), False, f"at byte {start}")
        else:
            take_record(file, code, start, stop)
    flawed = rows[(op == fmt.MESSAGE_INDEX) & (rows[:, 3] == fmt.MENDED)]
    for start in flawed[:, 1].tolist():
        file.lost("index", f"the message index at byte {start} is damaged")


def take_record(file: McapFile, op: int, start: int, stop: int) -> None:
    """Take one of the few records beside messages and their indexes; a damaged one is told, and left out."""
    try:
        if op == fmt.ATTACHMENT:
            _take_attachment(file, start, stop)
            return
        if stop - start > MAX_RECORD:
            raise ValueError("a record without end")
        record = parse(op, file.data[start + 9 : stop].tobytes())
    except BAD_RECORD as error:
        file.lost("record", f"record at byte {start} is damaged ({type(error).__name__})")
        return
    if isinstance(record, Header):
        file.metadata.update(profile=record.profile, library=record.library)
    elif isinstance(record, Metadata):
        file.metadata_count += 1
        file.metadata.update({f"{record.name}.{k}": v for k, v in record.metadata.items()})
    elif isinstance(record, DataEnd):
        file.data_end = (start, record.data_section_crc)


def _take_attachment(file: McapFile, start: int, stop: int) -> None:
    """Take an attachment's head and check its content where it stands, whatever its size."""
    data, body = file.data, start + 9
    log, created = (int.from_bytes(data[body + k : body + k + 8].tobytes(), "little") for k in (0, 8))
    texts, at = [], body + 16
    for _ in range(2):
        size = int.from_bytes(data[at : at + 4].tobytes(), "little")
        if at + 4 + size + 12 > stop:
            raise ValueError("a part reaches beyond its record")
        texts.append(data[at + 4 : at + 4 + size].tobytes().decode())
        at += 4 + size
    size = int.from_bytes(data[at : at + 8].tobytes(), "little")
    if at + 12 + size > stop:
        raise ValueError("its content reaches beyond its record")
    stated = int.from_bytes(data[at + 8 + size : at + 12 + size].tobytes(), "little")
    state = "none" if not stated else "right" if zlib.crc32(data[body : at + 8 + size].data) == stated else "wrong"
    if state == "wrong":
        file.lost("attachment", f"the checksum of the attachment {texts[0][:80]!r} at byte {start} differs")
    file.attachments.append(AttachmentInfo(texts[0], texts[1], size, log, created, state))


def _find_cut(file: McapFile, rows: NDArray[np.int64]) -> None:
    """Take the chunk that the end of the file cuts off, if one does."""
    if not len(rows) or rows[-1, 0] != fmt.HOLE or rows[-1, 2] != len(file.data):
        return
    start = int(rows[-1, 1])
    if file.data[start] == fmt.CHUNK and len(file.data) - start > 49:
        file.cut = start
        times = scan.chunk_times(file.data, rows[-1:])
        file.chunks = np.concatenate((file.chunks, np.concatenate((rows[-1:, 1:3], times), axis=1)))


def _index_chunks(file: McapFile, rows: NDArray[np.int64]) -> None:
    """Give each message index to the chunk before it, and hold chunks and indexes against the summary."""
    summary = file.summary
    if summary is not None and summary.checked:
        _add_listed(file, rows, listed_chunks(summary))
    found = rows[(rows[:, 0] == fmt.MESSAGE_INDEX) & (rows[:, 3] == fmt.SOUND)]
    holes = rows[rows[:, 0] == fmt.HOLE, 1]
    before = np.concatenate(([-1], file.chunks[:, 0]))[np.searchsorted(file.chunks[:, 0], found[:, 1])]
    owned = (before >= 0) & (np.concatenate(([-1], holes))[np.searchsorted(holes, found[:, 1])] <= before)
    counts = scan.index_counts(file.data, found)
    owner = np.searchsorted(file.chunks[:, 0], before[owned])
    file.indexes = np.concatenate((owner[:, None], counts[owned]), axis=1)
    file.orphans = counts[~owned]
    if summary is None or not summary.sound or not len(summary.chunks):
        return
    listed = listed_chunks(summary)
    for start, stop in listed[~np.isin(listed[:, 0], file.chunks[:, 0])][:, :2].tolist():
        file.lost("index", f"the index lists a chunk at byte {start} (to {stop}), where none was found")
    for start in file.chunks[~np.isin(file.chunks[:, 0], listed[:, 0])][:, 0].tolist():
        file.lost("index", f"the index does not list the chunk at byte {start}; it was read all the same")
    if (listed[1:, 0] < listed[:-1, 1]).any():
        file.lost("index", "the index lists chunks that overlap; each was read once")
    mine, theirs = np.isin(file.chunks[:, 0], listed[:, 0]), np.isin(listed[:, 0], file.chunks[:, 0])
    if mine.sum() == theirs.sum():
        differ = (file.chunks[mine] != listed[theirs]).any(axis=1)
        for start in file.chunks[mine][differ][:, 0].tolist():
            file.lost("index", f"the index and the chunk at byte {start} disagree about its length or stamps")
    places = np.sort(summary.indexes[:, 2])
    if len(places) and not np.array_equal(places, found[:, 1]):
        file.lost("index", "the summary and the message indexes in the file disagree about their places")


def _add_listed(file: McapFile, rows: NDArray[np.int64], listed: NDArray[np.int64]) -> None:
    """Take chunks that the index places where the walk found no record: their heads are damaged, maybe not all."""
    holes = rows[rows[:, 0] == fmt.HOLE, 1:3]
    missing = listed[~np.isin(listed[:, 0], file.chunks[:, 0])]
    if not len(holes) or not len(missing):
        return
    around = holes[np.maximum(np.searchsorted(holes[:, 0], missing[:, 0], "right") - 1, 0)]
    inside = missing[(around[:, 0] <= missing[:, 0]) & (missing[:, 1] <= around[:, 1]) & (missing[:, 0] >= 0)]
    inside = inside[np.unique(inside[:, 0], return_index=True)[1]]
    for start in inside[:, 0].tolist():
        file.lost("mended", f"the head of the chunk at byte {start} is damaged; it was found by the index")
    chunks = np.concatenate((file.chunks, inside))
    file.chunks = chunks[np.argsort(chunks[:, 0], kind="stable")]


def take_listed_names(file: McapFile, summary: Summary) -> None:
    """Take the schemas and channels that the summary repeats."""
    for op, raw, at in summary.names:
        file.names.take(op, raw, summary.checked, f"in the summary at byte {at}", data=False)


def listed_chunks(summary: Summary) -> NDArray[np.int64]:
    """Start, end, first and last stamp of the listed chunks. Shape (chunks, 4)."""
    first, last, start, length = summary.chunks[:, :4].T
    return np.stack((start, start + length, first, last), axis=1)
