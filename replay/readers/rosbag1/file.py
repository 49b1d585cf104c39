"""Opening of a ROS 1 bag: its header, and its connections and chunks from the index section or from a walk."""

from __future__ import annotations

import struct
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from replay.errors import LogError
from replay.log.reading_notes import Report
from replay.readers.rosbag1.bag import Bag, Chunk
from replay.readers.rosbag1.connections import DAMAGED, fields_of, take_connection
from replay.readers.rosbag1.reconcile import Info, counts_behind, take_entries, take_info
from replay.readers.rosbag1.records_kernel import (
    CHUNK,
    CONNECTION,
    HEADER,
    INDEX,
    INFO,
    MESSAGE,
    BagRecords,
    end_of_chunk,
    scan_bag,
)

MAGIC = b"#ROSBAG V"
_VERSION = b"#ROSBAG V2.0\n"


def open_bag(path: Path, report: Report, whole: bool) -> Bag:
    """Open a bag from its index section, or walk all of it.

    Parameters
    ----------
    path : Path
        The bag.
    report : Report
        Takes what is damaged.
    whole : bool
        Account for every byte; otherwise the file is walked only where its index section is damaged or absent.

    Raises
    ------
    LogError
        Where the file is empty, unreadable, encrypted or not a bag of version 2.0.
    """
    try:
        if path.stat().st_size == 0:
            raise LogError(f"{path} is empty (0 bytes); the recording was not written, copy or record it again")
        data: NDArray[np.uint8] = np.memmap(path, np.uint8, "r")
    except OSError as error:
        raise LogError(f"{path} cannot be read: {error.strerror or error}") from error
    first = data[: len(_VERSION)].tobytes()
    if first.startswith(MAGIC) and first != _VERSION:
        raise LogError(f"{path} is not a ROS bag of version 2.0; found {first!r}; convert it with `rosbag migrate`")
    bag = Bag(path, data, report)
    if first != _VERSION:
        bag.lost(f"its first line is damaged; found {first!r}, expected {_VERSION!r}")
    header = _header(bag)
    index = None if header is None or not 0 < header[0] <= len(data) else scan_bag(data, header[0])
    sound = header is not None and index is not None and _sound(index, header)
    if header is None:
        bag.lost("its header record is damaged; the whole file was walked instead")
    elif header[0] == 0:
        bag.lost("it has no index (the recorder was not closed); its complete chunks were read in order")
    elif not sound:
        bag.lost(
            f"its index section at byte {header[0]} is damaged or cut off (it should hold {header[1]} connections and "
            f"{header[2]} chunks); the whole file was walked instead"
        )
    if sound and not whole and index is not None and header is not None and _from_index(bag, index, header[0]):
        return bag
    _walk(bag)
    return bag


def _header(bag: Bag) -> tuple[int, int, int] | None:
    """Index position, connection and chunk counts; None where the header record is damaged."""
    first = scan_bag(bag.data, len(_VERSION), min(len(bag.data), len(_VERSION) + (1 << 16)))
    if not len(first.op) or first.op[0] != HEADER or first.head[0] != len(_VERSION) + 4:
        return None
    try:
        fields = fields_of(bag.data[int(first.head[0]) : int(first.body[0]) - 4].tobytes())
        if fields.get("encryptor"):
            raise LogError(
                f"{bag.path} is encrypted ({fields['encryptor'][:80].decode('utf-8', 'replace')!r}); "
                "decrypt it with `rosbag decrypt` first"
            )
        (place,) = struct.unpack("<Q", fields["index_pos"])
        (connections,) = struct.unpack("<I", fields["conn_count"])
        (chunks,) = struct.unpack("<I", fields["chunk_count"])
    except DAMAGED:
        return None
    return place, connections, chunks


def _sound(index: BagRecords, header: tuple[int, int, int]) -> bool:
    """Whether the index section is complete and holds what the bag's header says."""
    named, infos = np.unique(index.conn[index.op == CONNECTION]), int(np.count_nonzero(index.op == INFO))
    known = np.isin(index.op, (CONNECTION, INFO)).all()
    return not index.lost and not index.mended and bool(known) and (len(named), infos) == header[1:]


def _infos(bag: Bag, records: BagRecords) -> dict[int, Info]:
    """First and last stamp and messages per connection of each chunk by its place, from chunk-info records."""
    out = {}
    for i in np.flatnonzero(records.op == INFO).tolist():
        head, body, size = int(records.head[i]), int(records.body[i]), int(records.size[i])
        try:
            fields = fields_of(bag.data[head : body - 4].tobytes())
            (place,) = struct.unpack("<Q", fields["chunk_pos"])
            first, last = (
                s * 1_000_000_000 + n for s, n in (struct.unpack("<II", fields[k]) for k in ("start_time", "end_time"))
            )
            pairs = np.frombuffer(bag.data[body : body + size - size % 8].tobytes(), "<u4").reshape(-1, 2)
            if (len(pairs),) != struct.unpack("<I", fields["count"]):
                raise ValueError("it counts other connections than it holds")
            out[place] = first, last, dict(pairs.tolist())
        except DAMAGED as error:
            bag.lost(f"the chunk-info record at byte {head - 4} is damaged ({type(error).__name__})")
    return out


