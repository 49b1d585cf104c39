"""Plain tables: CSV (also gzip) and Parquet, written by a PLC, a database or a script."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from replay.errors import LogError
from replay.rawlog import Channel, Clock, LogSummary, RawLog, TopicInfo, Window
from replay.readers.clocks import Report
from replay.readers.columns import epoch_ns, numbers, parse, stamps, unit_of
from replay.readers.textfile import first_text, read_text
from replay.readers.time_column import find_time
from replay.sources import SourceOptions

_SEPARATORS = ("\t", ";", ",", "|")
_MAX_PARQUET = 16 << 30
_MAX_COLUMNS = 20_000


@dataclass(frozen=True)
class _Table:
    """Parsed columns, before one of them is time."""

    path: Path
    format: str
    frame: pd.DataFrame
    decimal: str
    metadata: dict[str, str]


class CsvReader:
    """Reader of plain text tables."""

    format = "csv"

    def matches(self, path: Path) -> bool:
        """Whether the file is text in rows of at least two cells of which most are numbers."""
        if not path.is_file():
            return False
        lines = [x for x in first_text(path).splitlines()[:50] if x.strip() and not x.startswith("#")]
        return len(lines) > 1 and _separator(lines) is not None

    def summarise(self, path: Path, options: SourceOptions) -> LogSummary:
        """List the columns; the file has no index, so it is read.

        Raises
        ------
        LogError
            Where the table cannot be understood.
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
        """Read all columns.

        Raises
        ------
        LogError
            Where the table cannot be understood or has no time column.
        """
        report = Report()
        return _build(_open_text(path, options, report), options, clock, report)


class ParquetReader:
    """Reader of Parquet files."""

    format = "parquet"

    def matches(self, path: Path) -> bool:
        """Whether the file starts with Parquet's magic bytes."""
        if not path.is_file():
            return False
        with path.open("rb") as file:
            return file.read(4) == b"PAR1"

    def summarise(self, path: Path, options: SourceOptions) -> LogSummary:
        """List the columns.

        Raises
        ------
        LogError
            Where the file cannot be read.
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
        """Read all columns of numbers.

        Raises
        ------
        LogError
            Where the file cannot be read or has no time column.
        """
        report = Report()
        return _build(_open_parquet(path), options, clock, report)


def _open_parquet(path: Path) -> _Table:
    try:
        with pq.ParquetFile(path, page_checksum_verification=True) as file:
            size = sum(file.metadata.row_group(i).total_byte_size for i in range(file.metadata.num_row_groups))
            if size > _MAX_PARQUET:
                raise LogError(f"{path} declares {size} bytes of columns; at most {_MAX_PARQUET} are read")
            flat = [f.name for f in file.schema_arrow if not pa.types.is_nested(f.type)]
            frame = file.read(columns=flat).to_pandas()
    except (pa.ArrowException, OSError, ValueError, KeyError, TypeError, OverflowError, MemoryError) as error:
        raise LogError(f"{path} is a damaged Parquet file ({error}); copy or write it again") from error
    if frame.index.name is not None:
        frame = frame.reset_index()
    frame.columns = pd.Index(_unique([str(c) for c in frame.columns])[0])
    return _Table(path, "parquet", frame, ".", {})


def _separator(lines: list[str]) -> str | None:
    """Separator under which most lines have the same number of cells and hold numbers, two cells at least."""
    best, score = None, 1.0
    for mark in _SEPARATORS:
        counts = Counter(len(line.split(mark)) for line in lines)
        width, agree = counts.most_common(1)[0]
        cells = lines[-1].split(mark) if len(lines) < 3 else lines[-2].split(mark)
        numeric = sum(_is_number(c) for c in cells)
        if width > 1 and agree * 2 > len(lines) and numeric and numeric * (mark != "," or 0.9) > score - 1:
            best, score = (mark, numeric + 1.0) if best is None or numeric > score - 1 else (best, score)
    return best


def _is_number(cell: str) -> bool:
    return re.fullmatch(r"\s*\"?[+-]?(\d+[.,]?\d*|[.,]\d+)([eE][+-]?\d+)?\"?\s*", cell) is not None


def _open_text(path: Path, options: SourceOptions, report: Report) -> _Table:
    text = read_text(path, report)
    skipped, text = _comments(text)
    lines = [line for line in text[:262_144].split("\n")[:50] if line.strip()]
    if len(lines) < 2:
        raise LogError(f"{path}: a header and at least one row of data were expected, {len(lines)} lines were found")
    separator = options.separator or _separator(lines)
    if separator is None:
        raise LogError(f"{path}: no separator divides its rows; give [sources] separator for this file")
    decimal = options.decimal or _decimal(lines, separator)
    head = [c.strip().strip('"').strip() for c in lines[0].split(separator)]
    if len(head) > _MAX_COLUMNS:
        raise LogError(f"{path} has {len(head)} columns; at most {_MAX_COLUMNS} are read")
    body = text
    if all(_is_number(c) or not c for c in head):
        named = [c.strip() for c in skipped.split(separator)]
        head = named if len(named) == len(head) else [f"column {i + 1}" for i in range(len(head))]
        report.note(f"{path.name} has no header; its columns are called {head[0]!r}, {head[-1]!r} and so on")
    else:
        body = text[text.index(lines[0]) + len(lines[0]) :]
    while head and not head[-1]:
        head.pop()
    names, repeated = _unique(head)
    if repeated:
        report.note(f"{path.name}: names occur more than once and got a number: {', '.join(sorted(repeated)[:5])}")
    body = _whole_rows(path, body, separator, len(names), report)
    try:
        frame = parse(body, separator, decimal, names, _long_times(names, options), quoted=True)
    except (pd.errors.ParserError, ValueError, OverflowError, MemoryError) as error:
        raise LogError(f"{path}: its rows cannot be parsed ({error}); give [sources] separator and decimal") from error
    return _Table(path, "csv", frame, decimal, {})


def _comments(text: str) -> tuple[str, str]:
    """Split off leading ``#`` lines; the last of them may be the header."""
    last = ""
    while text.startswith("#"):
        last, _, text = text.partition("\n")
    return last.lstrip("# "), text


