"""Which column of a table is time, and in which unit."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from replay.errors import LogError
from replay.log.reading_notes import Report
from replay.log.source_options import SourceOptions
from replay.log.time_zone import NO_ZONE
from replay.readers.tables.columns import unit_of
from replay.readers.tables.split_time import Part, split_times, with_part

_TIME = re.compile(
    r"^(t|time|times?tamp|stamp|rel(ative)?[ _]?time|elapsed([ _]?time)?|date[ _]?time|seconds?|secs?|"
    r"zeit|uhrzeit|zeitstempel|zeitpunkt|datum[ _/]?(uhr)?zeit|temps|heure|horodatage|"
    r"header\.stamp|log_time)([ _.]?(s|sec|ms|us|ns|nsec))?$"
)
_LIKE_TIME = re.compile(r".*(time|date|zeit|datum|stamp|uhr|clock|heure|temps).*|t|dt|ts")
_DATE = re.compile(r"date|datum|tag|day|jour")
_DAY = 86_400_000_000_000  # ns
_ZONED = re.compile(r":\d\d([.,]\d+)? *(Z|z|[+-]\d\d(:?\d\d)?)$")
_OF_DAY = 15  # characters of a time of day
_SUFFIX = re.compile(r"[ _.](s|sec|ms|us|ns|nsec)$")
_TURN = 1 << 32
_FAR_S = 4e9  # seconds that nanoseconds since 1970 still count
_LONGEST_NAME = 60
_LONGEST_STEP = 5000  # a larger usual step is neither of seconds nor of milliseconds
_UNITS = {"s": "s", "sec": "s", "seconds": "s", "ms": "ms", "us": "us", "µs": "us", "ns": "ns", "nsec": "ns"}

_SIZES = (  # a distributed clock counts from 2000: years 2014 to 2031
    ("ns", 1e18, 4e18),
    ("dc", 4.6e17, 1e18),
    ("filetime", 1.2e17, 1.6e17),
    ("us", 1e15, 4e15),
    ("ms", 1e12, 4e12),
)

Sample = Mapping[str, NDArray[Any]]


class TimeColumn(NamedTuple):
    """Where the time of a table stands.

    Attributes
    ----------
    name, unit : str
        Column, and its unit as in `SourceOptions.time_unit`.
    part : Part or None
        Column with the parts of its whole seconds, where the clock stands in two columns.
    day_ns : int
        Midnight of the first row [ns since 1970], where a second column holds the dates of times of day.
    zone : str
        Time zone in which its dates are meant; empty: UTC, or the one that each states.
    """

    name: str
    unit: str
    part: Part | None = None
    day_ns: int = 0
    zone: str = ""

    @property
    def names(self) -> tuple[str, ...]:
        """Its columns, which are no signals."""
        return (self.name,) if self.part is None else (self.name, self.part.name)


def find_time(
    path: Path, sample: Sample, options: SourceOptions, report: Report, texts: Mapping[str, str] | None = None
) -> TimeColumn:
    """Time column: as given, seconds and nanoseconds in two columns, by its name, or the first that only rises.

    Samples of shape (rows,) each.

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
    texts : Mapping[str, str] or None
        First cell of each column of text.

    Raises
    ------
    LogError
        Where the given column does not exist, none can be found, or the unit of the one found cannot be told.
    """
    names = list(sample)
    if options.time is not None:
        wanted = options.time.strip()
        if wanted not in sample:
            raise LogError(f"{path} has no column {wanted!r} for time; its columns are {_some(names)}")
        if options.time_unit == "s" and turns(sample[wanted]):
            raise LogError(
                f"{path}: column {wanted!r} counts evenly and starts again at 2^32, so it is not in seconds; give [sources] "
                "time_unit = 'dc32' (a 32-bit distributed clock)"
            )
        moment = sample[wanted].dtype.kind == "M" and options.time_unit != "dt"
        return _split(path, sample, options, report) or TimeColumn(
            wanted, "iso" if moment else options.time_unit, None, _day(path, sample, wanted, options, report)
        )
    if (both := _split(path, sample, options, report)) is not None:
        return both
    called = [n for n in names if _TIME.match(_bare(n).lower())]
    rising = [n for n in names if rises(sample[n]) or turns(sample[n])]
    named = [n for n in called if n in rising]
    texts = texts or {}
    if not named:
        _refuse_text(path, texts, names, sure=bool(rising))
    for name in named or rising:
        unit = _time_unit(path, name, sample[name], options)
        how = "by its name" if name in called else _course(sample[name], unit)
        report.note(f"{path.name}: time is column {name!r} in {unit}, found {how}; [sources] time and time_unit set it")
        return TimeColumn(name, unit, None, _day(path, sample, name, options, report))
    for name in called or [n for n in names if _LIKE_TIME.fullmatch(n.lower())]:
        if rises(sample[name], often=False):
            raise LogError(
                f"{path} has no time column that rises from row to row; {name!r} rises only now and then: if it counts "
                f"whole seconds (PLC DT), give [sources] time = {name!r} and time_unit = 'dt'"
            )
    raise LogError(
        f"{path} has no time column (none rises); give [sources] time; its columns are {_some([*texts, *names])}"
    )


def in_zone(path: Path, time: TimeColumn, options: SourceOptions, report: Report, cell: str | None) -> TimeColumn:
    """A column of dates with the time zone that they are meant in, and a note on what was taken.

    Parameters
    ----------
    path : Path
        File, for messages.
    time : TimeColumn
        Its time column.
    options : SourceOptions
        With the zone, where one is given.
    report : Report
        Takes the note.
    cell : str or None
        Its first cell; None where dates are no text.
    """
    if time.unit != "iso":
        if options.time_zone is not None:
            report.note(
                f"{path.name}: [sources] time_zone is of no use: its time is no date, but a count in {time.unit}"
            )
        return time
    if cell is not None and _ZONED.search(cell.strip()):
        if options.time_zone is not None:
            report.note(f"{path.name}: [sources] time_zone is not used, as its dates state their zone")
        return time
    if options.time_zone is not None:
        return time._replace(zone=options.time_zone)
    if options.epoch is None and (time.day_ns or cell is None or len(cell.strip()) > _OF_DAY):
        report.note(
            f"{path.name}: {NO_ZONE} and were taken as UTC; if its clock shows another time, give "
            'time_zone = "Europe/Berlin" or whichever it is in [sources]'
        )
    return time


def _split(path: Path, sample: Sample, options: SourceOptions, report: Report) -> TimeColumn | None:
    """Clock in two columns, of which the whole seconds are the given column where one is given."""
    if options.time_unit != "s":
        return None
    wanted = None if options.time is None else options.time.strip()
    for name, part in split_times(sample):
        if wanted not in (None, name):
            continue
        seconds, cells = _given(sample[name]), sample[part.name]
        near = np.abs(seconds.astype(np.float64)) < _FAR_S
        if len(seconds) != len(cells) or near.mean() < 0.9:
            continue
        if rises(with_part(seconds[near].astype(np.int64) * 1_000_000_000, cells[near], part.unit_ns)):
            report.note(
                f"{path.name}: time is column {name!r} in s with {part.name!r} in {part.unit}; [sources] time sets it"
            )
            return TimeColumn(name, "s", part)
    return None


def _day(path: Path, sample: Sample, name: str, options: SourceOptions, report: Report) -> int:
    """Midnight of the date that stands in a column beside times of day [ns]; 0 where none does, or an epoch is given."""
    times = _given(sample[name])
    if sample[name].dtype.kind != "M" or options.epoch is not None or not len(times) or times.max() >= _DAY:
        return 0
    for other, column in sample.items():
        days = _given(column) if column.dtype.kind == "M" else np.empty(0, np.int64)
        if other != name and len(days) and _DATE.fullmatch(_bare(other).lower()) and not (days % _DAY).any():
            report.note(f"{path.name}: the date is column {other!r}; [sources] epoch sets it")
            return int(days[0])
    return 0


def _refuse_text(path: Path, texts: Mapping[str, str], names: list[str], sure: bool) -> None:
    """Raise a `LogError` where a column of text is called like time: surely, where another column might be it."""
    for name, cell in texts.items():
        bare = _bare(name).lower()
        if _TIME.match(bare) or bare in ("date", "datum") or (not sure and _LIKE_TIME.match(bare)):
            raise LogError(
                f"{path} has no time column that can be read; {name!r} looks like it, but its text {cell!r} is none of "
                "2025-08-19T08:00:00.25, 19.08.2025 08:00:00.25, 08/19/2025 08:00:00.25 AM or 08:00:00.25; write it like one "
                f"of these, or as seconds, or give [sources] time; its columns are {_some([*texts, *names])}"
            )


def _course(column: NDArray[Any], unit: str) -> str:
    """Say why a column was taken for time."""
    if unit == "dc32":
        return "because it rises and starts again at 2^32, like a 32-bit distributed clock"
    with np.errstate(over="ignore"):  # steps beyond the largest number
        back = int((np.diff(_given(column)) < 0).sum())
    return f"because it rises in all but {back} of its first {len(column)} rows" if back else "because it only rises"


def _some(names: list[str]) -> str:
    return ", ".join(name if len(name) <= _LONGEST_NAME else f"{name[:_LONGEST_NAME]}…" for name in names[:12])


def _bare(name: str) -> str:
    """Name without a unit in brackets."""
    return re.sub(r"\s*[\[(][^\[\]()]*[\])]\s*$", "", name).strip()


def _given(column: NDArray[Any]) -> NDArray[Any]:
    """Cells that can be a time: neither empty nor infinite."""
    given: NDArray[Any]
    if column.dtype.kind == "M":
        given = column[~np.isnat(column)].astype(np.int64)
        return given
    given = column[np.isfinite(column)] if column.dtype.kind == "f" else column
    return given


def rises(column: NDArray[Any], often: bool = True) -> bool:
    """Whether a column never falls, and rises in most steps (or at all); a rare step back is allowed.

    Of shape (rows,).
    """
    values = _given(column)
    if len(values) < 2 or len(values) < 0.9 * min(len(column), 2000):
        return often and len(column) == 1 and len(values) == 1
    with np.errstate(over="ignore"):
        steps = np.diff(values) if values.dtype.kind in "iM" else np.diff(values.astype(np.float64))
    ups = (steps > 0).mean()
    return bool((steps >= 0).mean() > 0.99 and (ups > 0.5 if often else ups > 0))


def turns(column: NDArray[Any]) -> bool:
    """Whether a column counts evenly and starts again at 2^32, as the lower half of a distributed clock does.

    Of shape (rows,).
    """
    values = _given(column)
    if len(values) < 3 or column.dtype.kind not in "iu" or values.min() < 0 or values.max() >= _TURN:
        return False
    ticks: NDArray[np.int64] = values.astype(np.int64)
    plain = ticks[1:] - ticks[:-1]
    steps = plain % _TURN
    usual = float(np.median(steps))
    turned = plain < -(_TURN // 2)
    return bool(
        turned.any() and 1e4 < usual < 1e9 and (turned == (plain < 0)).all() and (steps < 10 * usual).mean() > 0.95
    )


def _time_unit(path: Path, name: str, column: NDArray[Any], options: SourceOptions) -> str:
    """Unit of a time column that was found: stated in the options or the name, else by size and step.

    Raises
    ------
    LogError
        Where neither tells.
    """
    if column.dtype.kind == "M":
        return "iso"
    if options.time_unit != "s":
        return options.time_unit
    suffix = _SUFFIX.search(_bare(name).lower())
    stated = unit_of(name) or (suffix.group(1) if suffix else "")
    if stated.lower() in _UNITS:
        return _UNITS[stated.lower()]
    if turns(column):
        return "dc32"
    values = _given(column).astype(np.float64)
    size = float(np.abs(values).max())
    for unit, low, high in _SIZES:
        if low < size < high:
            return unit
    with np.errstate(over="ignore"):
        step = float(np.median(np.diff(values))) if len(values) > 1 else 1.0
    if step > _LONGEST_STEP:
        clock = ", 'dc32' (a 32-bit distributed clock)" if size < _TURN else ", 'dc' (a distributed clock)"
        raise LogError(
            f"{path}: column {name!r} rises by {step:.6g} from row to row, which can be neither seconds nor milliseconds; "
            f"give [sources] time = {name!r} and time_unit = 'us', 'ns'{clock} or what it is"
        )
    # lines that are no numbers, between header and rows, make the whole numbers below them floats
    whole = column.dtype.kind in "iu" or (values.size < column.size and bool((values == np.rint(values)).all()))
    return "ms" if whole and step >= 2 else "s"
