"""The mark of a log into which faults were written: a topic in message logs, a column in tables."""

from __future__ import annotations

from replay.rawlog import LogSummary

TOPIC = "/mfhca/open_loop"
COLUMN = "mfhca.open_loop"


def is_open_loop(summary: LogSummary) -> bool:
    """Whether a log carries the mark."""
    return any(t.name == TOPIC or COLUMN in t.fields for t in summary.topics)
