from __future__ import annotations

import gzip
import time
from collections.abc import Callable
from datetime import UTC, datetime, timedelta, timezone
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import zstandard
from hypothesis import given, settings
from hypothesis import strategies as st

from replay.errors import LogError
from replay.log.raw_log import RawLog
from replay.log.source_options import SourceOptions
from replay.readers.registry import open_log, read_log, summarise_log
from replay.readers.tables import text_file, text_table
from replay.readers.tables.iso_kernel import iso_ns
from replay.readers.tables.row_kernel import MISSING
from replay.readers.tables.text_table import separator_of
from replay.readers.tables.units_row import units_of_row


def read(path: Path, **options: object) -> RawLog:
    return read_log(path, SourceOptions(**options))  # type: ignore[arg-type]


@pytest.fixture
def target(tmp_path: Path) -> Path:
    return tmp_path / "table.csv"


def test_plain_csv_with_units_in_the_header(target: Path) -> None:
    target.write_text("t,speed [rpm],temp (K),n\n0,1.5,300,7\n0.01,2.5,301,8\n0.02,-3,302,9\n")
    log = read(target)
    assert open_log(target).format == "csv"
    speed = log.channels["speed [rpm]"]
    assert (speed.unit, speed.values.tolist(), speed.stamps.tolist()) == (
        "rpm",
        [1.5, 2.5, -3.0],
        [0, 10**7, 2 * 10**7],
    )
    assert log.channels["n"].values.dtype == np.int64
    assert any("time is column 't' in s, found by its name" in n for n in log.summary.notes)
    assert summarise_log(target, SourceOptions()).topics[0].fields == ("speed [rpm]", "temp (K)", "n")


@pytest.mark.parametrize(
    ("separator", "decimal"), [(";", ","), ("\t", ","), (";", "."), ("\t", "."), ("|", "."), (",", ".")]
)
def test_separator_and_decimal_are_found(target: Path, separator: str, decimal: str) -> None:
    rows = [["time", "a", "b"], ["0.5", "1.25", "-3"], ["1.5", "2e-3", ""], ["2.5", "4.5", "0"]]
    target.write_text("\n".join(separator.join(c.replace(".", decimal) for c in row) for row in rows) + "\n")
    log = read(target)
    assert log.channels["a"].values.tolist() == [1.25, 0.002, 4.5]
    np.testing.assert_array_equal(log.channels["b"].values, [-3, np.nan, 0])
    assert log.channels["a"].stamps.tolist() == [500_000_000, 1_500_000_000, 2_500_000_000]


def test_repeated_and_padded_names(target: Path) -> None:
    target.write_text("Rel Time, v ,v,Mag. z\n0,1,2,3\n16,4,5,6\n31,7,8,9\n")
    log = read(target, time="Rel Time", time_unit="ms")
    assert [*log.channels] == ["v", "v (2)", "Mag. z"]
    assert log.channels["v (2)"].values.tolist() == [2, 5, 8]
    assert log.channels["v"].stamps.tolist() == [0, 16_000_000, 31_000_000]
    assert any("names occur more than once" in n for n in log.summary.notes)


@pytest.mark.parametrize(
    ("cells", "options", "expected"),
    [
        (["1700000000000000001", "1700000000000000002"], {}, [1_700_000_000_000_000_001, 1_700_000_000_000_000_002]),
        (["133000000000000001", "133000000000000002"], {"time_unit": "filetime"}, [1_655_526_400_000_000_100, 1_655_526_400_000_000_200]),
        (["2024-05-01T10:00:00.000001Z", "2024-05-01 12:00:00+01:00"], {}, [1_714_557_600_000_001_000, 1_714_561_200_000_000_000]),
        (["5", "6"], {"time_unit": "us", "epoch": "1970-01-01T00:00:01"}, [1_000_005_000, 1_000_006_000]),
        (["-0.5", "0.25"], {"epoch": "2000-01-01T00:00:00+00:00"}, [946_684_799_500_000_000, 946_684_800_250_000_000]),
    ],
)  # fmt: skip
def test_time_units_and_epochs_are_exact(
    target: Path, cells: list[str], options: dict[str, str], expected: list[int]
) -> None:
    target.write_text("when,v\n" + "".join(f"{c},{i}.5\n" for i, c in enumerate(cells)))
    assert read(target, time="when", **({"time_unit": "ns"} if len(cells[0]) == 19 else {"time_unit": "iso"} if "T" in cells[0] else {}) | options).channels["v"].stamps.tolist() == expected  # fmt: skip


