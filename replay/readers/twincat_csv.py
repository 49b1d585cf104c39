"""Text exports of TwinCAT Scope, in both of its default dialects and those of older versions."""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from replay.errors import LogError
from replay.rawlog import Channel, Clock, LogSummary, RawLog, TopicInfo, Window
from replay.readers.clocks import Report
from replay.readers.columns import FILETIME_EPOCH, numbers, parse, stamps
from replay.readers.textfile import first_text, read_text
from replay.sources import SourceOptions

_ROWS = frozenset(
    (
        *("name", "symbolcomment", "data-type", "sampletime[ms]", "sampletime", "variablesize", "symbolbased"),
        *("indexgroup", "indexoffset", "symbolname", "netid", "port", "offset", "scalefactor", "bitmask"),
        *("unit", "unit scalefactor", "unit offset"),
    )
)
_START = ("starttime of export", "startrecord")
_STOP = ("endtime of export", "endrecord")
_HOW = "export again with a tab or semicolon as separator, a point as decimal sign, full header and one time line each"
_FULL_TIME = 10**15


@dataclass(frozen=True)
class _Scope:
    """A Scope export taken apart, before its cells are numbers."""

    path: Path
    separator: str
    decimal: str
    rows: dict[str, list[str]]
    times: list[int]
    width: int
    data: str
    start_ns: int | None
    metadata: dict[str, str]


class TwincatCsvReader:
    """Reader of TwinCAT Scope text exports."""

    format = "twincat"

    def matches(self, path: Path) -> bool:
        """Whether the file starts with Scope's ``Name`` line and its start time follows."""
        if not path.is_file():
            return False
        lines = first_text(path).splitlines()[:12]
        found = [line.strip().lower() for line in lines]
        return bool(found) and found[0].startswith("name") and any(f.startswith(_START) for f in found)

    def summarise(self, path: Path, options: SourceOptions) -> LogSummary:
        """List the groups of channels; the file has no index, so it is read.

        Raises
        ------
        LogError
            Where the export cannot be understood.
        """
        return self.read(path, options).summary

    def read(
        self,
        path: Path,
        options: SourceOptions,
        topics: Collection[str] | None = None,
        clock: Clock = "header",
        window: Window | None = None,
    ) -> RawLog:
        """Read all channels.

        Raises
        ------
        LogError
            Where the export cannot be understood; the message says how to export again.
        """
        report = Report()
        scope = _open(path, report)
        return _build(scope, options, clock, report)


def _open(path: Path, report: Report) -> _Scope:
    text = read_text(path, report)
    separator = text[len("Name") : len("Name") + 1]
    if separator in (" ", "\n", ""):
        raise LogError(f"{path}: a blank separates its columns, so that names cannot be told apart; {_HOW}")
    lines = text.split("\n", 4096)
    rows, metadata, last, start = _header(lines, separator)
    if "name" not in rows:
        raise LogError(f"{path}: it has no row of channel names; {_HOW}")
    first = _data_line(lines, last, separator, path)
    data = text[sum(len(line) + 1 for line in lines[:first]) :]
    data = _tail(path, data, "sampletime[ms]" in rows and "indexgroup" in rows, report)
    names = rows["name"]
    times = _time_columns(rows)
    width = _widest(data, separator)
    decimal = _decimal(data, separator, path)
    if times[:1] != [0] or len(times) == len(names):
        raise LogError(f'{path}: its time columns cannot be found (timelines "None"?); {_HOW}')
    if width > len(names):
        raise LogError(
            f"{path}: rows of data have {width} cells, its header names {len(names)} columns; {separator!r} is "
            f"probably both separator and decimal sign; {_HOW}"
        )
    if width < len(names) and times != [0]:
        report.note(f"{path.name}: its last {len(names) - width} columns hold no data")
    elif width == len(names) - 1:
        raise LogError(f'{path}: rows of data have one cell less than the header (timelines "None"?); {_HOW}')
    return _Scope(path, separator, decimal, rows, times, len(names), data, start, metadata)


