"""Lines that programs write above the header of a table."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from replay.log.source_options import SourceOptions
from replay.readers.registry import read_log
from replay.readers.tables.title_lines import title_lines

ROWS = "0,00;1,5;2\n0,01;2,5;3\n0,02;3,5;4\n0,03;3,5;5\n"


@pytest.mark.parametrize(
    ("above", "count"),
    [
        ("", 0),
        ("Maschine:;Radlader 14\n", 1),
        ("Maschine: Radlader 14\nAufzeichnung:;03.11.2026 07:13\nAbtastzeit:;10 ms\n\n", 4),
        ("Maschine;Radlader 14;\n\nDatum;03.11.2026;\n", 3),  # Excel fills rows up
        ("Export\n", 1),
    ],
)
@pytest.mark.parametrize("units", ["", "s;1/min;\n"])
def test_titles_above_the_header_are_told(above: str, count: int, units: str, tmp_path: Path) -> None:
    text = f"{above}Zeit;n_ist_VR;k\n{units}{ROWS}"
    assert title_lines(text.splitlines(), ";") == count
    (tmp_path / "m.csv").write_text(text, encoding="cp1252")
    log = read_log(tmp_path / "m.csv", SourceOptions())
    name = next(n for n in log.channels if n.startswith("n_ist_VR"))
    np.testing.assert_array_equal(log.channels[name].values, [1.5, 2.5, 3.5, 3.5])
    assert not log.summary.damage
    assert any(f"its header is its line {count + 1}" in n for n in log.summary.notes) == (count > 0)


@pytest.mark.parametrize(
    "text",
    [
        "t;a;b\n" + ROWS,
        ";a;b\ns;rpm;%\n" + ROWS,  # the time has no name
        "a;b\n" + ROWS,  # a header without the name of the first column, as R writes it
        ROWS,
        "t;a;b\n;;\n" + ROWS,
        "t;a;b\n0;nan;nan\n0.1;nan;nan\n" + ROWS,
        "t;a\n0;1\n1;2\n",
        "x\ny\n",
        "",
    ],
)
def test_a_table_that_begins_with_its_header_or_rows_has_no_titles(text: str) -> None:
    assert title_lines(text.splitlines(), ";") == 0
