"""Dates that state no time zone, in summer and winter, in text and in Parquet."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from replay.errors import ConfigError
from replay.log.raw_log import RawLog
from replay.log.source_options import SourceOptions
from replay.log.time_zone import from_zone
from replay.readers.registry import read_log, summarise_log

_S = 1_000_000_000


def ns(text: str) -> int:
    return round(datetime.fromisoformat(text).replace(tzinfo=UTC).timestamp()) * _S


@pytest.mark.parametrize(
    ("zone", "shown", "utc"),
    [
        ("Europe/Berlin", "2026-07-01T08:05", "2026-07-01T06:05"),
        ("Europe/Berlin", "2026-11-03T08:05", "2026-11-03T07:05"),
        ("UTC", "2026-11-03T08:05", "2026-11-03T08:05"),
        ("+05:30", "2026-11-03T08:05", "2026-11-03T02:35"),
        ("-0330", "2026-11-03T08:05", "2026-11-03T11:35"),
    ],
)
def test_summer_and_winter(zone: str, shown: str, utc: str) -> None:
    assert from_zone(np.array([ns(shown), ns(shown) + 7]), zone).tolist() == [ns(utc), ns(utc) + 7]


def test_a_mission_over_the_change_to_summer_time() -> None:
    shown = np.array([ns("2026-03-29T01:59:59"), ns("2026-03-29T03:00:00")])
    assert np.diff(from_zone(shown, "Europe/Berlin")).tolist() == [_S]


def test_a_zone_that_is_not_known() -> None:
    with pytest.raises(ConfigError, match="time zone 'CET/Rome' is not known; expected one such as Europe/Berlin"):
        SourceOptions(time_zone="CET/Rome")


def table(path: Path, ending: str) -> Path:
    rows = [f"2026-07-01T08:05:{k:02d}.5{ending},{k}.25" for k in range(20)]
    path.write_text("\n".join(["time,speed", *rows, ""]), encoding="utf-8")
    return path


def first(log: RawLog) -> int:
    return int(log.channels["speed"].stamps[0])


def test_dates_without_a_zone(tmp_path: Path) -> None:
    path = table(tmp_path / "a.csv", "")
    plain = read_log(path, SourceOptions())
    (note,) = [n for n in plain.summary.notes if "zone" in n]
    assert note.startswith(
        "a.csv: its dates state no time zone and were taken as UTC; if its clock shows another time, give "
    )
    here = SourceOptions(time_zone="Europe/Berlin")
    local = read_log(path, here)
    assert first(plain) - first(local) == 7200 * _S
    assert not [n for n in local.summary.notes if "zone" in n]
    assert summarise_log(path, here).start_ns == first(local)


@pytest.mark.parametrize("ending", ["Z", "+02:00"])
def test_dates_with_a_zone_need_none(tmp_path: Path, ending: str) -> None:
    path = table(tmp_path / "a.csv", ending)
    plain, told = read_log(path, SourceOptions()), read_log(path, SourceOptions(time_zone="Europe/Berlin"))
    assert first(plain) == first(told)
    assert not [n for n in plain.summary.notes if "zone" in n]
    assert "a.csv: [sources] time_zone is not used, as its dates state their zone" in told.summary.notes


def test_counts_have_no_zone(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("\n".join(["time [s],speed", *(f"{k * 0.1},{k}" for k in range(20)), ""]), encoding="utf-8")
    told = read_log(path, SourceOptions(time_zone="Europe/Berlin"))
    assert "a.csv: [sources] time_zone is of no use: its time is no date, but a count in s" in told.summary.notes
    assert first(told) == 0


def test_moments_of_parquet(tmp_path: Path) -> None:
    at = np.array([ns("2026-07-01T08:05") + k * _S for k in range(20)], dtype="M8[ns]")
    for name, kind in (("naive", pa.timestamp("us")), ("stated", pa.timestamp("us", "UTC"))):
        columns = {"time": pa.array(at).cast(kind), "speed": pa.array(np.arange(20.0))}
        pq.write_table(pa.table(columns), tmp_path / f"{name}.parquet")
    here = SourceOptions(time_zone="Europe/Berlin")
    assert first(read_log(tmp_path / "naive.parquet", here)) == ns("2026-07-01T06:05")
    assert first(read_log(tmp_path / "stated.parquet", here)) == ns("2026-07-01T08:05")
