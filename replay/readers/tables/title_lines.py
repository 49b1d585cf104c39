"""Lines above the header of a table: ``Maschine:;Radlader 14``, as many programs write them before the names of the columns."""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Sequence

from replay.readers.tables.text_file import TextFile, decoded
from replay.readers.tables.units_row import units_of_row

LOOKED_AT = 100


def title_lines(lines: Sequence[str], separator: str) -> int:
    """How many of a table's first lines stand above its header; 0 where the first line is the header, or none can be told.

    A line is the header where it has as many cells as most lines, more than half of them filled, none of them a number, and
    no line below it and above the first row of numbers has more cells filled, a row of units aside.

    Parameters
    ----------
    lines : Sequence[str]
        The first lines, blank ones too; `LOOKED_AT` of them are looked at.
    separator : str
        Between cells.
    """
    rows = [_cells(line, separator) for line in lines[:LOOKED_AT]]
    (width, _), *_ = Counter(len(row) for row in rows if any(row)).most_common(1) or [(0, 0)]
    first = next((i for i, row in enumerate(rows) if len(row) == width and _is_data(row)), 0)
    for i in range(first):
        row = rows[i]
        below = [
            j
            for j in range(i + 1, first)
            if _may_name(rows[j], width) and units_of_row(lines[j], separator, row) is None
        ]
        if _may_name(row, width) and all(_filled(rows[j]) <= _filled(row) for j in below):
            return i
    return 0


def skip_titles(file: TextFile, head: bytes, at: int, separator: str) -> int:
    """Bytes of the lines above a table's header; the file's report gets a note of them.

    Parameters
    ----------
    file : TextFile
        The table.
    head : bytes
        Its beginning.
    at : int
        Where the first line begins [bytes].
    separator : str
        Between cells.
    """
    raw = head[at:].split(b"\n", LOOKED_AT)[:LOOKED_AT]
    lines = [decoded(line).rstrip("\r") for line in raw]
    above = title_lines(lines, separator)
    titles = [line.strip(separator + " ") for line in lines[:above] if line.strip(separator + " ")]
    if titles:
        shown = "; ".join(title[:60] for title in titles[:3]) + ("; …" if len(titles) > 3 else "")
        file.report.note(f"{file.path.name}: its header is its line {above + 1}; above it: {shown}")
    return sum(len(line) + 1 for line in raw[:above])


def is_number(cell: str) -> bool:
    """Whether a cell holds a number, with a decimal point or comma."""
    # possessive: a cell of very many digits is looked at once
    return re.fullmatch(r"\s*+\"?[+-]?(\d++([.,]\d*+)?|[.,]\d++)([eE][+-]?\d++)?\"?\s*+", cell) is not None


def _cells(line: str, separator: str) -> list[str]:
    try:
        row = next(csv.reader([line], delimiter=separator), [])
    except csv.Error:
        row = line.split(separator)
    return [cell.strip() for cell in row]


def _filled(row: Sequence[str]) -> int:
    return sum(1 for cell in row if cell)


def _is_data(row: Sequence[str]) -> bool:
    numbers = sum(is_number(cell) for cell in row)
    return numbers > 0 and 2 * numbers >= _filled(row)


def _may_name(row: Sequence[str], width: int) -> bool:
    return len(row) == width > 1 and 2 * _filled(row) > width and not any(is_number(cell) for cell in row)
