"""Plain text tables: their dialect, their header, and their rows."""

from __future__ import annotations

import csv
import io
import re
from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from replay.errors import LogError
from replay.log.reading_notes import Report
from replay.log.source_options import SourceOptions
from replay.readers.tables.columns import CellColumn, unique_names
from replay.readers.tables.row_kernel import FILLED, MISSING, MOMENT, TEXT
from replay.readers.tables.rows import MAX_COLUMNS, Dialect, Rows
from replay.readers.tables.text_file import BLOCK, TextFile, decoded
from replay.readers.tables.time_cells import TimeBase
from replay.readers.tables.title_lines import LOOKED_AT, is_number, skip_titles
from replay.readers.tables.units_row import units_of_row

SEPARATORS = ("\t", ";", ",", "|")
HEAD = 128 << 10
_LONGEST_HEAD = 4 << 20
_MOSTLY = 0.5
_SAMPLED = 1 << 21  # cells that a sample holds at most


@dataclass(frozen=True)
class TextTable:
    """A text table of which only the head has been read.

    Attributes
    ----------
    file : TextFile
        Its bytes.
    names : tuple[str, ...]
        Unique names of its columns.
    dialect : Dialect
        How its cells are written.
    skip : int
        Bytes before the first row.
    sure : bool
        Whether a decimal sign was seen (or given); else the first cell of text may show another one.
    """

    file: TextFile
    names: tuple[str, ...]
    dialect: Dialect
    skip: int
    sure: bool

    def commas(self) -> TextTable:
        """Return the same table with a decimal comma."""
        return replace(self, dialect=replace(self.dialect, decimal=","), sure=True)

    def rows(self, report: Report) -> Rows:
        """Return a parser of its rows."""
        return Rows(self.file.path.name, self.dialect, len(self.names), report)

    def blocks(self, rows: Rows) -> Iterator[NDArray[np.int64]]:
        """Parse all rows; see `Rows.blocks`. Each of shape (columns, rows)."""

        def end(text: bytes) -> bytes:
            return self._whole_rows(text, rows.report)

        return rows.blocks(self.file.blocks(self.skip), self.skip, end)

    def _whole_rows(self, text: bytes, report: Report) -> bytes:
        """Drop a last row that was cut off in the middle."""
        last = text[text.rfind(b"\n") + 1 :]
        if not last.strip(b"\0 \r") or last.count(self.dialect.separator.encode()) >= len(self.names) - 1:
            return text
        report.lost(f"{self.file.path.name} ends in the middle of a row, which was left out")
        return text[: len(text) - len(last)]

    def sample(self, text: bytes, dates: bool = True) -> dict[str, NDArray[Any]]:
        """First columns of some rows: int64, float64, or datetime64[ns] where they hold dates; no texts.

        Each of shape (rows,).

        Parameters
        ----------
        text : bytes
            Whole rows.
        dates : bool
            Whether texts are tried as dates.
        """
        rows = self.rows(Report())
        columns = _gathered(rows, text)
        out = dict(zip(self.names, columns, strict=True))
        texts = is_text(rows)
        if dates and texts.any():
            rows = self.rows(Report())
            rows.kinds[texts] = MOMENT
            columns = _gathered(rows, text)
            for i in np.flatnonzero(texts):
                out[self.names[i]] = columns[i].view("M8[ns]") if columns[i].dtype.kind == "i" else np.empty(0)
            texts &= is_text(rows)
        return {n: c for i, (n, c) in enumerate(out.items()) if not texts[i]}

    def texts(self, text: bytes, known: Collection[str]) -> dict[str, str]:
        """First cells of the columns that are not known, from the first of some rows."""
        cells = decoded(text.split(b"\n", 1)[0]).split(self.dialect.separator)
        return {n: c.strip(' "\r')[:40] for n, c in zip(self.names, cells, strict=False) if n not in known}


