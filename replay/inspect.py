"""What a log holds and how well it was recorded: rates, gaps, jitter, clocks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from replay.rawlog import Channel, RawLog
from replay.readers.registry import open_log
from replay.sources import SourceOptions

GAP_PERIODS = 5.0


@dataclass(frozen=True)
class TopicTiming:
    """Timing of one topic, or of one group of table columns.

    Attributes
    ----------
    name, type_name : str
        As in `replay.rawlog.TopicInfo`.
    count : int
        Messages or rows by the container's index.
    rate_hz : float or None
        1 / median period [Hz]; None below two stamps.
    gaps : int
        Periods longer than `GAP_PERIODS` medians.
    longest_gap_s : float or None
        Longest period [s].
    jitter_p99_s : float or None
        99th percentile of |period − median| without the gaps [s].
    backwards, duplicates : int
        Stamps earlier than, and equal to, the one before.
    offset_s : float or None
        Median header stamp − log stamp [s]; None where only one clock exists.
    start_ns, stop_ns : int
        First and last stamp [ns]; 0 where there is none.
    note : str
        Why the topic was not decoded.
    """

    name: str
    type_name: str
    count: int
    rate_hz: float | None = None
    gaps: int = 0
    longest_gap_s: float | None = None
    jitter_p99_s: float | None = None
    backwards: int = 0
    duplicates: int = 0
    offset_s: float | None = None
    start_ns: int = 0
    stop_ns: int = 0
    note: str = ""


@dataclass(frozen=True)
class InspectReport:
    """Contents and timing of one log.

    Attributes
    ----------
    source, format : str
        As in `replay.rawlog.LogSummary`.
    start_ns, stop_ns : int
        First and last log stamp [ns].
    topics : tuple[TopicTiming, ...]
        Every topic.
    channels : tuple[str, ...]
        Names of all decoded channels.
    notes, damage : tuple[str, ...]
        One sentence each.
    metadata : Mapping[str, str]
        Stored in the container.
    """

    source: str
    format: str
    start_ns: int
    stop_ns: int
    topics: tuple[TopicTiming, ...]
    channels: tuple[str, ...]
    notes: tuple[str, ...] = ()
    damage: tuple[str, ...] = ()
    metadata: Mapping[str, str] = field(default_factory=dict)

    @property
    def duration_s(self) -> float:
        """Time between the first and the last log stamp [s]."""
        return (self.stop_ns - self.start_ns) / 1e9


def inspect_log(path: Path, options: SourceOptions) -> InspectReport:
    """Read a log and measure its timing on the clock of the options.

    Parameters
    ----------
    path : Path
        File or rosbag2 folder.
    options : SourceOptions
        How to read it.

    Raises
    ------
    LogError
        Where nothing in the log can be read.
    """
    reader = open_log(path)
    log = reader.read(path, options, None, options.stamp)
    summary = log.summary
    other: RawLog | None = None
    if any(t.encoding != "table" for t in summary.topics):
        other = reader.read(path, options, None, "log" if options.stamp != "log" else "header")
    stamps, against = _by_topic(log), {} if other is None else _by_topic(other)
    sign = -1 if options.stamp == "log" else 1
    topics = []
    for info in summary.topics:
        members = {f: log.channels[f] for f in info.fields if f in log.channels}
        own = next((c.stamps for c in members.values()), stamps.get(info.name))
        beside = against.get(info.name)
        offset = None
        if own is not None and beside is not None and len(own) == len(beside) and len(own):
            offset = sign * float(np.median(own - beside)) / 1e9
        topics.append(_timing(info.name, info.type_name, info.count, own, offset, info.note))
    return InspectReport(
        summary.source, summary.format, summary.start_ns, summary.stop_ns, tuple(topics), tuple(log.channels),
        summary.notes, summary.damage, summary.metadata,
    )  # fmt: skip


def _by_topic(log: RawLog) -> dict[str, NDArray[np.int64]]:
    """Stamps of each topic: those of its longest channel."""
    longest: dict[str, Channel] = {}
    for channel in log.channels.values():
        kept = longest.get(channel.topic)
        if kept is None or len(channel.stamps) > len(kept.stamps):
            longest[channel.topic] = channel
    return {topic: channel.stamps for topic, channel in longest.items()}


def _timing(
    name: str, type_name: str, count: int, stamps: NDArray[np.int64] | None, offset: float | None, note: str
) -> TopicTiming:
    if stamps is None or not len(stamps):
        return TopicTiming(name, type_name, count, note=note or "it holds no numbers")
    first, last = int(stamps.min()), int(stamps.max())
    if len(stamps) < 2:
        return TopicTiming(name, type_name, count, offset_s=offset, start_ns=first, stop_ns=last, note=note)
    steps = np.diff(stamps)
    forward: NDArray[np.float64] = np.diff(np.unique(stamps)).astype(np.float64) / 1e9
    usual = float(np.median(forward)) if len(forward) else 0.0
    gap = forward > GAP_PERIODS * usual
    calm = np.abs(forward[~gap] - usual)
    return TopicTiming(
        name,
        type_name,
        count,
        1.0 / usual if usual > 0 else None,
        int(gap.sum()),
        float(forward.max()) if len(forward) else None,
        float(np.percentile(calm, 99)) if len(calm) else None,
        int((steps < 0).sum()),
        int((steps == 0).sum()),
        offset,
        first,
        last,
        note,
    )