def _decimal(lines: list[str], separator: str) -> str:
    cells = [c.strip() for line in lines[1:] for c in line.split(separator)]
    comma = any(re.fullmatch(r"[+-]?\d+,\d+([eE][+-]?\d+)?", c) for c in cells)
    point = any(re.fullmatch(r"[+-]?\d+\.\d+([eE][+-]?\d+)?", c) for c in cells)
    return "," if comma and not point else "."


def _unique(names: list[str]) -> tuple[list[str], set[str]]:
    out: list[str] = []
    repeated = set()
    for i, raw in enumerate(names):
        base = name = raw.strip() or f"column {i + 1}"
        number = 2
        while name in out:
            repeated.add(base)
            name, number = f"{base} ({number})", number + 1
        out.append(name)
    return out, repeated


def _long_times(names: list[str], options: SourceOptions) -> set[str]:
    """Time columns whose integers must stay exact although cells may be empty."""
    given = {n for n in names if options.time is not None and n == options.time.strip()}
    return given if options.time_unit in ("ns", "filetime") else set()


def _whole_rows(path: Path, body: str, separator: str, width: int, report: Report) -> str:
    """Drop a last row that was cut off in the middle."""
    if body.endswith("\n") or not body.strip():
        return body
    rest, _, last = body.rpartition("\n")
    if last.strip("\0 ") and last.count(separator) >= width - 1:
        return body
    report.lost(f"{path.name} ends in the middle of a row, which was left out")
    return rest + "\n"


def _build(table: _Table, options: SourceOptions, clock: Clock, report: Report) -> RawLog:
    path, frame = table.path, table.frame
    if not len(frame):
        raise LogError(f"{path} has a header and no row of data")
    name, unit = find_time(path, frame, options, report)
    epoch = epoch_ns(options, str(path))
    at, keep = stamps(frame[name], unit, epoch, table.decimal, f"{path.name}, column {name!r}", report)
    if not len(at):
        raise LogError(f"{path}: column {name!r} holds no readable time in {unit}; give [sources] time and time_unit")
    channels: dict[str, Channel] = {}
    texts = []
    for label in frame.columns:
        if label == name:
            continue
        values, bad = numbers(frame[label], table.decimal)
        if values is None:
            texts.append(str(label))
            continue
        if bad:
            report.lost(f"{path.name}: {bad} cells of {label!r} are no numbers; they became empty")
        kind = str(values.dtype)
        channels[label] = Channel(label, "", label, at, values[keep], unit_of(label), kind)
    if texts:
        report.note(f"{path.name}: columns of text were left out: {', '.join(texts[:6])}")
    topic = TopicInfo(path.name, "table", len(at), "table", tuple(channels))
    said = tuple(report.notes), tuple(report.damage)
    summary = LogSummary(str(path), table.format, int(at.min()), int(at.max()), (topic,), *said, table.metadata)
    return RawLog(str(path), table.format, clock, channels, summary)