def _gathered(rows: Rows, text: bytes) -> list[NDArray[Any]]:
    """Columns of the first rows; of tiny cells not all, as each takes eight bytes."""
    columns = [CellColumn(rows.report.store) for _ in rows.kinds]
    left = max(_SAMPLED // max(len(columns), 1), 1)
    for cells in rows.blocks([text], 0):
        for column, kind, values in zip(columns, rows.kinds, cells, strict=True):
            column.append(values[:left], int(kind))
        left = max(left - cells.shape[1], 0)
    return [c.moments() if k == MOMENT else c.finish() for c, k in zip(columns, rows.kinds, strict=True)]


def is_text(rows: Rows) -> NDArray[np.bool_]:
    """Columns of which most cells that are not empty are neither numbers nor dates. Shape (columns,)."""
    found: NDArray[np.bool_] = rows.columns[:, TEXT] > _MOSTLY * rows.columns[:, FILLED]
    return found


def separator_of(lines: list[str]) -> str | None:
    """Separator under which most lines have the same number of cells and hold numbers, two cells at least."""
    best, score = None, 1.0
    for mark in SEPARATORS:
        try:
            rows = [row for row in csv.reader(lines, delimiter=mark) if row]
        except csv.Error:
            rows = [line.split(mark) for line in lines]
        width, agree = Counter(len(row) for row in rows).most_common(1)[0]
        cells = rows[-1] if len(rows) < 3 else rows[-2]
        numeric = sum(is_number(c) for c in cells)
        if width > 1 and agree * 2 > len(rows) and numeric and numeric * (mark != "," or 0.9) > score - 1:
            best, score = (mark, numeric + 1.0) if best is None or numeric > score - 1 else (best, score)
    return best


def open_text(path: Path, options: SourceOptions, report: Report) -> TextTable:
    """Read the head of a text table.

    Raises
    ------
    LogError
        Where it has no rows or no separator divides them.
    """
    file = TextFile(path, report)
    head = file.head(HEAD)
    if b"\n" not in head:
        head = file.head(_LONGEST_HEAD)
    if b"\n" not in head and len(head) >= _LONGEST_HEAD:
        raise LogError(f"{path}: its first line is longer than {_LONGEST_HEAD >> 20} MiB, so it is not a table")
    try:
        head.decode("utf-8")
    except UnicodeDecodeError as error:
        if error.end < len(head) - 3:
            report.note(f"{path.name} is not UTF-8; it was read as Windows-1252, so some letters may be wrong")
    skipped, at, stated = _first_line(head)
    lines = [x for x in decoded(head[at : at + HEAD]).splitlines()[:LOOKED_AT] if x.strip()]
    separator = options.separator or stated
    if separator is None and len(lines) > 1:
        separator = separator_of(lines)
    if len(lines) < 2:
        shown = f": {lines[0][:120]!r}" if lines else ""
        raise LogError(
            f"{path} has a header{shown} and no row of data; the recording ended before its first sample, or only the "
            "header was written; record or export it again"
        )
    if separator is None:
        raise LogError(f"{path}: no separator divides its rows; give [sources] separator for this file")
    if len(separator) != 1 or not separator.isascii():
        raise LogError(
            f"{path}: separator = {separator!r} is not one plain character; give [sources] separator such as ';'"
        )
    at += skip_titles(file, head, at, separator)
    names, size = _names(file, head, at, separator, skipped)
    skip = at + size
    below = head[skip : head.find(b"\n", skip) + 1]
    units = units_of_row(decoded(below), separator, names) if size else None
    if units is not None:
        names, skip = units, skip + len(below)
        report.note(f"{path.name}: the row below its header holds units")
    decimal, sure = _decimal(head[skip:] + file.tail(skip), separator)
    if options.decimal is not None:
        decimal, sure = options.decimal, True
    if decimal not in (".", ","):
        raise LogError(f"{path}: decimal = {decimal!r} is not a decimal sign; give [sources] decimal = '.' or ','")
    return TextTable(file, names, Dialect(separator, decimal, True), skip, sure)


def _first_line(head: bytes) -> tuple[bytes, int, str | None]:
    """Last comment before the first line, where that begins, and the separator that Excel states."""
    skipped, at = b"", 0
    while head.startswith((b"#", b"\n", b"\r\n", b" \n"), at) and (stop := head.find(b"\n", at)) >= 0:
        skipped = head[at:stop] if head.startswith(b"#", at) else skipped
        at = stop + 1
    stated = re.match(rb"sep=([^\r\n])\r?\n", head[at : at + 8])
    return skipped, at + (stated.end() if stated else 0), decoded(stated[1]) if stated else None


def _names(file: TextFile, head: bytes, at: int, separator: str, skipped: bytes) -> tuple[tuple[str, ...], int]:
    """Unique names of the columns, and how many bytes their header takes; 0 where there is none."""
    path, report = file.path, file.report
    names, size = _header(path, head[at:], separator)
    if len(names) > MAX_COLUMNS:
        raise LogError(f"{path} has {len(names)} columns; at most {MAX_COLUMNS} are read")
    if all(is_number(c) or not c for c in names):
        if file.tail(at).rstrip().endswith(b"EOF"):
            raise LogError(
                f'{path} looks like a TwinCAT Scope export without its header (header "None"), so its columns cannot be '
                "distinguished; export again with the full header"
            )
        named = [c.strip() for c in decoded(skipped).lstrip("# ").split(separator)]
        names = named if len(named) == len(names) else [f"column {i + 1}" for i in range(len(names))]
        report.note(f"{path.name} has no header; its columns are called {names[0]!r}, {names[-1]!r} and so on")
        size = 0
    while names and not names[-1]:
        names.pop()
    unique, repeated = unique_names(names)
    if repeated:
        report.note(f"{path.name}: names occur more than once and got a number: {', '.join(sorted(repeated)[:5])}")
    return tuple(unique), size


def _header(path: Path, head: bytes, separator: str) -> tuple[list[str], int]:
    """Names in the first record, and how many bytes it takes; quotes may enclose separators and line feeds."""
    reader = csv.reader(io.StringIO(decoded(head), newline="\n"), delimiter=separator)
    try:
        names = next(reader)
    except (csv.Error, StopIteration) as error:
        raise LogError(f"{path}: its header cannot be read ({error}); write column names in one line") from error
    size = 0
    for _ in range(reader.line_num):
        size = head.find(b"\n", size) + 1 or len(head)
    if reader.line_num > 5:  # a quote that nothing closes
        size = head.find(b"\n") + 1 or len(head)
        names = decoded(head[:size]).split(separator)
    return [n.strip() for n in names], size


def _decimal(text: bytes, separator: str) -> tuple[str, bool]:
    """Decimal sign of numbers in some rows, and whether one was seen."""
    mark = re.escape(separator.encode())
    edge = rb'(?:^|["\s]|' + mark + rb")"
    comma = separator != "," and re.search(edge + rb'[+-]?\d*,\d+(?:[eE][+-]?\d+)?(?=$|["\s]|' + mark + rb")", text)
    point = re.search(edge + rb'[+-]?\d*\.\d+(?:[eE][+-]?\d+)?(?=$|["\s]|' + mark + rb")", text)
    return ("," if comma and not point else "."), bool(comma or point) or separator == ","


COUNTED = 256 << 20
PACKED = 8 << 20
_PIECE = 1 << 20


def row_count(file: TextFile, skip: int) -> tuple[int, bool]:
    """Lines behind the first `skip` bytes, and whether they were counted rather than estimated."""
    size = file.path.stat().st_size
    if file.packed and size > PACKED:
        head = file.head(BLOCK)
        share = file.position_after(BLOCK)
        return int(head.count(b"\n", skip) * size / max(share, 1)), False
    if not file.packed and size > COUNTED:
        head = file.head(BLOCK)
        return int(head.count(b"\n", skip) * (size - skip) / max(len(head) - skip, 1)), False
    lines, last = 0, b"\n"
    for piece in file.quiet(skip):
        lines += int(np.count_nonzero(np.frombuffer(piece, np.uint8) == 10))
        last = piece[-1:]
    return lines + (last != b"\n"), True


def span(
    base: TimeBase, head: Sequence[NDArray[Any]] | None, tail: Sequence[NDArray[Any]] | None, count: int
) -> tuple[int, int]:
    """First and last stamp of a table [ns].

    Cells of shape (rows,) each.

    Parameters
    ----------
    base : TimeBase
        Of its time column.
    head, tail : Sequence[NDArray] or None
        Time cells of its first and last rows, one array per column of its clock; without the latter the end follows from
        the usual step.
    count : int
        Number of rows.
    """
    first = base.stamps(*head) if head is not None else np.empty(0, np.int64)
    first = first[first != MISSING]
    if not len(first):
        return 0, 0
    start, stop = int(first.min()), int(first.max())
    if tail is None:
        step = (stop - start) / max(len(first) - 1, 1)
        return start, max(stop, start + int(step * max(count - 1, 0)))
    last = base.stamps(*tail)
    last = last[last != MISSING]
    return min(start, int(last.min(initial=start))), max(stop, int(last.max(initial=stop)))