def _header(lines: list[str], separator: str) -> tuple[dict[str, list[str]], dict[str, str], int, int | None]:
    """Channel rows by lower-case key, facts, line of the last header row, and start of the recording [ns]."""
    rows: dict[str, list[str]] = {}
    metadata: dict[str, str] = {}
    last, start = 0, None
    for i, line in enumerate(lines[:400]):
        cells = line.split(separator)
        key = cells[0].strip().lower()
        if i < 2 and key in ("name", "file"):
            metadata[f"scope.{key}"] = cells[1].strip() if len(cells) > 1 else ""
        elif key in _START or key in _STOP:
            last = i
            metadata[f"scope.{key.split()[0]}"] = " ".join(c.strip() for c in cells[1:] if c.strip())
            if key in _START and len(cells) > 1 and re.fullmatch(r"\d{17,19}", cells[1].strip()):
                start = (int(cells[1]) - FILETIME_EPOCH) * 100
        elif key in _ROWS and len(cells) > 1 and start_of_rows(rows, key):
            rows[key] = _trimmed(cells)
            last = i
    return rows, metadata, last, start


def start_of_rows(rows: dict[str, list[str]], key: str) -> bool:
    """Whether a row belongs to the channel header, which ``Name`` opens and in which each key occurs once."""
    return key not in rows and (key == "name" or "name" in rows)


def _trimmed(cells: list[str]) -> list[str]:
    cells = [c.strip() for c in cells]
    while cells and not cells[-1]:
        cells.pop()
    return cells


def _data_line(lines: list[str], last: int, separator: str, path: Path) -> int:
    """First line of data: after the header and a trigger table, its first cell is a number."""
    trigger = False
    for i in range(last + 1, len(lines)):
        line = lines[i]
        if line.lower().startswith("triggergroup"):
            trigger = True
        elif not line.strip():
            trigger = False
        elif not trigger and re.match(r"\s*[+-]?\d", line) and not lines[i - 1].strip():
            return i
    raise LogError(f"{path}: no row of data follows its header; the recording is empty or was cut off")


def _tail(path: Path, data: str, complete: bool, report: Report) -> str:
    """Cut ``EOF`` off; without it the full dialect was cut off, and its last row with it."""
    body = data.rstrip()
    if body.endswith("EOF"):
        return body[:-3]
    if complete:
        report.lost(f"{path.name} does not end in EOF; the export was cut off and its last row left out")
        body = body.rpartition("\n")[0]
    return body + "\n"


def _time_columns(rows: dict[str, list[str]]) -> list[int]:
    """Columns in which every row of full width repeats its own key."""
    width = len(rows["name"])
    full = {key: cells for key, cells in rows.items() if len(cells) == width}
    return [i for i in range(width) if all(cells[i].lower() == key for key, cells in full.items())]


def _widest(data: str, separator: str) -> int:
    """Most cells in one row, a trailing separator not counted."""
    raw = np.frombuffer(data.encode("utf-8", "replace"), np.uint8)
    mark = np.flatnonzero(raw == ord(separator))
    ends = np.flatnonzero(raw == ord("\n"))
    counts = np.diff(np.searchsorted(mark, ends), prepend=0)
    trailing = raw[ends - 1] == ord(separator)
    return int((counts - trailing).max(initial=0)) + 1


def _decimal(data: str, separator: str, path: Path) -> str:
    """Decimal sign of the data cells alone."""
    sample = data[:2_000_000]
    comma = separator != "," and re.search(r"\d,\d", sample) is not None
    point = re.search(r"\d\.\d", sample) is not None
    if comma and point:
        raise LogError(f"{path}: numbers hold both point and comma (thousands separators?); {_HOW}")
    return "," if comma else "."


