"""Which column of a table is time, and in which unit."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from replay.errors import LogError
from replay.readers.clocks import Report
from replay.readers.columns import unit_of
from replay.sources import SourceOptions

_TIME = re.compile(
    r"^(t|time|times?tamp|stamp|rel(ative)?[ _]?time|elapsed([ _]?time)?|date[ _]?time|zeit|zeitstempel|seconds?|secs?|"
    r"header\.stamp|log_time)([ _.]?(s|sec|ms|us|ns|nsec))?$"
)
_SUFFIX = re.compile(r"[ _.](s|sec|ms|us|ns|nsec)$")
_UNITS = {"s": "s", "sec": "s", "seconds": "s", "ms": "ms", "us": "us", "µs": "us", "ns": "ns", "nsec": "ns"}


def find_time(path: Path, frame: pd.DataFrame, options: SourceOptions, report: Report) -> tuple[str, str]:
    """Name and unit of the time column: as given, by its name, or the first that only rises.

    Raises
    ------
    LogError
        Where the given column does not exist or none can be found.
    """
    names = [str(c) for c in frame.columns]
    if options.time is not None:
        wanted = options.time.strip()
        if wanted not in names:
            raise LogError(f"{path} has no column {wanted!r} for time; its columns are {', '.join(names[:12])}")
        return wanted, "iso" if frame[wanted].dtype.kind == "M" else options.time_unit
    called = [n for n in names if _TIME.match(_bare(n).lower())]
    for name in [n for n in called if _rises(frame[n])] or [n for n in names if _rises(frame[n])]:
        unit = _time_unit(name, frame[name], options)
        how = "by its name" if name in called else "because it only rises"
        report.note(f"{path.name}: time is column {name!r} in {unit}, found {how}; [sources] time and time_unit set it")
        return name, unit
    raise LogError(
        f"{path} has no time column (none rises); give [sources] time; its columns are {', '.join(names[:12])}"
    )


def _bare(name: str) -> str:
    """Name without a unit in brackets."""
    return re.sub(r"\s*[\[(][^\[\]()]*[\])]\s*$", "", name).strip()


def _rises(column: pd.Series[Any]) -> bool:
    """Whether a column never falls, and rises in most steps; a rare step back is allowed."""
    if column.dtype.kind == "M":
        values: NDArray[Any] = column.dropna().to_numpy().astype(np.int64)
    elif column.dtype.kind in "iuf":
        values = column.dropna().to_numpy()
    else:
        moments = pd.to_datetime(column.dropna().head(2000), errors="coerce", utc=True, format="ISO8601").dropna()
        values = moments.dt.tz_localize(None).to_numpy().astype(np.int64)
    if len(values) < 2 or len(values) < 0.9 * min(len(column), 2000):
        return len(column) == 1 and len(values) == 1
    steps = np.diff(values.astype(np.float64))
    return bool((steps >= 0).mean() > 0.99 and (steps > 0).mean() > 0.5)


def _time_unit(name: str, column: pd.Series[Any], options: SourceOptions) -> str:
    """Unit of a time column that was found: stated in the options or the name, else by size and step."""
    if column.dtype.kind not in "iuf":
        return "iso"
    if options.time_unit != "s":
        return options.time_unit
    suffix = _SUFFIX.search(_bare(name).lower())
    stated = unit_of(name) or (suffix.group(1) if suffix else "")
    if stated.lower() in _UNITS:
        return _UNITS[stated.lower()]
    size = float(column.abs().max())
    for unit, low, high in (("ns", 1e18, 4e18), ("filetime", 1.2e17, 1.6e17), ("us", 1e15, 4e15), ("ms", 1e12, 4e12)):
        if low < size < high:
            return unit
    whole = column.dtype.kind in "iu"
    step = float(np.median(np.diff(column.dropna().to_numpy().astype(np.float64)))) if len(column) > 1 else 1.0
    return "ms" if whole and 2 <= step <= 5000 else "s"
