"""The channel that a source of the machine file names, and its stamps and values."""

from __future__ import annotations

from fnmatch import fnmatch
from pathlib import PurePath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from replay.log.raw_log import Channel, RawLog
from replay.log.source_options import SignalSource


def is_source(path: str, pattern: str | None) -> bool:
    """Whether a log's path is one that a pattern of files names; every one without a pattern."""
    return pattern is None or fnmatch(PurePath(path).name, pattern) or fnmatch(path, pattern)


def slashed(topic: str) -> str:
    """A topic's name with one slash before it."""
    return "/" + topic.lstrip("/")


def find_channel(log: RawLog, source: SignalSource) -> Channel | None:
    """Return the channel that a source names: by its name, for tables also by the shown name."""
    if source.topic is not None:
        parts = (source.field,) if source.field != "pose.pose.orientation" else ("pose.pose.orientation.w",)
        for topic in (source.topic, slashed(source.topic), source.topic.lstrip("/")):
            for part in parts:
                if (found := log.channels.get(f"{topic}.{part}")) is not None:
                    return found
        return None
    wanted = (source.symbol or source.column or "").strip()
    if wanted in log.channels:
        return log.channels[wanted]
    shown = [c for c in log.channels.values() if not c.topic and wanted in (c.field, c.name.partition(" [")[0])]
    return shown[0] if len(shown) == 1 else None


def channel_data(log: RawLog, channel: Channel, source: SignalSource) -> tuple[NDArray[np.int64], NDArray[Any]]:
    """Stamps [ns] and values of a channel, each of shape (n,); a quaternion becomes its yaw [rad]."""
    if source.field == "pose.pose.orientation":
        parts = [log.channels.get(f"{channel.topic}.pose.pose.orientation.{a}") for a in "xyzw"]
        if any(p is None for p in parts):
            return channel.stamps, np.full(len(channel.stamps), np.nan)
        x, y, z, w = (np.asarray(p.values, np.float64) for p in parts if p is not None)
        yaw = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
        yaw[np.abs(x * x + y * y + z * z + w * w - 1) > 0.1] = np.nan
        good = np.isfinite(yaw)
        yaw[good] = np.unwrap(yaw[good])
        return channel.stamps, yaw
    values = np.asarray(channel.values)
    if not channel.topic:
        return _sparse(channel.stamps, values)
    return channel.stamps, values


def _sparse(stamps: NDArray[np.int64], values: NDArray[Any]) -> tuple[NDArray[np.int64], NDArray[Any]]:
    """Drop the empty cells of a slow column beside fast ones; cells of a silent channel stay empty."""
    if values.dtype.kind != "f":
        return stamps, values
    rows = sparse_rows(values)
    return stamps[rows], values[rows]


def sparse_rows(values: NDArray[Any]) -> NDArray[np.int64]:
    """Rows of a slow column beside fast ones that hold its samples; all rows where the column is not slow.

    From shape (n,) to (k,).
    """
    rows = np.flatnonzero(~np.isnan(values))
    steps = np.diff(rows)
    if len(rows) < 3 or len(rows) > 0.6 * len(values):
        return np.arange(len(values))
    usual = np.median(steps)
    regular = float((np.abs(steps - usual) <= max(1.0, 0.2 * usual)).mean())
    return rows if usual >= 2 and regular > 0.8 else np.arange(len(values))
