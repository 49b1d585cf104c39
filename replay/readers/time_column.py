"""Which column of a table is time, and in which unit."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
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

Sample = Mapping[str, NDArray[Any]]


def find_time(path: Path, sample: Sample, options: SourceOptions, report: Report) -> tuple[str, str]:
    """Name and unit of the time column: as given, by its name, or the first that only rises.

    Parameters
    ----------
    path : Path
        File, for messages.
    sample : Mapping[str, NDArray]
        First rows of each column: numbers, or ``datetime64[ns]`` for dates.
    options : SourceOptions
        Time column and unit, where given.
    report : Report
        Takes a note on what was found.

    Raises
    ------
    LogError
        Where the given column does not exist or none can be found.
    """
    names = list(sample)
    if options.time is not None:
        wanted = options.time.strip()
        if wanted not in sample:
            raise LogError(f"{path} has no column {wanted!r} for time; its columns are {_some(names)}")
        moment = sample[wanted].dtype.kind == "M" and options.time_unit != "dt"
        return wanted, "iso" if moment else options.time_unit
    called = [n for n in names if _TIME.match(_bare(n).lower())]
    for name in [n for n in called if rises(sample[n])] or [n for n in names if rises(sample[n])]:
        unit = _time_unit(name, sample[name], options)
        how = "by its name" if name in called else "because it only rises"
        report.note(f"{path.name}: time is column {name!r} in {unit}, found {how}; [sources] time and time_unit set it")
        return name, unit
    for name in called or names:
        if rises(sample[name], often=False):
            raise LogError(
                f"{path} has no time column that rises from row to row; {name!r} rises only now and then: if it counts "
                f"whole seconds (PLC DT), give [sources] time = {name!r} and time_unit = 'dt'"
            )
    raise LogError(f"{path} has no time column (none rises); give [sources] time; its columns are {_some(names)}")


def _some(names: list[str]) -> str:
    return ", ".join(names[:12])


def _bare(name: str) -> str:
    """Name without a unit in brackets."""
    return re.sub(r"\s*[\[(][^\[\]()]*[\])]\s*$", "", name).strip()


def _given(column: NDArray[Any]) -> NDArray[Any]:
    given: NDArray[Any]
    if column.dtype.kind == "M":
        given = column[~np.isnat(column)].astype(np.int64)
        return given
    given = column[~np.isnan(column)] if column.dtype.kind == "f" else column
    return given


def rises(column: NDArray[Any], often: bool = True) -> bool:
    """Whether a column never falls, and rises in most steps (or at all); a rare step back is allowed."""
    values = _given(column)
    if len(values) < 2 or len(values) < 0.9 * min(len(column), 2000):
        return often and len(column) == 1 and len(values) == 1
    steps = np.diff(values) if values.dtype.kind in "iM" else np.diff(values.astype(np.float64))
    ups = (steps > 0).mean()
    return bool((steps >= 0).mean() > 0.99 and (ups > 0.5 if often else ups > 0))


def _time_unit(name: str, column: NDArray[Any], options: SourceOptions) -> str:
    """Unit of a time column that was found: stated in the options or the name, else by size and step."""
    if column.dtype.kind == "M":
        return "iso"
    if options.time_unit != "s":
        return options.time_unit
    suffix = _SUFFIX.search(_bare(name).lower())
    stated = unit_of(name) or (suffix.group(1) if suffix else "")
    if stated.lower() in _UNITS:
        return _UNITS[stated.lower()]
    values = _given(column).astype(np.float64)
    size = float(np.abs(values).max())
    for unit, low, high in (("ns", 1e18, 4e18), ("filetime", 1.2e17, 1.6e17), ("us", 1e15, 4e15), ("ms", 1e12, 4e12)):
        if low < size < high:
            return unit
    step = float(np.median(np.diff(values))) if len(values) > 1 else 1.0
    return "ms" if column.dtype.kind in "iu" and 2 <= step <= 5000 else "s"
