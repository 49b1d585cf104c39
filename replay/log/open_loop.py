"""The mark of a log into which faults were written: a topic in message logs, a column in tables.

Such a log holds signals under their canonical names, in SI; what a machine file says of the original's channels and time
column does not apply to it.
"""

from __future__ import annotations

from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from replay.log.raw_log import LogSummary

TOPIC = "/mfhca/open_loop"
COLUMN = "mfhca.open_loop"
_HEAD = 1 << 16


def is_open_loop(summary: LogSummary) -> bool:
    """Whether a log carries the mark."""
    return any(t.name == TOPIC or COLUMN in t.fields for t in summary.topics)


def is_open_loop_table(path: Path) -> bool:
    """Whether a file is a table whose head names the mark; False where it cannot be read."""
    try:
        with path.open("rb") as file:
            head = file.read(_HEAD)
        if head.startswith(b"PAR1"):
            return COLUMN in pq.read_schema(path).names
    except (OSError, pa.ArrowException):
        return False
    return COLUMN.encode() in head and b"\0" not in head
