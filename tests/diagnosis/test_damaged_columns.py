"""A saved result whose columns are damaged is refused in one sentence, before a page is made of it."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from diagnosis.output import rebuild, write_result
from diagnosis.report.plot_data import axis_of
from diagnosis.results.result import MissionResult
from replay.errors import LogError
from tests.report_samples import five_faults, no_faults


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> Path:
    report, columns = no_faults()
    folder = tmp_path_factory.mktemp("saved") / "r"
    write_result(MissionResult(report, {k: columns[k] for k in list(columns)[:3]}), folder)
    return folder


def _misspelt() -> bytes:
    """A file with a column's name that is not UTF-8."""
    out = io.BytesIO()
    pq.write_table(pa.table({"name": [1.0]}), out, store_schema=False)
    return out.getvalue().replace(b"name", b"n\xffme")


@pytest.mark.parametrize(
    ("columns", "words"),
    [
        ({"t": [0.0, 1.0, 5.0]}, "column 't' is not uniform"),
        ({"t": [0.0, np.nan, 2.0]}, "column 't' is not uniform"),
        ({"t": [0.0, np.inf, 2.0]}, "column 't' is not uniform"),
        ({"t": [0.0, 1.0, 2.0], "v": ["a", "b", "c"]}, "column 'v' holds no numbers"),
        ({"t": [0.0, 1.0, 2.0], "v": [[1.0], [2.0], [3.0]]}, "column 'v' holds no numbers"),
        ({"t": [0.0, 1.0, 2.0], "": ["a", "b", "c"]}, "column '' holds no numbers"),
        (_misspelt(), "cannot be read"),
    ],
)
def test_one_sentence_says_what_is_wrong(saved: Path, columns: dict[str, list[object]] | bytes, words: str) -> None:
    if isinstance(columns, bytes):
        (saved / "report.parquet").write_bytes(columns)
    else:
        pq.write_table(pa.table(columns), saved / "report.parquet")
    with pytest.raises(LogError, match=words) as found:
        rebuild(saved)
    assert "run `mfhca diagnose` on the log again" in str(found.value)


def test_a_column_without_a_name_may_be_of_another_length() -> None:
    with pytest.raises(ValueError, match="column '' has shape"):
        axis_of({"t": np.arange(3.0), "": np.arange(2.0)}, 1.0)


@pytest.mark.parametrize("value", [np.inf, -np.inf, 3e38, -3e38, 1e-45])
def test_absurd_values_are_no_reason_to_have_no_page(tmp_path: Path, value: float) -> None:
    report, columns = five_faults(20.0, 20.0)
    write_result(MissionResult(report, columns), tmp_path)
    table = pq.read_table(tmp_path / "report.parquet")
    damaged = {name: table.column(name).to_numpy().copy() for name in table.column_names}
    for name, values in damaged.items():
        if name != "t":
            values[3:7] = value
            values.view("u4")[9] = 0x7F80_0001  # a NaN that signals
    damaged["evidence.FR.sejsor.delta_bar"] = damaged["t"]
    damaged["evidence.delta_bar"] = damaged["t"]
    pq.write_table(pa.table(damaged), tmp_path / "report.parquet")
    assert rebuild(tmp_path).stat().st_size > 100_000