def _build(scope: _Scope, options: SourceOptions, clock: Clock, report: Report) -> RawLog:
    names = [str(i) for i in range(scope.width)]
    full = [i for i in scope.times if _is_filetime(scope, i)]
    try:
        table = parse(scope.data, scope.separator, scope.decimal, names, {str(i) for i in full}, quoted=False)
    except (pd.errors.ParserError, ValueError, OverflowError, MemoryError) as error:
        raise LogError(f"{scope.path}: its rows of data cannot be parsed ({error}); {_HOW}") from error
    if scope.start_ns is None and not full:
        report.note(f"{scope.path.name} states no start time; its stamps count from zero")
    channels: dict[str, Channel] = {}
    topics = []
    labels = _labels(scope)
    for g, first in enumerate(scope.times):
        stop = scope.times[g + 1] if g + 1 < len(scope.times) else scope.width
        unit, epoch = ("filetime", 0) if first in full else ("ms", scope.start_ns or 0)
        column = table[str(first)]
        filled = _filled(column)
        at, keep = stamps(column[filled], unit, epoch, scope.decimal, f"{scope.path.name}, group {g + 1}", report)
        if len(at) > 1 and (np.diff(at) < 0).mean() > 0.5:
            raise LogError(f"{scope.path}: column {first + 1} should hold times but runs backwards; {_HOW}")
        members = []
        for i in range(first + 1, stop):
            values = _values(scope, table[str(i)][filled], i, options, labels[i], report)
            if values is not None:
                members.append(labels[i])
                channels[labels[i]] = Channel(
                    labels[i], "", scope.rows["name"][i], at, values[keep], _unit(_cell(scope, "unit", i)),
                    _cell(scope, "data-type", i),
                )  # fmt: skip
        period = _cell(scope, "sampletime[ms]", first + 1) or _cell(scope, "sampletime", first + 1)
        name = f"group {g + 1}" + (f" ({period} ms)" if period else "")
        topics.append(TopicInfo(name, "table", len(at), "table", tuple(members)))
    if not channels:
        raise LogError(f"{scope.path}: none of its columns holds numbers")
    used = [c.stamps for c in channels.values() if len(c.stamps)]
    start, stop = (int(min(s.min() for s in used)), int(max(s.max() for s in used))) if used else (0, 0)
    said = tuple(report.notes), tuple(report.damage)
    summary = LogSummary(str(scope.path), "twincat", start, stop, tuple(topics), *said, scope.metadata)
    return RawLog(str(scope.path), "twincat", clock, channels, summary)


def _is_filetime(scope: _Scope, column: int) -> bool:
    for line in scope.data[:200_000].split("\n"):
        cells = line.split(scope.separator)
        if column < len(cells) and (cell := cells[column].strip()):
            return cell.isdigit() and int(cell) > _FULL_TIME
    return False


def _filled(column: pd.Series[Any]) -> NDArray[np.bool_]:
    """Rows in which a group still has a time; groups of other lengths end earlier."""
    if column.dtype.kind in "iuf":
        return column.notna().to_numpy()
    return column.fillna("").astype(str).str.strip().ne("").to_numpy()


def _values(
    scope: _Scope, column: pd.Series[Any], index: int, options: SourceOptions, label: str, report: Report
) -> NDArray[Any] | None:
    values, bad = numbers(column, scope.decimal)
    if values is None:
        report.note(f"{scope.path.name}: {label} holds text and was left out")
        return None
    if bad:
        report.lost(f"{scope.path.name}: {bad} cells of {label} are no numbers; they became empty")
    if not options.scale:
        return values
    try:
        gain = float((_cell(scope, "scalefactor", index) or "1").replace(",", "."))
        offset = float((_cell(scope, "offset", index) or "0").replace(",", "."))
    except ValueError as error:
        raise LogError(f"{scope.path}: ScaleFactor or Offset of {label} is no number; drop scale = true") from error
    return values * gain + offset


def _cell(scope: _Scope, key: str, index: int) -> str:
    """Cell of a header row; rows that the separator tore apart are not used."""
    cells = scope.rows.get(key, [])
    return cells[index] if index < len(cells) <= scope.width else ""


def _unit(text: str) -> str | None:
    unit = text.partition("(")[0].strip()
    return unit or None


def _labels(scope: _Scope) -> list[str]:
    """Unique channel names: the symbol, else the shown name; a second of the same name gets its shown name."""
    out: list[str] = []
    for i in range(scope.width):
        shown = scope.rows["name"][i]
        label = _cell(scope, "symbolname", i) or shown or f"column {i + 1}"
        if label in out and i not in scope.times:
            label = shown if shown not in out else label
            number = 1
            while label in out:
                label, number = f"{shown or label} ({number})", number + 1
        out.append(label)
    return out