@pytest.mark.parametrize(
    ("header", "cells", "unit"),
    [
        ("t_ms", ["0", "10", "20"], "ms"),
        ("time [us]", ["0", "10", "20"], "us"),
        ("timestamp", ["1700000000000000000", "1700000000010000000"], "ns"),
        ("timestamp", ["1700000000000", "1700000000010"], "ms"),
        ("stamp", ["133000000000000000", "133000000000100000"], "filetime"),
        ("Time", ["15936", "15950", "15964"], "ms"),
        ("Time", ["0.0", "0.5", "1.0"], "s"),
    ],
)
def test_the_unit_of_a_found_time_column_is_told(target: Path, header: str, cells: list[str], unit: str) -> None:
    target.write_text(f"{header},v\n" + "".join(f"{c},{i % 2}\n" for i, c in enumerate(cells)))
    assert any(f"time is column {header!r} in {unit}" in n for n in read(target).summary.notes)


def test_a_time_column_without_a_name_is_found_because_it_rises(target: Path) -> None:
    target.write_text("a,b\n5,0.1\n3,0.2\n4,0.3\n")
    log = read(target)
    assert [*log.channels] == ["a"]
    assert any("because it only rises" in n for n in log.summary.notes)


def test_rows_without_a_time_are_left_out_and_counted(target: Path) -> None:
    target.write_text("t,v\n0,1\n,2\n2,3\n3,4\n")
    log = read(target, time="t")
    assert log.channels["v"].values.tolist() == [1, 3, 4]
    assert any("1 of 4 rows have no readable time" in d for d in log.summary.damage)


def test_booleans_text_and_odd_cells(target: Path) -> None:
    target.write_text("t,ok,label,v\n0,True,a,1\n1,False,b,x\n2,True,c,3\n")
    log = read(target)
    assert log.channels["ok"].values.tolist() == [1, 0, 1]
    np.testing.assert_array_equal(log.channels["v"].values, [1, np.nan, 3])
    assert "label" not in log.channels
    assert any("columns of text were left out: label" in n for n in log.summary.notes)
    assert any("1 cells of 'v' are not numbers" in d for d in log.summary.damage)


def test_without_a_header_and_with_comments(target: Path) -> None:
    target.write_text("# made by x\n# t, a\n0,1\n1,2\n2,3\n")
    assert read(target).channels["a"].values.tolist() == [1, 2, 3]
    target.write_text("0,5\n1,6\n2,4\n")
    assert read(target).channels["column 2"].values.tolist() == [5, 6, 4]


def test_a_last_row_that_was_cut_off(target: Path) -> None:
    target.write_text("t,a,b\n0,1,2\n1,2,3\n2,3")
    log = read(target)
    assert log.channels["a"].values.tolist() == [1, 2]
    assert any("middle of a row" in d for d in log.summary.damage)


def test_gzip_whole_and_cut_off(tmp_path: Path) -> None:
    path = tmp_path / "t.csv.gz"
    text = "t,a\n" + "".join(f"{i},{i * 7919 % 1000}\n" for i in range(5000))
    path.write_bytes(gzip.compress(text.encode()))
    assert len(read(path).channels["a"].values) == 5000
    path.write_bytes(path.read_bytes()[:-2000])
    log = read(path)
    assert 0 < len(log.channels["a"].values) < 5000
    assert any("gzip data are cut off" in d for d in log.summary.damage)


def test_zstd_whole_and_cut_off(tmp_path: Path) -> None:
    path = tmp_path / "t.csv.zst"
    text = "t,a\n" + "".join(f"{i},{i * 7919 % 1000}\n" for i in range(200_000))
    path.write_bytes(zstandard.compress(text.encode()))
    assert open_log(path).format == "csv"
    assert len(read(path).channels["a"].values) == 200_000
    path.write_bytes(path.read_bytes()[:-2000])
    log = read(path)
    assert 0 < len(log.channels["a"].values) < 200_000
    assert any("zstd data are cut off" in d for d in log.summary.damage)


