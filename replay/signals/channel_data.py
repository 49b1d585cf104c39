"""The channel that a source of the machine file names, and its stamps and values."""

from __future__ import annotations

from fnmatch import fnmatch
from pathlib import PurePath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from replay.log.raw_log import Channel, RawLog
from replay.log.source_options import SignalSource

_HALF_FILLED = 0.6  # of a table's rows: a column that fills more of them is not slow
_TOGETHER = 0.5  # of a column's rows that another fills too: both belong to one part of a merged table
_MET, _TOLD = 0.2, 0.8  # of a column's rows that other parts fill too, at most; of its empty ones, at least
_LOOKED_AT = 5000  # rows


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
        rows = own_rows(log, channel)
        return channel.stamps[rows], values[rows]
    return channel.stamps, values


def own_rows(log: RawLog, channel: Channel) -> NDArray[np.int64]:
    """Rows of a table that hold the samples of one of its columns: without the empty cells of a slow column beside fast ones.

    Empty cells of a silent channel stay, in which its neighbours go on.

    Parameters
    ----------
    log : RawLog
        Whose column it is.
    channel : Channel
        Of n rows.

    Returns
    -------
    NDArray[np.int64], shape (k,)
        Ascending numbers of rows; all n where the column is not slow.
    """
    values = np.asarray(channel.values)
    if values.dtype.kind != "f":
        return np.arange(len(values))
    rows = sparse_rows(values)
    if len(rows) < len(values):
        return rows
    return _of_its_part(log, channel, np.isfinite(values))


def _of_its_part(log: RawLog, channel: Channel, filled: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Rows of a column's part of a table that was put together from several, whose rows fill the columns of one part each.

    All rows where it was not. `filled`, shape (n,), are those that the column fills.
    """
    share = float(filled.mean()) if filled.size else 1.0
    if not 0.0 < share <= _HALF_FILLED or np.count_nonzero(filled) < 3:
        return np.arange(filled.size)
    own, empty = (_some(np.flatnonzero(where)) for where in (filled, ~filled))
    part, met, told = filled.copy(), np.zeros(own.size, bool), np.zeros(empty.size, bool)
    for other in log.channels.values():
        cells = np.asarray(other.values)
        if other.topic or other is channel or len(cells) != filled.size or cells.dtype.kind != "f":
            continue
        here = np.isfinite(cells[own])
        if here.mean() > _TOGETHER:
            part |= np.isfinite(cells)
        else:
            met |= here
            told |= np.isfinite(cells[empty])
    told |= part[empty]
    merged = met.mean() <= _MET and told.mean() >= _TOLD
    return np.flatnonzero(part) if merged else np.arange(filled.size)


def _some(rows: NDArray[np.int64]) -> NDArray[np.int64]:
    """Some of many rows, evenly spread."""
    return rows[:: max(1, rows.size // _LOOKED_AT)]


def sparse_rows(values: NDArray[Any]) -> NDArray[np.int64]:
    """Rows of a slow column beside fast ones that hold its samples; all rows where the column is not slow.

    From shape (n,) to (k,).
    """
    rows = np.flatnonzero(~np.isnan(values))
    steps = np.diff(rows)
    if len(rows) < 3 or len(rows) > _HALF_FILLED * len(values):
        return np.arange(len(values))
    usual = np.median(steps)
    regular = float((np.abs(steps - usual) <= max(1.0, 0.2 * usual)).mean())
    return rows if usual >= 2 and regular > 0.8 else np.arange(len(values))
