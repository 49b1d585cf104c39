"""Columns of text in a table, for logs that are to be given as they were recorded."""

from __future__ import annotations

import codecs
import csv
from collections.abc import Iterator, Sequence
from itertools import compress
from typing import Any

import numpy as np
from numpy.typing import NDArray

from replay.readers.tables.text_table import TextTable

_LONGEST_CELL = 1 << 24


class TextColumn:
    """A growing column of texts; where there is none, None."""

    def __init__(self) -> None:
        self._values: list[str | None] = []
        self._words: dict[str, str] = {}

    def append(self, values: Sequence[str | None], keep: NDArray[np.bool_]) -> None:
        """Add the kept ones of some texts, both of shape (m,)."""
        for text in compress(values, keep.tolist()):
            self._values.append(None if text is None else self._words.setdefault(text, text))

    def finish(self) -> NDArray[Any]:
        """Return the texts as objects, shape (n,)."""
        out = np.empty(len(self._values), object)
        out[:] = self._values
        return out


def text_columns(table: TextTable, names: Sequence[str], keep: NDArray[np.bool_]) -> dict[str, TextColumn] | None:
    """Columns of text of a text table, in a pass of their own.

    Parameters
    ----------
    table : TextTable
        The table.
    names : Sequence[str]
        Its columns of text.
    keep : NDArray[np.bool_], shape (n,)
        Which of its rows are kept.

    Returns
    -------
    dict[str, TextColumn] or None
        None where its rows cannot be told apart as the pass over its numbers did.
    """
    columns = {name: TextColumn() for name in names}
    places = [table.names.index(name) for name in names]
    held: list[list[str]] = [[] for _ in names]
    count = 0
    before = csv.field_size_limit(_LONGEST_CELL)
    try:
        for row in csv.reader(_lines(table), delimiter=table.dialect.separator):
            if not row or (len(row) == 1 and not row[0].strip()):
                continue
            count += 1
            if count > len(keep) + 1:
                return None
            for cells, at in zip(held, places, strict=True):
                cells.append(row[at].strip() if at < len(row) else "")
    except csv.Error:
        return None
    finally:
        csv.field_size_limit(before)
    if count < len(keep):
        return None
    for column, cells in zip(columns.values(), held, strict=True):  # a last row may have been cut off
        column.append(cells[: len(keep)], keep)
    return columns


def _lines(table: TextTable) -> Iterator[str]:
    """Lines of the table's rows; UTF-8, or else Windows-1252."""
    try:
        "".join(codecs.iterdecode([table.file.head(1 << 20)], "utf-8", "strict"))
        encoding = "utf-8"
    except UnicodeDecodeError as error:
        encoding = "utf-8" if error.reason == "unexpected end of data" else "cp1252"
    rest = ""
    for piece in codecs.iterdecode(table.file.quiet(table.skip), encoding, "replace"):
        *whole, rest = (rest + piece).split("\n")
        yield from (f"{line}\n" for line in whole)
    if rest:
        yield rest