def test_zstd_cut_off_or_damaged_in_its_first_blocks_gives_what_comes_before(tmp_path: Path) -> None:
    path = tmp_path / "t.csv.zst"
    noise = np.random.default_rng(1).integers(0, 10**9, (20_000, 3))
    text = "t,a,b,c\n" + "".join(f"{i},{a},{b},{c}\n" for i, (a, b, c) in enumerate(noise.tolist()))
    packed = zstandard.compress(text.encode())
    path.write_bytes(packed[: len(packed) // 2])
    log = read(path)
    assert 5000 < len(log.channels["a"].values) < 15_000
    assert log.channels["a"].values[:5000].tolist() == noise[:5000, 0].tolist()
    assert any("zstd data are cut off" in d for d in log.summary.damage)
    frames = zstandard.compress(text[:100_000].encode()) + zstandard.compress(text[100_000:].encode())
    path.write_bytes(frames)
    assert len(read(path).channels["a"].values) == 20_000
    path.write_bytes(frames[:-100_000] + b"no zstd" * 10)
    log = read(path)
    assert 2000 < len(log.channels["a"].values) < 20_000
    assert any("zstd data are" in d for d in log.summary.damage)


def test_quoted_cells_hold_separators_quotes_and_line_feeds(target: Path) -> None:
    target.write_text('"t","a, ""b""","multi\nline",c\n0,"1.5",-2,"x, y"\n1,"2.5", "3" ,"x\ny"\n"2",3.5,4,"z"\n')
    log = read(target)
    assert [*log.channels] == ['a, "b"', "multi\nline"]
    assert log.channels["multi\nline"].values.tolist() == [-2, 3, 4]


@pytest.mark.parametrize("size", [64, 101])
def test_blocks_change_nothing(target: Path, size: int, monkeypatch: pytest.MonkeyPatch) -> None:
    rows = [f'{i},{i % 7},{i + 0.5 if i > 50 else i},"{i}\n{i}",{"" if i == 30 else i}' for i in range(100)]
    target.write_text("t,a,b,c,d\n" + "\n".join(rows) + "\n")
    whole = read(target)
    monkeypatch.setattr(text_file, "BLOCK", size)
    parts = read(target)
    assert parts.summary == whole.summary
    assert [str(c.values.dtype) for c in whole.channels.values()] == ["int64", "float64", "float64"]
    for name, channel in whole.channels.items():
        np.testing.assert_array_equal(parts.channels[name].values, channel.values)


def test_a_decimal_comma_that_comes_late(target: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(text_file.TextFile, "tail", lambda self, skip: b"")
    monkeypatch.setattr(text_table, "HEAD", 100)
    target.write_text("t;v\n" + "".join(f"{i};{i % 3}\n" for i in range(50)) + "50;0,5\n51;-,25\n")
    log = read(target)
    assert log.channels["v"].values[-3:].tolist() == [1, 0.5, -0.25]
    assert log.summary.damage == ()


def test_rows_of_other_lengths_are_counted(target: Path) -> None:
    target.write_text("t,a,b\n0,1,2\n1,2\n2,3,4,5\n3,4,5,\n\n  \n4,5,6\n5,6,7\n6,7,8\n")
    log = read(target)
    np.testing.assert_array_equal(log.channels["b"].values, [2, np.nan, 4, 5, 6, 7, 8])
    assert any("1 rows have fewer cells than the header" in d for d in log.summary.damage)
    assert any("1 rows have more cells than the header (the first at byte 16)" in d for d in log.summary.damage)


def test_words_for_numbers(target: Path) -> None:
    words = "t;a\n0;NaN\n1;-inf\n2;+Infinity\n3;1.#QNAN\n4;n. def.\n5;-1.#IND\n6;TRUE\n7;off\n8;null\n9;\n"
    target.write_text(words)
    expected = [np.nan, -np.inf, np.inf, np.nan, np.nan, np.nan, 1, 0, np.nan, np.nan]
    log = read(target)
    np.testing.assert_array_equal(log.channels["a"].values, expected)
    assert log.summary.damage == ()


def test_numbers_that_only_python_can_round(target: Path) -> None:
    cells = ["2.4703282292062327208e-324", "1e400", "9007199254740993.00000000000000000000001", "-1e-400"]
    target.write_text("t,v\n" + "".join(f"{i},{c}\n" for i, c in enumerate(cells)))
    assert read(target).channels["v"].values.tolist() == [float(c) for c in cells]


def test_columns_that_turn_from_text_to_numbers_are_not_dropped(target: Path) -> None:
    target.write_text(
        "t,v\n" + "".join(f"{i},ERR\n" for i in range(30_000)) + "".join(f"{i},1.5\n" for i in range(30_000, 90_000))
    )
    log = read(target)
    assert np.isfinite(log.channels["v"].values).sum() == 60_000
    assert any(
        "30000 cells of 'v' are not numbers; they became empty (the first is 'ERR' at byte 6)" in d
        for d in log.summary.damage
    )


@pytest.mark.parametrize(
    ("unit", "cells", "expected"),
    [
        ("dc", ["5", "1000000005"], [946_684_800_000_000_005, 946_684_801_000_000_005]),
        ("dc32", ["4294967290", "4"], [946_684_804_294_967_290, 946_684_804_294_967_300]),
        ("dt", ["10", "10", "11", "11", "12", "12"], [10_000, 10_500, 11_000, 11_500, 12_000, 12_500]),
        ("dt", ["DT#1970-01-01-00:00:10", "DT#1970-01-01-00:00:10", "DT#1970-01-01-00:00:11", "DT#1970-01-01-00:00:11",
                "DT#1970-01-01-00:00:12"], [10_000, 10_500, 11_000, 11_500, 12_000]),
        ("iso", ["01.02.2024 10:00:00,25", "29.02.2024 10:00:00"], [1_706_781_600_250, 1_709_200_800_000]),
    ],
)  # fmt: skip
def test_time_bases_of_plcs(target: Path, unit: str, cells: list[str], expected: list[int]) -> None:
    target.write_text("when;v\n" + "".join(f"{c};{i}\n" for i, c in enumerate(cells)))
    stamps = read(target, time="when", time_unit=unit).channels["v"].stamps.tolist()
    assert stamps == [e if e > 1e15 else e * 1_000_000 for e in expected]


@given(when=st.datetimes(datetime(1700, 1, 1), datetime(2250, 1, 1)), zone=st.integers(-720, 720))
def test_dates_come_back(when: datetime, zone: int) -> None:
    text = when.replace(tzinfo=timezone(timedelta(minutes=zone))).isoformat().encode()
    since = when - timedelta(minutes=zone) - datetime(1970, 1, 1)
    expected = (since.days * 86_400 + since.seconds) * 10**9 + since.microseconds * 1000
    assert iso_ns(np.frombuffer(text, np.uint8), 0, len(text)) == expected


@pytest.mark.parametrize(
    "text", ["2024-02-30", "2023-02-29", "2024-13-01", "2024-01-01T25:00", "2024-01-01x", "20240101", "abc"]
)
def test_what_is_no_date(text: str) -> None:
    assert iso_ns(np.frombuffer(text.encode(), np.uint8), 0, len(text)) == MISSING


def test_letters_of_windows_and_the_separator_that_excel_states(target: Path) -> None:
    target.write_bytes("sep=;\r\nt;Öldruck [bar];weiß\r\n0;1,5;2\r\n1;2,5;3\r\n".encode("cp1252"))
    log = read(target)
    assert [*log.channels] == ["Öldruck [bar]", "weiß"]
    assert log.channels["Öldruck [bar]"].values.tolist() == [1.5, 2.5]
    assert any("read as Windows-1252" in n for n in log.summary.notes)


def test_a_window_of_a_text_table(target: Path) -> None:
    target.write_text("t,v\n" + "".join(f"{i},{i}\n" for i in range(10)))
    log = read_log(target, SourceOptions(), window=(3 * 10**9, 5 * 10**9))
    assert log.channels["v"].values.tolist() == [3, 4]
    assert read_log(target, SourceOptions(), window=(0, 0)).channels["v"].values.tolist() == []


@pytest.mark.parametrize("packed", [None, gzip.compress, zstandard.compress])
def test_the_summary_reads_head_and_tail_only(
    tmp_path: Path, packed: Callable[[bytes], bytes] | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "t.csv"
    raw = ("t,v,label\n" + "".join(f"{i / 10},{i * 7 % 11},x\n" for i in range(50_000))).encode()
    path.write_bytes(packed(raw) if packed else raw)
    log, index = read(path), summarise_log(path, SourceOptions())
    assert (index.start_ns, index.stop_ns) == (log.summary.start_ns, log.summary.stop_ns)
    assert index.topics == log.summary.topics
    monkeypatch.setattr(text_table, "COUNTED", 0)
    monkeypatch.setattr(text_table, "PACKED", 0)
    index = summarise_log(path, SourceOptions())
    assert "estimated" in index.topics[0].note
    assert abs(index.topics[0].count - 50_000) < 5000


@pytest.mark.parametrize("text", ["time,speed,pressure\n", "time;speed\r\n\r\n", "# made by x\nt,v"])
def test_a_header_without_rows_is_told_as_such(target: Path, text: str) -> None:
    target.write_text(text)
    with pytest.raises(
        LogError, match=r"has a header.*and no row of data; the recording ended before its first sample"
    ):
        read(target)
    with pytest.raises(LogError, match="no row of data"):
        summarise_log(target, SourceOptions())


def test_parquet_keeps_types(tmp_path: Path) -> None:
    path = tmp_path / "t.parquet"
    frame = pd.DataFrame({
        "time": pd.to_datetime([10, 20, 30], unit="ns"),
        "u": np.array([1, 2, 2**64 - 1], np.uint64),
        "f": np.array([1.5, np.nan, 2.5], np.float32),
        "s": ["a", "b", "c"],
    })  # fmt: skip
    frame.to_parquet(path)
    log = read(path)
    assert log.channels["u"].values.dtype == np.uint64
    assert log.channels["u"].values[2] == 2**64 - 1
    assert log.channels["f"].values.dtype == np.float32
    assert log.channels["f"].stamps.tolist() == [10, 20, 30]
    assert open_log(path).format == "parquet"


@pytest.mark.parametrize(
    ("text", "options", "reason"),
    [
        ("t,v\n0,1\n1,2\n", {"time": "zeit"}, "no column 'zeit' for time; its columns are t, v"),
        ("a,b\n5,1\n3,2\n4,0\n", {}, "no time column"),
        ("throttle,rps\n0,5\n0,3\n0,4\n1,3\n", {}, r"no time column \(none rises\)"),
        ("t,v\n0,1\n1,2\n", {"time": "t", "epoch": "yesterday"}, "not an ISO date"),
        ("t,v\nx,1\ny,2\n", {"time": "t"}, "holds no readable time"),
    ],
)
def test_tables_that_cannot_be_read_say_why(target: Path, text: str, options: dict[str, str], reason: str) -> None:
    target.write_text(text)
    with pytest.raises(LogError, match=reason):
        read(target, **options)


def test_a_damaged_parquet_file(tmp_path: Path) -> None:
    path = tmp_path / "t.parquet"
    path.write_bytes(b"PAR1" + bytes(100))
    with pytest.raises(LogError, match="damaged Parquet"):
        read(path)


@settings(max_examples=30, deadline=None)
@given(values=st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=2, max_size=20), comma=st.booleans())
def test_written_numbers_come_back_bit_for_bit(
    tmp_path_factory: pytest.TempPathFactory, values: list[float], comma: bool
) -> None:
    path = tmp_path_factory.mktemp("t") / "t.csv"
    text = "".join(f"{i};{v!r}\n" for i, v in enumerate(values))
    path.write_text("t;v\n" + (text.replace(".", ",") if comma else text))
    log = read(path, separator=";", decimal="," if comma else ".", time="t")
    assert [float(v) for v in log.channels["v"].values] == values


def test_real_motor_runs(reference_data: Path) -> None:
    paths = sorted((reference_data / "fault_data" / "rosa").rglob("*.csv.gz"))[:6]
    for path in paths:
        log = read(path, time="Rel Time", time_unit="ms")
        assert log.summary.damage == ()
        assert {"Desired Speed", "Actual Speed", "Shaft Control Effort", "Force Sensor 1 (2)", "Mag. x"} <= {
            *log.channels
        } | {"Force Sensor 1 (2)"}
        assert len(log.channels["Actual Speed"].values) > 500


def test_real_robot_arm(reference_data: Path) -> None:
    log = read(reference_data / "fault_data" / "dtr_robot_arm" / "Healthy_01.csv")
    assert len(log.channels["resp_m1_rad"].values) == 1000
    assert log.channels["cmd_m5_rad"].stamps[-1] == 9_990_000_000


def table_of(target: Path, name: str, cells: list[str]) -> Path:
    target.write_text(f"{name},a,b\n" + "".join(f"{c},{i}.5,1.5\n" for i, c in enumerate(cells)))
    return target


@pytest.mark.parametrize("step", [1_000_000, 10_000_000, 100_000_000])
def test_a_32_bit_clock_is_known_by_its_turns(target: Path, step: int) -> None:
    ticks = 4_000_000_000 + step * np.arange(2000)
    log = read(table_of(target, "clk", [str(t % 2**32) for t in ticks.tolist()]))
    stamps = log.channels["a"].stamps
    assert (np.diff(stamps) == step).all()
    assert any("in dc32, found because it rises and starts again at 2^32" in n for n in log.summary.notes)
    with pytest.raises(LogError, match=r"not in seconds; give .* time_unit = 'dc32'"):
        read(target, time="clk")


def test_a_count_that_cannot_be_seconds_is_refused_with_what_it_may_be(target: Path) -> None:
    table_of(target, "clk", [str(5_000_000 + 1_000_000 * i) for i in range(500)])
    with pytest.raises(LogError, match=r"'clk' rises by 1e\+06 from row to row.*'dc32' \(a 32-bit distributed clock\)"):
        read(target)
    assert read(target, time="clk", time_unit="dc32").channels["a"].stamps[1] % 10**9 == 6_000_000


def test_a_64_bit_distributed_clock_is_known_by_its_size(target: Path) -> None:
    since_2000 = 820_000_000_000_000_000
    table_of(target, "dc_time", [str(since_2000 + 10_000_000 * i) for i in range(50)])
    assert read(target).channels["a"].stamps[:2].tolist() == [946_684_800 * 10**9 + since_2000 + k for k in (0, 10**7)]


def test_it_only_rises_is_said_where_it_does(target: Path) -> None:
    cells = [f"{i / 100}" for i in range(500)]
    cells[100], cells[101] = cells[101], cells[100]
    notes = read(table_of(target, "foo", cells)).summary.notes
    assert any("because it rises in all but 1 of its first 500 rows" in n for n in notes)


@pytest.mark.filterwarnings("error")
def test_infinite_cells_of_a_clock_are_no_times(target: Path) -> None:
    cells = [str(2**63 - 400 + i) for i in range(500)]  # doubles from the middle on
    cells[100] = cells[400] = "1e5000"
    table_of(target, "clk", cells)
    assert open_log(target).summarise(target, SourceOptions()).topics
    log = read(table_of(target, "clk", [c if i in (100, 400) else f"{i / 100}" for i, c in enumerate(cells)]))
    assert len(log.channels["a"].values) == 498
    assert any("because it only rises" in n for n in log.summary.notes)
    assert any("2 of 500 rows have no readable time" in d for d in log.summary.damage)


@pytest.mark.filterwarnings("error")
def test_steps_beyond_the_largest_number_are_told_as_what_they_are(target: Path) -> None:
    cells = [f"{-1.7e308 if i < 2 else 1.7e308 + i * 1e300}" for i in range(4)]
    with pytest.raises(LogError, match="'clk' rises by"):
        read(table_of(target, "clk", cells))


def test_times_of_day_run_on_over_midnight_and_take_their_date_from_the_epoch(target: Path) -> None:
    moments = [datetime(2025, 1, 1, 23, 59, 58) + timedelta(seconds=i / 100) for i in range(400)]
    table_of(target, "time", [f"{m:%H:%M:%S.%f}" for m in moments])
    log = read(target)
    assert (np.diff(log.channels["a"].stamps) == 10_000_000).all()
    assert any("times of day without a date" in n for n in log.summary.notes)
    dated = read(target, epoch="2025-08-19T00:00:00Z").channels["a"].stamps
    assert datetime.fromtimestamp(int(dated[200]) / 1e9, tz=UTC).isoformat() == "2025-08-20T00:00:00+00:00"


def test_a_row_of_units_below_the_header_is_read_as_such(target: Path) -> None:
    rows = [f"{i / 10:.1f};{i},5;{i};0,5" for i in range(40)]
    target.write_text(
        "\n".join(["Zeit;nIst_VR;T_Oel;i", "s;1/min;°C;-", *rows]).replace(".", ",") + "\n", encoding="utf-8"
    )
    log = read(target)
    assert not log.summary.damage
    assert set(log.channels) == {"nIst_VR [1/min]", "T_Oel [°C]", "i"}
    assert log.channels["nIst_VR [1/min]"].unit == "1/min"
    assert len(log.channels["i"].values) == 40
    assert any("the row below its header holds units" in n for n in log.summary.notes)


@pytest.mark.parametrize("row", ["a;b;c;d", "s;1/min;7;-", "-;-;-;-", ";;;", "s;1/min"])
def test_other_rows_are_no_units(row: str) -> None:
    assert units_of_row(row, ";", ("t", "a", "b", "c")) is None


@pytest.mark.parametrize(("date", "time"), [("Datum", "Uhrzeit"), ("Date", "Time"), ("date", "heure")])
def test_a_date_in_a_column_beside_times_of_day_dates_them(target: Path, date: str, time: str) -> None:
    moments = [datetime(2025, 1, 1, 23, 59, 58, tzinfo=UTC) + timedelta(seconds=i / 100) for i in range(400)]
    rows = [f"{m:%d.%m.%Y};{m:%H:%M:%S},{m.microsecond // 1000:03d};{i},5" for i, m in enumerate(moments)]
    target.write_text("\n".join([f"{date};{time};a", *rows]) + "\n", encoding="utf-8")
    log = read(target)
    assert (log.channels["a"].stamps == [int(m.timestamp()) * 10**9 + m.microsecond * 1000 for m in moments]).all()
    assert log.summary.start_ns == log.channels["a"].stamps[0]
    assert any(f"the date is column '{date}'" in n for n in log.summary.notes)
    assert read(target, epoch="2030-01-01T00:00:00Z").channels["a"].stamps[0] > log.channels["a"].stamps[0]


@pytest.mark.parametrize(
    ("text", "hour"), [("08:00:00.5 AM", 8), ("12:00:00.5 AM", 0), ("12:00:00.5 PM", 12), ("11:00:00.5 PM", 23)]
)
def test_dates_with_the_month_first_need_am_or_pm(text: str, hour: int) -> None:
    moment = datetime(2025, 8, 19, hour, tzinfo=UTC)
    raw = f"08/19/2025 {text}".encode()
    assert iso_ns(np.frombuffer(raw, np.uint8), 0, len(raw)) == int(moment.timestamp()) * 10**9 + 500_000_000
    assert iso_ns(np.frombuffer(raw, np.uint8), 0, len(raw) - 3) == MISSING


def test_a_column_of_text_that_may_be_time_is_named(target: Path) -> None:
    table_of(target, "Date", [f"Tue 19 Aug 08:00:{i:02d}" for i in range(20)])
    with pytest.raises(
        LogError, match=r"'Date' looks like it, but its text 'Tue 19 Aug 08:00:00' .* columns are Date, a, b"
    ):
        read(target)


def test_a_second_header_is_one_loss_and_its_line_is_named(target: Path) -> None:
    rows = [f"{i / 100},{i}.5,{i * i}" for i in range(300)]
    target.write_text("\n".join(["t,speed,pressure", *rows[:200], '"t","speed","pressure"', *rows[200:]]) + "\n")
    log = read(target)
    assert [len(c.values) for c in log.channels.values()] == [300, 300]
    (said,) = log.summary.damage
    assert "a second header in line 202" in said


def test_a_word_in_one_cell_is_no_second_header(target: Path) -> None:
    target.write_text("t,speed,pressure\n" + "".join(f"{i},{'speed' if i == 7 else i},{i}\n" for i in range(50)))
    (said,) = read(target).summary.damage
    assert "1 cells of 'speed' are not numbers" in said


def test_units_give_no_two_columns_one_name() -> None:
    assert units_of_row("s,,rpm", ",", ["time", "v [rpm]", "v"]) == ("time [s]", "v [rpm]", "v")


def test_a_cell_of_very_many_digits_costs_no_time(target: Path) -> None:
    target.write_text("t,a\n0," + "1" * 200_000 + "x\n" + "1," + "1" * 200_000 + "x\n", encoding="utf-8")
    start = time.process_time()
    separator_of(target.read_text(encoding="utf-8").splitlines())
    assert time.process_time() - start < 2.0


@pytest.mark.parametrize(("cells", "step_ns"), [("{}", 20_000_000), ("{}.5", 20_000_000_000)])
def test_whole_numbers_below_lines_of_text_are_milliseconds(target: Path, cells: str, step_ns: int) -> None:
    rows = "".join(f"{cells.format(20 * i)};{i}\n" for i in range(1, 40))
    target.write_text(f"Name;v\nComment;of the wheel\nType;REAL64\n{rows}")
    assert np.diff(read(target).channels["v"].stamps).tolist() == [step_ns] * 38
