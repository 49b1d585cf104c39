"""Recorded channels and aligned signals as pandas tables, for notebooks and for joining with other data."""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

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
    """Rows are those of the channel with most samples, and those that only other channels have."""
    sets = list({id(c.stamps): c.stamps for c in channels}.values())
    stamps = max(sets, key=len)
    alike = all(s is stamps or np.array_equal(s, stamps) for s in sets)
    if alike:
        columns = {c.field: c.values for c in channels}
    else:
        keys = {id(s): _keys(s) for s in sets}
        rows = keys[id(stamps)]
        for other in keys.values():
            new = other.difference(rows, sort=False)
            rows = rows if new.empty else rows.append(new)
        stamps = rows.get_level_values(0).to_numpy()
        if len(rows) > len(keys[id(max(sets, key=len))]):
            rows = rows[np.argsort(stamps, kind="stable")]
            stamps = rows.get_level_values(0).to_numpy()
        columns = {c.field: pd.Series(c.values, index=keys[id(c.stamps)]).reindex(rows).to_numpy() for c in channels}
    frame = pd.DataFrame(columns, index=pd.to_datetime(stamps, utc=True).rename("time"))
    frame.attrs["units"] = {c.field: c.unit for c in channels if c.unit}
    frame.attrs["type"] = channels[0].type_name
    return frame


def _keys(stamps: NDArray[np.int64]) -> pd.MultiIndex:
    """Each stamp with how often it was there before: several messages may have the same."""
    before = pd.Series(stamps).groupby(stamps).cumcount().to_numpy()
    return pd.MultiIndex.from_arrays([stamps, before])


def timeline_frame(timeline: Timeline) -> pd.DataFrame:
    """All signals of a mission on its one time axis.

    Returns
    -------
    pd.DataFrame
        Indexed by time (UTC), one column per canonical name, SI; NaN where no sample is valid.
    """
    stamps = timeline.start_ns + timeline.step_ns * np.arange(timeline.size, dtype=np.int64)
    return pd.DataFrame(dict(timeline.signals), index=pd.to_datetime(stamps, utc=True).rename("time"))
