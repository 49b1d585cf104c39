"""Plain text tables: CSV and the like (also gzip, zstd), written by a PLC, a database or a script."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from replay.arrays.column_store import ColumnStore
from replay.errors import LogError
from replay.log.raw_log import Clock, LogSummary, RawLog, TopicInfo, Window
from replay.log.reading_notes import Report
from replay.log.source_options import SourceOptions
from replay.readers.tables.columns import CellColumn
from replay.readers.tables.row_kernel import FIRST_LONG, FIRST_SHORT, FIRST_TEXT, LONG, MOMENT, REAL, SHORT, TEXT
from replay.readers.tables.rows import Rows
from replay.readers.tables.table_log import Finished, RowTimes, table_log
from replay.readers.tables.text_cells import text_columns
from replay.readers.tables.text_file import first_text
from replay.readers.tables.text_table import (
    HEAD,
    SEPARATORS,
    TextTable,
    is_text,
    open_text,
    row_count,
    separator_of,
    span,
)
from replay.readers.tables.time_cells import TimeBase, epoch_ns
from replay.readers.tables.time_column import Sample, TimeColumn, find_time, in_zone

_SAMPLES = (HEAD, 16 << 20)
_NAMED = (".csv", ".tsv")


class CsvReader:
    """Reader of plain text tables."""

    format = "csv"

    def matches(self, path: Path) -> bool:
        """Whether the file is text in rows of at least two cells of which most are numbers, or a header alone."""
        if not path.is_file():
            return False
        text = first_text(path)
        if text.count("\n") < 3 and len(text) > 30_000:
            text = first_text(path, 2 << 20)
        lines = [x for x in text.splitlines()[:50] if x.strip() and not x.startswith("#")]
        if len(lines) == 1 and any(s.lower() in _NAMED for s in path.suffixes):
            return any(mark in lines[0] for mark in SEPARATORS)
        return len(lines) > 1 and separator_of(lines) is not None

    def summarise(self, path: Path, options: SourceOptions) -> LogSummary:
        """List the columns from the table's head and tail; of a large one the rows are estimated.

        Raises
        ------
        LogError
            Where the table cannot be understood.
        """
        report = Report()
        table = open_text(path, options, report)
        sample, time = _time(table, options, report)
        name, unit, part, day_ns, zone = time
        last = table.file.tail(table.skip) if unit != "dc32" else b""
        tail = table.sample(last) if last else {}
        count, exact = row_count(table.file, table.skip)
        dated = sample[name].dtype.kind == "M"
        base = TimeBase(
            "iso" if dated else unit, epoch_ns(options, str(path), unit, day_ns), path.name, Report(), part, zone
        )
        start, stop = span(base, _cells(sample, time), _cells(tail, time), count)
        fields = tuple(n for n in table.names if n not in time.names and (n in sample or n in tail))
        note = "" if exact else "rows and end are estimated from the first rows; reading the file counts them"
        topic = TopicInfo(path.name, "table", count, "table", fields, note)
        return LogSummary(str(path), self.format, start, stop, (topic,), tuple(report.notes), tuple(report.damage))

    def read(
        self,
        path: Path,
        options: SourceOptions,
        topics: Collection[str] | None = None,
        clock: Clock = "header",
        window: Window | None = None,
        store: ColumnStore | None = None,
        texts: bool = False,
    ) -> RawLog:
        """Read all columns.

        Raises
        ------
        LogError
            Where the table cannot be understood or has no time column.
        """
        report = Report(store=store or ColumnStore())
        table = open_text(path, options, report)
        sample, time = _time(table, options, report)
        dated = time.unit == "iso" or sample[time.name].dtype.kind == "M"
        found = _read(table, time, dated, options, window, report.store)
        if not table.sure and any(_has_comma(cell) for cell in found.rows.examples.values()):
            found = _read(table.commas(), time, dated, options, window, report.store)
        report.damage += found.rows.report.damage
        return _log(table, found, report, clock, texts)


class _Found:
    """What one pass over a table gathered."""

    def __init__(self, rows: Rows, times: RowTimes, columns: dict[str, CellColumn]) -> None:
        self.rows, self.times, self.columns = rows, times, columns
        self.kept: list[NDArray[np.bool_]] = []


def _cells(columns: Sample, time: TimeColumn) -> tuple[NDArray[Any], ...] | None:
    """Cells of a table's time; None where a column of it is absent."""
    return tuple(columns[n] for n in time.names) if all(n in columns for n in time.names) else None


