"""Parts of one table that a logger wrote as several files, put together: each goes on where the one before ended."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from replay.log.raw_log import Channel, LogSummary, RawLog

_PAUSE_NS = 5_000_000_000  # between the parts of one recording


def joined_tables(logs: Sequence[RawLog]) -> list[RawLog]:
    """Logs with the parts of each table as one, which has the first part's name.

    Parts are tables of one format and the same columns, of which each begins within five seconds of the end of the one before. Parts
    whose times begin anew in each file are none.

    Parameters
    ----------
    logs : Sequence[RawLog]
        As read.

    Returns
    -------
    list[RawLog]
        In the given order, each table with the source of its first part, and in its place.
    """
    chains: list[list[int]] = []
    order = sorted(range(len(logs)), key=lambda i: logs[i].summary.start_ns)
    for i in order:
        before = next((c for c in chains if _goes_on(logs[c[-1]], logs[i])), None)
        if before is None:
            chains.append([i])
        else:
            before.append(i)
    return [_joined([logs[i] for i in chain]) for chain in sorted(chains)]


def _goes_on(before: RawLog, after: RawLog) -> bool:
    """Whether a table goes on where another one ended."""
    tables = all(t.encoding == "table" for log in (before, after) for t in log.summary.topics)
    alike = before.format == after.format and [*before.channels] == [*after.channels] and bool(before.channels)
    pause = after.summary.start_ns - before.summary.stop_ns
    return tables and alike and 0 < pause <= _PAUSE_NS


def _joined(parts: Sequence[RawLog]) -> RawLog:
    """One log of several parts, in the order of their times."""
    first, *rest = parts
    if not rest:
        return first
    shared: dict[int, NDArray[np.int64]] = {}  # channels of one table stand on one time column
    channels: dict[str, Channel] = {}
    for name, channel in first.channels.items():
        same = [part.channels[name] for part in parts]
        if id(channel.stamps) not in shared:
            shared[id(channel.stamps)] = first.store.keep(np.concatenate([c.stamps for c in same]))
        values = first.store.keep(np.concatenate([c.values for c in same]))
        channels[name] = replace(channel, stamps=shared[id(channel.stamps)], values=values)
    return replace(first, channels=channels, summary=_summary([part.summary for part in parts]))


def _summary(parts: Sequence[LogSummary]) -> LogSummary:
    first = parts[0]
    topics = tuple(
        replace(topic, count=sum(p.topics[i].count for p in parts if i < len(p.topics)))
        for i, topic in enumerate(first.topics)
    )
    return replace(
        first,
        stop_ns=parts[-1].stop_ns,
        topics=topics,
        notes=tuple(dict.fromkeys(n for p in parts for n in p.notes)),
        damage=tuple(dict.fromkeys(d for p in parts for d in p.damage)),
    )
