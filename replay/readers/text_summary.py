"""How long a text table is, from its head and its tail."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from replay.readers.row_kernel import MISSING
from replay.readers.stamps import TimeBase
from replay.readers.textfile import BLOCK, TextFile

COUNTED = 256 << 20
PACKED = 8 << 20
_PIECE = 1 << 20


def row_count(file: TextFile, skip: int) -> tuple[int, bool]:
    """Lines behind the first `skip` bytes, and whether they were counted rather than estimated."""
    size = file.path.stat().st_size
    if file.packed and size > PACKED:
        head = file.head(BLOCK)
        share = file.position_after(BLOCK)
        return int(head.count(b"\n", skip) * size / max(share, 1)), False
    if not file.packed and size > COUNTED:
        head = file.head(BLOCK)
        return int(head.count(b"\n", skip) * (size - skip) / max(len(head) - skip, 1)), False
    lines, last = 0, b"\n"
    for piece in file.quiet(skip):
        lines += int(np.count_nonzero(np.frombuffer(piece, np.uint8) == 10))
        last = piece[-1:]
    return lines + (last != b"\n"), True


def span(base: TimeBase, head: NDArray[Any], tail: NDArray[Any] | None, count: int) -> tuple[int, int]:
    """First and last stamp of a table [ns].

    Parameters
    ----------
    base : TimeBase
        Of its time column.
    head, tail : NDArray
        Time cells of its first and last rows; without the latter the end follows from the usual step.
    count : int
        Number of rows.
    """
    first = base.stamps(head)
    first = first[first != MISSING]
    if not len(first):
        return 0, 0
    start, stop = int(first.min()), int(first.max())
    if tail is None:
        step = (stop - start) / max(len(first) - 1, 1)
        return start, max(stop, start + int(step * max(count - 1, 0)))
    last = base.stamps(tail)
    last = last[last != MISSING]
    return min(start, int(last.min(initial=start))), max(stop, int(last.max(initial=stop)))