def _time(table: TextTable, options: SourceOptions, report: Report) -> tuple[Sample, TimeColumn]:
    """First rows, and the time column; more rows are looked at where few do not tell."""
    for size in _SAMPLES:
        head = table.file.head(table.skip + size)[table.skip :]
        whole = len(head) < size
        sample = table.sample(head if whole else head[: head.rfind(b"\n") + 1])
        try:
            said = Report()
            columns = sample if options.time is None else {n: sample.get(n, np.empty(0)) for n in table.names}
            time = find_time(table.file.path, columns, options, said, table.texts(head, columns))
            time = in_zone(table.file.path, time, options, said, table.texts(head, ()).get(time.name, ""))
        except LogError:
            if whole or size == _SAMPLES[-1]:
                raise
            continue
        for note in said.notes:
            report.note(note)
        return columns, time
    raise AssertionError("unreachable")


def _read(
    table: TextTable,
    time: TimeColumn,
    dated: bool,
    options: SourceOptions,
    window: Window | None,
    store: ColumnStore,
) -> _Found:
    """One pass over a table with this time column, which may hold dates."""
    report = Report(store=store)
    rows = table.rows(report)
    at = [table.names.index(n) for n in time.names]
    if dated:
        rows.kinds[at[0]] = MOMENT
    times = RowTimes(table.file.path, time, dated, options, window, report)
    columns = {n: CellColumn(store) for n in table.names if n not in time.names}
    order = [(i, columns[n]) for i, n in enumerate(table.names) if n not in time.names]
    found = _Found(rows, times, columns)
    for cells in table.blocks(rows):
        keep = times.keep(*(cells[i].view(np.float64) if rows.kinds[i] == REAL else cells[i] for i in at))
        found.kept.append(keep)
        whole = bool(keep.all())
        for i, column in order:
            column.append(cells[i] if whole else cells[i][keep], rows.kinds[i])
    return found


def _has_comma(cell: str) -> bool:
    whole, comma, part = cell.partition(",")
    return bool(comma) and part.isdigit() and whole.lstrip("+-").isdigit()


def _headers_again(table: TextTable, rows: Rows, texts: NDArray[Any], report: Report) -> int:
    """Count rows that repeat the header, as in several exports that were joined, and tell where the first stands."""
    odd = [i for i in np.flatnonzero((rows.columns[:, TEXT] > 0) & ~texts).tolist() if i in rows.examples]
    cells = {i: rows.examples[i].strip(' "\r') for i in odd}
    same = [i for i in odd if cells[i] and table.names[i].startswith(cells[i])]
    if len(same) < 2 or len(same) < 0.5 * len(odd):
        return 0
    count, at = int(min(rows.columns[i, TEXT] for i in odd)), int(min(rows.columns[i, FIRST_TEXT] for i in same))
    line, held = 1, 0
    for piece in table.file.quiet(0):
        line += piece.count(b"\n", 0, max(at - held, 0))
        held += len(piece)
        if held >= at:
            break
    what = "a second header" if count == 1 else f"{count} more headers, the first"
    report.lost(
        f"{table.file.path.name}: {what} in line {line}: the file holds several exports, one after the other; the rows of "
        "all were read"
    )
    return count


def _log(table: TextTable, found: _Found, report: Report, clock: Clock, with_texts: bool) -> RawLog:
    path, rows = table.file.path, found.rows
    if not rows.count:
        raise LogError(f"{path} has a header and no row of data; record or export it again")
    texts: NDArray[Any] = is_text(rows)
    again = _headers_again(table, rows, texts, report)
    found.times.base.rows -= again
    found.times.base.missing -= again
    for i, label in enumerate(table.names):
        bad = int(rows.columns[i, TEXT]) - again
        if bad > 0 and not texts[i] and label in found.columns:
            report.lost(f"{path.name}: {bad} cells of {label!r} are not numbers; they became empty ({rows.example(i)})")
    found.times.report = found.times.base.report = report
    if rows.table[SHORT]:
        report.lost(
            f"{path.name}: {rows.table[SHORT]} rows have fewer cells than the header (the first ends near byte "
            f"{rows.table[FIRST_SHORT]}); the rest of their cells is empty"
        )
    if rows.table[LONG]:
        report.lost(
            f"{path.name}: {rows.table[LONG]} rows have more cells than the header (the first at byte "
            f"{rows.table[FIRST_LONG]}); the cells beyond were left out"
        )
    kept: dict[str, Finished] = {n: c for n, c in found.columns.items() if not texts[table.names.index(n)]}
    left = [n for n in found.columns if n not in kept]
    if with_texts and left and (words := text_columns(table, left, np.concatenate(found.kept))):
        kept, left = kept | words, []
    return table_log(path, "csv", clock, found.times, kept, left, {})
