"""What the parts of a ROS 1 bag say of one another: a bag has no checksums, but states most things twice.

The index section (chunk-info records) counts each chunk's messages and bounds their stamps; the index records behind a
chunk hold connection, stamp and place of each of its messages; the messages themselves say all that once more. Where
these disagree one of them was changed, and which one nothing tells: the messages are read as they stand, and it is said.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from replay.readers.rosbag1.bag import Bag, Chunk
from replay.readers.rosbag1.connections import fields_of
from replay.readers.rosbag1.records_kernel import INDEX, MESSAGE, BagRecords

_ENTRY = 12
_SHOWN = 4
Info = tuple[int, int, dict[int, int]]


def take_entries(bag: Bag, chunk: Chunk, records: BagRecords, rows: NDArray[np.int64]) -> None:
    """Take the index records behind a chunk: what they count, and where they stand. `rows` of shape (k,)."""
    chunk.entries, chunk.stated = [], {}
    for i in rows.tolist():
        number, body, size = int(records.conn[i]), int(records.body[i]), int(records.size[i])
        chunk.entries.append((number, body, size))
        chunk.stated[number] = chunk.stated.get(number, 0) + size // _ENTRY
        count = fields_of(bag.data[int(records.head[i]) : body - 4].tobytes()).get("count", b"")
        if size % _ENTRY or (len(count) == 4 and int.from_bytes(count, "little") != size // _ENTRY):
            bag.lost(
                f"the index of connection {number} behind the chunk at byte {chunk.start} states "
                f"{int.from_bytes(count, 'little')} messages and holds {size} bytes, {_ENTRY} for each"
            )


def counts_behind(records: BagRecords) -> dict[int, int]:
    """Messages per connection by the index records behind a chunk."""
    rows = np.flatnonzero(records.op == INDEX)
    counts: dict[int, int] = {}
    for number, size in zip(records.conn[rows].tolist(), records.size[rows].tolist(), strict=True):
        counts[number] = counts.get(number, 0) + size // _ENTRY
    return counts


def take_info(bag: Bag, chunk: Chunk, info: Info) -> None:
    """Take what the index section says of a chunk; where the index behind the chunk says otherwise, neither is believed."""
    chunk.first_ns, chunk.last_ns, counts = info
    counts = {n: c for n, c in counts.items() if c}
    behind = None if chunk.stated is None else {n: c for n, c in chunk.stated.items() if c}
    if behind is not None and behind != counts:
        bag.lost(
            f"the chunk at byte {chunk.start}: the index section counts {_counted(bag, counts, behind)} messages, the index "
            f"behind the chunk {_counted(bag, behind, counts)}; its messages were read as they stand"
        )
        chunk.stated = None
    else:
        chunk.stated = counts


def _counted(bag: Bag, mine: Mapping[int, int], other: Mapping[int, int]) -> str:
    differ = [n for n in sorted(mine.keys() | other.keys()) if mine.get(n, 0) != other.get(n, 0)]
    parts = [f"{mine.get(n, 0)} of {bag.named(n)}" for n in differ[:_SHOWN]]
    return ", ".join(parts) + (" and others" if len(differ) > _SHOWN else "")


def check_messages(bag: Bag, chunk: Chunk, records: BagRecords) -> None:
    """Hold the messages of an opened chunk against its index records and against the bounds that the index section states."""
    rows = np.flatnonzero(records.op == MESSAGE)
    stamps = records.stamp[rows]
    if chunk.entries:
        theirs = [_entries(bag.data, body, size) for _, body, size in chunk.entries]
        numbers = np.repeat([n for n, _, _ in chunk.entries], [len(t) for t, _ in theirs]).astype(np.int64)
        indexed = np.stack((np.concatenate([p for _, p in theirs]), numbers, np.concatenate([t for t, _ in theirs])))
        held = np.stack((records.head[rows] - 4, records.conn[rows], stamps))
        wrong = _differing(indexed, held)
        if wrong:
            bag.lost(
                f"the chunk at byte {chunk.start}: {wrong} of its {len(rows)} messages are not as the index behind it says "
                "(connection, stamp or place); they were read as they stand"
            )
    if not len(rows) or chunk.first_ns < 0:
        return
    first, last = int(stamps.min()), int(stamps.max())
    if (first, last) != (chunk.first_ns, chunk.last_ns):
        bag.lost(
            f"the chunk at byte {chunk.start}: its stamps reach from {first} to {last} ns, the index section says "
            f"{chunk.first_ns} to {chunk.last_ns}; they were read as they stand"
        )


def _entries(data: NDArray[np.uint8], body: int, size: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Stamps [ns] and places of the entries of one index record."""
    words = np.frombuffer(data[body : body + size - size % _ENTRY].tobytes(), "<u4").reshape(-1, 3).astype(np.int64)
    return words[:, 0] * 1_000_000_000 + words[:, 1], words[:, 2]


def _differing(one: NDArray[np.int64], other: NDArray[np.int64]) -> int:
    """How many columns of two tables, each in the order of its first row, are not those of the other."""
    one, other = one[:, np.argsort(one[0], kind="stable")], other[:, np.argsort(other[0], kind="stable")]
    if one.shape == other.shape:
        return int(np.count_nonzero((one != other).any(axis=0)))
    shared = np.isin(one[0], other[0])
    return int(max(one.shape[1], other.shape[1])) - int(np.count_nonzero(shared))