def _chunk(bag: Bag, head: int, body: int, packed: int) -> Chunk:
    fields = fields_of(bag.data[head : body - 4].tobytes())
    (size,) = struct.unpack("<I", fields["size"])
    return Chunk(head - 4, body, packed, size, fields["compression"].decode("ascii", "replace"))


def _from_index(bag: Bag, index: BagRecords, until: int) -> bool:
    """Take connections and chunks from the index section at `until`; False where what stands before it contradicts it."""
    infos = _infos(bag, index)
    if len(infos) != np.count_nonzero(index.op == INFO):
        return False
    chunks = []
    starts = sorted(infos)
    for place, after in pairwise([*starts, until]):
        first, last, counts = infos[place]
        try:
            (size,) = struct.unpack("<I", bag.data[place : place + 4].tobytes())
            body = place + 8 + size
            (packed,) = struct.unpack("<I", bag.data[body - 4 : body].tobytes())
            chunk = _chunk(bag, place + 4, body, packed)
        except DAMAGED:
            return False
        if body + packed > min(after, len(bag.data)):
            return False
        behind = counts_behind(scan_bag(bag.data, body + packed, after))
        if behind and behind != {n: c for n, c in counts.items() if c}:
            return False
        chunk.first_ns, chunk.last_ns, chunk.stated = first, last, counts
        chunks.append(chunk)
    for i in np.flatnonzero(index.op == CONNECTION).tolist():
        take_connection(bag, bag.data, index, i)
        bag.listed.add(int(index.conn[i]))
    bag.chunks = chunks
    return True


def _walk(bag: Bag) -> None:
    """Walk the whole file; every byte belongs to a record or is reported."""
    at = len(_VERSION)
    infos: dict[int, Info] = {}
    while at < len(bag.data):
        records = scan_bag(bag.data, at)
        infos |= _infos(bag, records)
        for i in np.flatnonzero(records.op == CONNECTION).tolist():
            take_connection(bag, bag.data, records, i)
            bag.listed.add(int(records.conn[i]))
        _take_chunks(bag, records)
        if np.any(records.op == MESSAGE):
            bag.loose.append(records)
        at = _behind(bag, records)
    listed = bool(infos)
    for chunk in bag.chunks:
        if chunk.start in infos:
            take_info(bag, chunk, infos.pop(chunk.start))
        elif listed and not chunk.cut:
            bag.lost(f"the index section does not list the chunk at byte {chunk.start}; it was read all the same")
    for place, (_, _, counts) in sorted(infos.items()):
        bag.lost(f"there is no chunk at byte {place}, where the index names one with {sum(counts.values())} messages")
        for number, count in counts.items():
            bag.absent[number] = bag.absent.get(number, 0) + count


def _take_chunks(bag: Bag, records: BagRecords) -> None:
    """Take chunks, and from the index records behind each what it holds."""
    places = np.flatnonzero(records.op == CHUNK)
    index = np.flatnonzero(records.op == INDEX)
    edges = np.searchsorted(index, np.append(places, len(records.op)))
    for k, i in enumerate(places.tolist()):
        head, body, size = int(records.head[i]), int(records.body[i]), int(records.size[i])
        try:
            chunk = _chunk(bag, head, body, size)
        except DAMAGED as error:
            bag.lost(f"the chunk at byte {head - 4} has a damaged header ({type(error).__name__})")
            chunk = Chunk(head - 4, body, size, 0, "", cut=True)
        bag.chunks.append(chunk)
        mine = index[edges[k] : edges[k + 1]]
        if len(mine):
            take_entries(bag, chunk, records, mine)


def _behind(bag: Bag, records: BagRecords) -> int:
    """Report what a walk passed over, and return where the next one starts."""
    rest = len(bag.data) - records.end
    cut = _overlong(bag, records.end) if rest else None
    lost = records.lost - (rest if cut is not None else 0)
    if lost > 0:
        bag.lost(f"{lost} bytes in {records.gaps - (cut is not None)} places (the first at byte {records.first}) "
                 "hold no complete record and were left out")  # fmt: skip
    if records.mended:
        bag.lost(f"{records.mended} records have a damaged length; they were read up to the next record")
    if cut is None:
        return len(bag.data)
    stop = end_of_chunk(bag.data, cut.body)
    cut.packed = stop - cut.body
    bag.chunks.append(cut)
    return stop


def _overlong(bag: Bag, at: int) -> Chunk | None:
    """Return the chunk at `at` that seems to reach beyond the end of the file, if there is one."""
    try:
        (size,) = struct.unpack("<I", bag.data[at : at + 4].tobytes())
        if size > 4096:
            return None
        chunk = _chunk(bag, at + 4, at + 8 + size, 0)
    except DAMAGED:
        return None
    bag.lost(f"the chunk at byte {at} reaches beyond the end of the file; the part that is there was read")
    chunk.cut = True
    return chunk
