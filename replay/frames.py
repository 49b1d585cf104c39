"""Recorded channels and aligned signals as pandas tables, for notebooks and for joining with other data."""

from __future__ import annotations

import numpy as np
import pandas as pd

from replay.log.raw_log import Channel, RawLog
from replay.signals.timeline import Timeline


def log_frames(log: RawLog) -> dict[str, pd.DataFrame]:
    """One table per topic; of a table file, one per set of stamps.

    Parameters
    ----------
    log : RawLog
        From `replay.readers.registry.read_log`; with `texts` the tables hold texts too.

    Returns
    -------
    dict[str, pd.DataFrame]
        By topic, or by the file's groups ``group 1``, ``group 2`` …; indexed by time (UTC) in recorded order, one column
        per field as recorded. ``attrs["units"]`` holds the units that the log states, ``attrs["type"]`` the type of
        the messages. Fields that are not in every
        message have NaN elsewhere.
    """
    groups: dict[object, list[Channel]] = {}
    for channel in log.channels.values():
        groups.setdefault(channel.topic or id(channel.stamps), []).append(channel)
    named = {c[0].topic or f"group {i}": c for i, c in enumerate(groups.values(), 1)}
    return {name: _frame(channels) for name, channels in named.items()}


def _frame(channels: list[Channel]) -> pd.DataFrame:
    whole = max(channels, key=lambda c: len(c.stamps)).stamps
    columns = {}
    for channel in channels:
        series = pd.Series(channel.values, index=pd.Index(channel.stamps))
        if len(channel.stamps) != len(whole):
            series = series[~series.index.duplicated()].reindex(whole)
        columns[channel.field] = series.to_numpy()
    frame = pd.DataFrame(columns, index=pd.to_datetime(whole, utc=True).rename("time"))
    frame.attrs["units"] = {c.field: c.unit for c in channels if c.unit}
    frame.attrs["type"] = channels[0].type_name
    return frame


def timeline_frame(timeline: Timeline) -> pd.DataFrame:
    """All signals of a mission on its one time axis.

    Returns
    -------
    pd.DataFrame
        Indexed by time (UTC), one column per canonical name, SI; NaN where no sample is valid.
    """
    stamps = timeline.start_ns + timeline.step_ns * np.arange(timeline.size, dtype=np.int64)
    return pd.DataFrame(dict(timeline.signals), index=pd.to_datetime(stamps, utc=True).rename("time"))
