from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from replay.errors import LogError
from replay.inspection.inspect_log import inspect_log
from replay.log.source_options import SourceOptions
from replay.readers.registry import read_log, summarise_log
from replay.readers.tables import parquet_reader


def write(path: Path, rows: int = 100, **columns: Any) -> Path:
    pq.write_table(pa.table(columns), path, row_group_size=rows)
    return path


@pytest.fixture
def target(tmp_path: Path) -> Path:
    return tmp_path / "t.parquet"


def test_empty_cells_and_types_of_every_row_group(target: Path) -> None:
    write(
        target, 2,
        t=[1, 2, 3, 4, 5],
        i=pa.array([1, 2, None, 4, 5], pa.int32()),
        f=pa.array([0.5, None, 1.5, 2.5, 3.5], pa.float32()),
        b=[True, False, True, True, False],
        d=pa.array([1, 2, 3, 4, 5], pa.decimal128(10, 2)),
        n=[[1], [2], [3], [4], [5]],
        s=["a", "b", "c", "d", "e"],
    )  # fmt: skip
    log = read_log(target, SourceOptions(time="t"))
    np.testing.assert_array_equal(log.channels["i"].values, [1, 2, np.nan, 4, 5])
    np.testing.assert_array_equal(log.channels["f"].values, np.array([0.5, np.nan, 1.5, 2.5, 3.5], np.float32))
    assert log.channels["b"].values.tolist() == [1, 0, 1, 1, 0]
    assert log.channels["d"].values.tolist() == [1.0, 2.0, 3.0, 4.0, 5.0]
    assert any("left out: n, s" in n for n in log.summary.notes)


def test_halves_are_worked_with_as_floats(target: Path) -> None:
    h = np.array([0.5, 65504.0, np.nan, np.inf], np.float16)
    pq.write_table(pa.table({"t": np.arange(4) / 10, "h": h}), target)
    channel = read_log(target, SourceOptions()).channels["h"]
    assert channel.values.dtype == np.float32
    np.testing.assert_array_equal(channel.values, h.astype(np.float64))
    assert inspect_log(target, SourceOptions()).topics[0].odd_values


def test_long_integers_of_time_stay_exact_beside_empty_cells(target: Path) -> None:
    first = 1_700_000_000_000_000_001
    write(target, 2, stamp=pa.array([first, first + 2, None, first + 4]), v=[1, 2, 3, 4])
    log = read_log(target, SourceOptions(time="stamp", time_unit="ns"))
    assert log.channels["v"].stamps.tolist() == [first, first + 2, first + 4]
    assert any("1 of 4 rows have no readable time" in d for d in log.summary.damage)


@pytest.mark.parametrize(
    ("column", "options"),
    [
        (pa.array([1000, 2000, 3000], pa.timestamp("ms")), {}),
        (pa.array([1_000_000, 2_000_000, 3_000_000], pa.timestamp("us", "Europe/Helsinki")), {}),
        (pa.array(["1970-01-01T00:00:01Z", "1970-01-01T02:00:02+02:00", "1970-01-01 00:00:03"]), {"time": "time", "time_unit": "iso"}),
        (pa.array([1.0, 2.0, 3.0]), {}),
        (pa.array([1000, 2000, 3000], pa.duration("ms")), {}),
    ],
)  # fmt: skip
def test_time_columns(target: Path, column: Any, options: dict[str, str]) -> None:
    log = read_log(write(target, time=column, v=[1, 2, 3]), SourceOptions(**options))  # type: ignore[arg-type]
    assert log.channels["v"].stamps.tolist() == [1_000_000_000, 2_000_000_000, 3_000_000_000]


def test_a_window_opens_only_row_groups_in_it(target: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write(target, 10, t=np.arange(100) / 10, v=np.arange(100))
    opened: list[int] = []
    blocks = parquet_reader._Parquet.blocks

    def spy(self: Any, names: list[str], groups: list[int], size: int = 1000) -> Any:
        opened.extend(groups)
        return blocks(self, names, groups, size)

    monkeypatch.setattr(parquet_reader._Parquet, "blocks", spy)
    log = read_log(target, SourceOptions(time="t"), window=(3_500_000_000, 5_000_000_000))
    assert log.channels["v"].values.tolist() == list(range(35, 50))
    assert sorted(set(opened)) == [0, 3, 4]  # the first to look at the time column


def test_the_summary_of_a_long_table(target: Path) -> None:
    log = read_log(write(target, 7, t=np.arange(50.0), v=np.arange(50)), SourceOptions())
    index = summarise_log(target, SourceOptions())
    assert (index.topics, index.start_ns, index.stop_ns) == (
        log.summary.topics,
        log.summary.start_ns,
        log.summary.stop_ns,
    )


def test_one_second_resolution_is_spread(target: Path) -> None:
    write(target, 7, dt=np.repeat(np.arange(1000, 1006), 4), v=np.arange(24))
    log = read_log(target, SourceOptions(time="dt", time_unit="dt"), window=(1001 * 10**9, 1002 * 10**9))
    assert log.channels["v"].values.tolist() == [4, 5, 6, 7]
    assert (log.channels["v"].stamps - 1001 * 10**9).tolist() == [0, 250_000_000, 500_000_000, 750_000_000]
    write(target, 7, dt=np.repeat(np.arange(1000, 1006), 4), v=np.arange(24) % 5)
    with pytest.raises(LogError, match="time_unit = 'dt'"):
        read_log(target, SourceOptions())


@pytest.mark.parametrize(
    ("columns", "reason"),
    [
        ({"t": pa.array([], pa.float64()), "v": pa.array([], pa.float64())}, "2 columns and no row of data"),
        ({"a": [3, 1, 2], "b": [1, 1, 1]}, "no time column"),
    ],
)
def test_tables_that_cannot_be_read(target: Path, columns: dict[str, Any], reason: str) -> None:
    with pytest.raises(LogError, match=reason):
        read_log(write(target, **columns), SourceOptions())


def test_a_table_of_text_alone_has_no_time_column(target: Path) -> None:
    write(target, a=["x", "y"], b=["z", "z"])
    with pytest.raises(LogError, match="no time column"):
        read_log(target, SourceOptions())


def test_the_message_on_long_names_stays_short(target: Path) -> None:
    write(target, **{"x" * 5000: [1.0, 0.0, 1.0], "y" * 5000: [1.0, 0.0, 1.0]})
    with pytest.raises(LogError, match="no time column") as found:
        read_log(target, SourceOptions())
    assert len(str(found.value)) < 1000


def test_a_row_group_that_gives_fewer_rows_than_the_footer_counts_is_told(
    target: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where bytes are gone from its pages, pyarrow may end a row group early without an error."""
    write(target, 20, t=np.arange(60) / 10, v=np.arange(60))
    whole = pq.ParquetFile.iter_batches

    def shorter(self: pq.ParquetFile, *args: Any, row_groups: list[int], **options: Any) -> Iterator[Any]:
        for batch in whole(self, *args, row_groups=row_groups, **options):
            yield batch.slice(0, 13) if row_groups == [2] else batch

    monkeypatch.setattr(pq.ParquetFile, "iter_batches", shorter)
    log = read_log(target, SourceOptions())
    assert len(log.channels["v"].values) == 53
    assert "t.parquet: row group 2 gives 7 rows less than its footer counts" in log.summary.damage
