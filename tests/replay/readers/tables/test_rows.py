"""The compiled parser of rows against a naive twin."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from replay.arrays.column_store import ColumnStore
from replay.errors import LogError
from replay.log.reading_notes import Report
from replay.readers.tables.columns import CellColumn
from replay.readers.tables.row_kernel import FILLED, LONG, SHORT, TEXT
from replay.readers.tables.rows import Dialect, Rows

WORDS = {"TRUE": 1.0, "off": 0.0, "NaN": math.nan, "-inf": -math.inf, "": math.nan, "null": math.nan}
NUMBERS = st.one_of(
    st.integers(-(2**62), 2**62).map(str),
    st.floats(allow_nan=False, allow_infinity=False).map(repr),
    st.sampled_from(
        ["+5", "007", "1.", ".5", "1E3", "2e-3", "-0", "12345678901234567890", "0.000000000000000000000001"]
    ),
)
CELLS = st.one_of(NUMBERS, NUMBERS, st.sampled_from([*WORDS, "x", "1.5.2", "--1", "1e", "0x10", "1_000", "12 3"]))
BLANKS = st.sampled_from(["", "", "", " ", "  "])


def naive(cell: str) -> tuple[float, bool]:
    """Value of a cell, and whether it is text."""
    text = cell.strip(" \r")
    if text in WORDS:
        return WORDS[text], False
    try:
        return (math.nan, True) if "_" in text or " " in text else (float(text), False)
    except ValueError:
        return math.nan, True


def parsed(text: bytes, width: int, dialect: Dialect, cuts: int) -> tuple[Rows, list[np.ndarray]]:
    rows = Rows("t.csv", dialect, width, Report())
    columns = [CellColumn(ColumnStore()) for _ in range(width)]
    for cells in rows.blocks([text[i : i + cuts] for i in range(0, len(text), cuts)], 0):
        for i, column in enumerate(columns):
            column.append(cells[i], int(rows.kinds[i]))
    return rows, [c.finish() for c in columns]


@given(
    st.data(),
    st.sampled_from("\t;|"),
    st.booleans(),
    st.booleans(),
    st.integers(1, 400),
    st.sampled_from(["\n", "\r\n"]),
)
def test_rows_equal_their_naive_twin(
    data: st.DataObject, mark: str, comma: bool, quoted: bool, cuts: int, newline: str
) -> None:
    width = data.draw(st.integers(2, 4))
    table = data.draw(st.lists(st.lists(CELLS, min_size=width - 1, max_size=width + 1), min_size=1, max_size=12))
    lines = []
    for row in table:
        cells = [data.draw(BLANKS) + c + data.draw(BLANKS) for c in row]
        cells = [c.replace(".", ",") if comma else c for c in cells]
        cells = [f'"{c}"' if quoted and data.draw(st.booleans()) else c for c in cells]
        lines.append(mark.join(cells))
    text = newline.join([*lines, ""]).encode()
    rows, columns = parsed(text, width, Dialect(mark, "," if comma else ".", True), cuts)
    # a line of one blank cell, quoted or not, is a blank line
    kept = [row for row, line in zip(table, lines, strict=True) if mark in line or line.strip(' "')]
    assert rows.count == len(kept)
    for i, column in enumerate(columns):
        cells = [row[i] if i < len(row) else "" for row in kept]
        found = [naive(c) for c in cells]
        np.testing.assert_array_equal(np.asarray(column, np.float64), [v for v, _ in found])
        assert rows.columns[i, TEXT] == sum(bad for _, bad in found)
        assert rows.columns[i, FILLED] == sum(c != "" for c in cells)
    assert rows.table[SHORT] == sum(len(row) < width for row in kept)
    assert rows.table[LONG] == sum(len(row) > width and row[width] != "" for row in kept)


def test_integers_stay_integers_until_a_double_comes() -> None:
    rows, (whole, mixed) = parsed(b"9007199254740993;9007199254740993\n1;0.5\n", 2, Dialect(";", ".", False), 7)
    assert whole.tolist() == [9007199254740993, 1]
    assert mixed.tolist() == [9007199254740992.0, 0.5]
    assert rows.kinds.tolist() == [1, 2]


def test_a_row_beyond_measure_is_left_out_and_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("replay.readers.tables.rows.LONGEST_ROW", 1000)
    text = b"0;1\n" + b"5;" + b"x" * 5000 + b"\n2;3\n" + b"4;5\n" * 200
    rows, (_, values) = parsed(text, 2, Dialect(";", ".", False), 300)
    assert values.tolist() == [1, 3] + [5] * 200
    assert rows.report.damage == [f"t.csv: a row of {5002} bytes before byte {4 + 5002} was left out"]


def test_more_columns_than_any_table_has() -> None:
    with pytest.raises(LogError, match="30000 columns; at most 20000"):
        Rows("t.csv", Dialect(";", ".", False), 30_000, Report())
