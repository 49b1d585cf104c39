"""What a log holds and how well it was recorded: rates, gaps, jitter, clocks."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from replay.inspection.mcap_index import mcap_index
from replay.inspection.report import Depth, InspectReport, OddValues, TopicTiming, mean_rate
from replay.inspection.values import odd_values
from replay.log.raw_log import Channel, LogSummary, RawLog, TopicInfo
from replay.log.source_options import SourceOptions
from replay.readers.registry import open_log

GAP_PERIODS = 5.0


def inspect_index(path: Path, options: SourceOptions) -> InspectReport:
    """Read a log's index.

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
    summary = open_log(path).summarise(path, options)
    seconds = (summary.stop_ns - summary.start_ns) / 1e9
    topics = tuple(
        TopicTiming(
            t.name, t.type_name, t.count, mean_rate(t.count, seconds), None, None, None, None, None, note=t.note,
            encoding=t.encoding, channels=len(t.fields) or None,
        )
        for t in summary.topics
    )  # fmt: skip
    return _report(path, summary, options, topics, (), "quick")


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
    summary, channels = log.summary, tuple(log.channels)
    stamps, numbers = _by_topic(log), Counter(c.topic for c in log.channels.values())
    grouped = {i: _group(log, info) for i, info in enumerate(summary.topics)}
    odd = _odd_values(log)
    del log  # the columns, before those of the other clock
    against: dict[str, NDArray[np.int64]] = {}
    if any(t.encoding != "table" for t in summary.topics):
        against = _by_topic(reader.read(path, options, None, "log" if options.stamp != "log" else "header"))
    sign = -1 if options.stamp == "log" else 1
    topics = []
    for i, info in enumerate(summary.topics):
        own, count = grouped[i] or (stamps.get(info.name), numbers[info.name])
        beside = against.get(info.name)
        offset = None
        if own is not None and beside is not None and len(own) == len(beside) and len(own):
            offset = sign * float(np.median(own - beside)) / 1e9
        timing = _timing(info.name, info.type_name, info.count, own, offset, info.note)
        decoded = 0 if own is None else len(own)
        topics.append(replace(timing, encoding=info.encoding, channels=count, decoded=decoded, odd_values=odd[i]))
    return _report(path, summary, options, tuple(topics), channels, "full")


def _report(
    path: Path,
    summary: LogSummary,
    options: SourceOptions,
    topics: tuple[TopicTiming, ...],
    channels: tuple[str, ...],
    depth: Depth,
) -> InspectReport:
    index = mcap_index(path, options.stamp) if summary.format == "mcap" else None
    attachments = getattr(summary, "attachments", ())
    return InspectReport(
        summary.source, summary.format, summary.start_ns, summary.stop_ns, topics, channels, summary.notes,
        summary.damage, summary.metadata, depth, _size(path), "own" if _is_table(summary) else options.stamp,
        _integrity(summary, depth), {} if index is None else index.container,
        tuple({"name": a.name, "media_type": a.media_type, "size": a.size} for a in attachments),
    )  # fmt: skip


def _is_table(summary: LogSummary) -> bool:
    return all(t.encoding == "table" for t in summary.topics)


def _integrity(summary: LogSummary, depth: Depth) -> str:
    """What checksums there are and which of them were verified."""
    kind = summary.metadata.get("integrity", "")
    if kind == "unverifiable" or _is_table(summary) or not kind:
        return "not every part has a checksum; damage there cannot be detected"
    if summary.damage:
        return "checksums; not all of the log is there or right"
    return "checksums, all read and right" if depth == "full" else "checksums; the data were not read"


def _size(path: Path) -> int:
    return sum(p.stat().st_size for p in path.rglob("*") if p.is_file()) if path.is_dir() else path.stat().st_size


def _group(log: RawLog, info: TopicInfo) -> tuple[NDArray[np.int64], int] | None:
    """Stamps and number of a table's columns, where the container lists them."""
    members = [log.channels[f] for f in info.fields if f in log.channels]
    return (members[0].stamps, len(members)) if members else None


def _odd_values(log: RawLog) -> list[tuple[OddValues, ...]]:
    """Give what each topic's samples lack."""
    members: dict[str, list[Channel]] = {}
    for channel in log.channels.values():
        members.setdefault(channel.topic, []).append(channel)
    return [
        odd_values([log.channels[f] for f in info.fields if f in log.channels] or members.get(info.name, []))
        for info in log.summary.topics
    ]


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
