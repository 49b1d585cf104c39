"""Messages that rosbag2 compressed one by one."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np
import zstandard

from replay.log.reading_notes import Report
from replay.readers.messages.connection import Block

_HELD = 64 << 20
MAX_MESSAGE = 64 << 20  # of one message


def unpacked(blocks: Iterable[Block], name: str, report: Report) -> Iterator[list[Block]]:
    """Expand the messages of blocks of one buffer, in the order of their places (stated slow path).

    Parameters
    ----------
    blocks : Iterable[Block]
        Blocks of one buffer.
    name : str
        The recording, for what is told.
    report : Report
        Takes the count of messages that cannot be expanded.

    Yields
    ------
    list[Block]
        Blocks of one buffer of bounded size each.

    Raises
    ------
    ZstdError
        Where the data are damaged or expand beyond all measure.
    """
    given = list(blocks)
    if not given:
        return
    data = given[0].data
    starts = np.concatenate([b.starts for b in given])
    lengths = np.concatenate([b.lengths for b in given])
    owner = np.repeat(np.arange(len(given)), [len(b.starts) for b in given])
    row = np.concatenate([np.arange(len(b.starts)) for b in given])
    expander = zstandard.ZstdDecompressor(max_window_size=1 << 28)
    parts: list[bytes] = []
    keep: list[int] = []
    held = bad = 0
    for i in np.argsort(starts, kind="stable").tolist():
        frame = data[starts[i] : starts[i] + lengths[i]].tobytes()
        try:
            if zstandard.get_frame_parameters(frame).content_size > MAX_MESSAGE:
                raise zstandard.ZstdError("declared size")
            parts.append(expander.decompress(frame, max_output_size=MAX_MESSAGE))
        except zstandard.ZstdError:
            bad += 1
            continue
        keep.append(i)
        held += len(parts[-1])
        if held > _HELD:
            yield list(_joined(given, owner[keep], row[keep], parts))
            parts, keep, held = [], [], 0
    if keep:
        yield list(_joined(given, owner[keep], row[keep], parts))
    if bad:
        report.lost(f"{name}: {bad} compressed messages are damaged; they were left out")


def _joined(
    given: list[Block], owner: np.ndarray[tuple[int], np.dtype[np.int64]],
    row: np.ndarray[tuple[int], np.dtype[np.int64]], parts: list[bytes],
) -> Iterator[Block]:  # fmt: skip
    lengths = np.fromiter(map(len, parts), np.int64, len(parts))
    data, starts = np.frombuffer(b"".join(parts), np.uint8), np.cumsum(lengths) - lengths
    for k, block in enumerate(given):
        mine = owner == k
        if mine.any():
            rows = row[mine]
            publish = None if block.publish_ns is None else block.publish_ns[rows]
            yield replace(
                block, data=data, starts=starts[mine], lengths=lengths[mine], log_ns=block.log_ns[rows],
                publish_ns=publish,
            )  # fmt: skip
