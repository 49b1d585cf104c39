"""Seconds and nanoseconds in two columns are one clock."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from replay.errors import LogError
from replay.log.raw_log import RawLog
from replay.log.source_options import SourceOptions
from replay.readers.registry import read_log, summarise_log
from replay.readers.tables.row_kernel import MISSING
from replay.readers.tables.split_time import split_times, with_part

STAMPS = 1_651_608_966_900_000_000 + np.arange(30) * 50_000_000
SECONDS, PARTS = STAMPS // 10**9, STAMPS % 10**9


def read(path: Path, **options: str) -> RawLog:
    return read_log(path, SourceOptions(**options))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("seconds", "parts"),
    [
        ("header.stamp.secs", "header.stamp.nsecs"),
        ("header.stamp.sec", "header.stamp.nanosec"),
        ("stamp_sec", "stamp_nanosec"),
        ("s", "ns"),
        ("Secs", "Nsecs"),
        ("tv_sec", "tv_nsec"),
    ],
)
@pytest.mark.parametrize("form", ["csv", "parquet"])
def test_two_columns_are_one_clock(tmp_path: Path, seconds: str, parts: str, form: str) -> None:
    path = tmp_path / f"run.{form}"
    table = pd.DataFrame({"seq": 0, seconds: SECONDS, parts: PARTS, "speed": np.sin(np.arange(30.0))})
    table.to_csv(path, index=False) if form == "csv" else table.to_parquet(path, index=False, row_group_size=10)
    log = read(path)
    np.testing.assert_array_equal(log.channels["speed"].stamps, STAMPS)
    assert set(log.channels) == {"seq", "speed"}
    assert any(f"{seconds!r} in s with {parts!r} in ns" in note for note in log.summary.notes)
    summary = summarise_log(path, SourceOptions())
    assert (summary.start_ns, summary.stop_ns) == (STAMPS[0], STAMPS[-1])
    window = read_log(path, SourceOptions(), window=(int(STAMPS[12]), int(STAMPS[20])))
    np.testing.assert_array_equal(window.channels["speed"].stamps, STAMPS[12:20])


def test_microseconds_and_a_named_column(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    pd.DataFrame({"t.sec": SECONDS, "t.usec": PARTS // 1000, "row": np.arange(30)}).to_csv(path, index=False)
    np.testing.assert_array_equal(read(path, time="t.sec").channels["row"].stamps, STAMPS)
    np.testing.assert_array_equal(read(path).channels["row"].stamps, STAMPS)


def test_the_header_stamp_comes_before_the_recorder_s(tmp_path: Path) -> None:
    path = tmp_path / "cmd_vel.csv"
    columns = {"Time": STAMPS / 1e9 + 0.02, "header.stamp.secs": SECONDS, "header.stamp.nsecs": PARTS, "x": 1.5}
    pd.DataFrame(columns).to_csv(path, index=False)
    np.testing.assert_array_equal(read(path).channels["x"].stamps, STAMPS)


def test_a_whole_clock_in_each_of_two_columns_is_no_pair(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    t = np.arange(30) * 0.05
    pd.DataFrame({"t_s": t, "t_ns": (t * 1e9).astype(int), "x": 1.5}).to_csv(path, index=False)
    log = read(path)
    np.testing.assert_allclose(log.channels["x"].stamps, t * 1e9, atol=1)
    assert not list(split_times({"t_s": t, "t_ns": t * 1e9}))


def test_zero_header_stamps_are_no_clock(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    pd.DataFrame({"time": STAMPS / 1e9, "header.stamp.secs": 0, "header.stamp.nsecs": 0, "x": 1.5}).to_csv(
        path, index=False
    )
    assert "time is column 'time' in s" in " ".join(read(path).summary.notes)


def test_a_missing_half_is_no_time() -> None:
    seconds = np.array([1, 1, MISSING, 2]) * np.array([10**9, 10**9, 1, 10**9])
    assert with_part(seconds, np.array([5.0, np.nan, 7.0, 2e9]), 1).tolist() == [10**9 + 5, MISSING, MISSING, MISSING]


@pytest.mark.parametrize("kind", [np.float64, np.uint64])
@pytest.mark.parametrize("where", ["everywhere", "once", "often"])
@pytest.mark.filterwarnings("error")
def test_seconds_that_no_clock_counts_are_not_stamps(tmp_path: Path, kind: type, where: str) -> None:
    """Beyond what nanoseconds can be counted in: a column of them is no clock in two parts, a cell is damage."""
    seconds = SECONDS.astype(kind)
    seconds[{"everywhere": slice(None), "once": slice(7, 8), "often": slice(0, None, 3)}[where]] += kind(2.0**63)
    path = tmp_path / "run.csv"
    text = [f"{int(s)},{n},{k}.5" for k, (s, n) in enumerate(zip(seconds.tolist(), PARTS.tolist(), strict=True))]
    path.write_text("\n".join(["sec,nanosec,speed", *text]) + "\n")
    if where == "once":
        log = read(path)
        np.testing.assert_array_equal(log.channels["speed"].stamps, np.delete(STAMPS, 7))
        assert "1 of 30 rows have no readable time" in log.summary.damage[0]
    else:
        with suppress(LogError):
            assert not any("nanosec" in note for note in read(path).summary.notes)


@pytest.mark.parametrize(
    "far",
    [1e300, -1e300, np.inf, -np.inf, np.nan, 1e9, -1.0, 2.0**63, np.uint64(2**64 - 1), np.uint64(2**55), np.int64(-1)],
)
@pytest.mark.parametrize("unit_ns", [1, 1000])
@pytest.mark.filterwarnings("error")
def test_what_is_no_part_of_a_second_gives_no_stamp(far: float, unit_ns: int) -> None:
    cells = np.array([1, far, 2], getattr(far, "dtype", np.float64))
    stamps = with_part(np.array([10, 20, 30]) * 10**9, cells, unit_ns)
    assert stamps.tolist() == [10 * 10**9 + unit_ns, MISSING, 30 * 10**9 + 2 * unit_ns]
