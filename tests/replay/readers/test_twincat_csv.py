from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from replay.errors import LogError
from replay.rawlog import RawLog
from replay.readers.registry import open_log, read_log
from replay.sources import SourceOptions

START = 133_000_000_000_000_000  # FILETIME
START_NS = (START - 116_444_736_000_000_000) * 100

# Command-line tool, German PC: tab, decimal comma, 17 rows; a 1 ms group of two and a 5 ms group that starts at −3 ms.
TOOL = [
    "Name\tScope Project",
    "File\tC:\\data\\Mission.tcscopex",
    f"Starttime of export\t{START}\tMittwoch, 15. Juni 2022\t10:00:00",
    f"Endtime of export\t{START + 100_000}\tMittwoch, 15. Juni 2022\t10:00:00",
    "",
    "",
    "Name\tfbWheel[1].fVelocity\tfbWheel[2].fVelocity\tName\tDruck Öl ²",
    "SymbolComment\t\tzweite\tSymbolComment\t",
    "Data-Type\tREAL64\tREAL64\tData-Type\tINT16",
    "SampleTime[ms]\t1\t1\tSampleTime[ms]\t0,2",
    "VariableSize\t8\t8\tVariableSize\t2",
    "SymbolBased\tTrue\tTrue\tSymbolBased\tTrue",
    "IndexGroup\t16448\t16448\tIndexGroup\t16448",
    "IndexOffset\t385000\t385008\tIndexOffset\t385016",
    "SymbolName\tMAIN.fbWheel[1].fVelocity\tMAIN.fbWheel[2].fVelocity\tSymbolName\tGVL.nPressure",
    "NetID\t5.24.36.48.1.1\t5.24.36.48.1.1\tNetID\t5.24.36.48.1.1",
    "Port\t851\t851\tPort\t851",
    "Offset\t0\t10\tOffset\t0",
    "ScaleFactor\t1\t0,5\tScaleFactor\t1",
    "BitMask\t0xFF\t0xFF\tBitMask\t0xFF",
    "Unit\trpm (Rotation)\tV (Voltage)\tUnit\t(None)",
    "Unit ScaleFactor\t1\t1\tUnit ScaleFactor\t1",
    "Unit Offset\t0\t0\tUnit Offset\t0",
    "",
    "0\t1,5\t-2,25\t-3\t100",
    "1\t1,75\t2,5E-05\t2\t101",
    "2\t2\tNaN",
    "3\t2,25\t4\t \t ",
]


def write(path: Path, lines: list[str], end: str = "EOF", encoding: str = "utf-8", newline: str = "\r\n") -> Path:
    text = newline.join([*lines, end] if end else lines) + newline
    path.write_bytes(text.encode(encoding))
    return path


def read(path: Path, **options: object) -> RawLog:
    assert open_log(path).format == "twincat"
    return read_log(path, SourceOptions(**options))  # type: ignore[arg-type]


@pytest.fixture
def target(tmp_path: Path) -> Path:
    return tmp_path / "scope.csv"


def check_tool(log: RawLog) -> None:
    first, second = log.channels["MAIN.fbWheel[1].fVelocity"], log.channels["MAIN.fbWheel[2].fVelocity"]
    assert first.values.tolist() == [1.5, 1.75, 2.0, 2.25]
    np.testing.assert_array_equal(second.values, [-2.25, 2.5e-05, np.nan, 4.0])
    assert (first.stamps - START_NS).tolist() == [0, 1_000_000, 2_000_000, 3_000_000]
    slow = log.channels["GVL.nPressure"]
    assert slow.values.tolist() == [100, 101]
    assert (slow.stamps - START_NS).tolist() == [-3_000_000, 2_000_000]
    assert log.summary.damage == ()


def test_tool_dialect_with_groups_of_different_length(target: Path) -> None:
    log = read(write(target, TOOL))
    check_tool(log)
    assert [c.unit for c in log.channels.values()] == ["rpm", "V", None]
    assert log.channels["GVL.nPressure"].field == "Druck Öl ²"
    assert [(t.count, t.fields[-1]) for t in log.summary.topics] == [
        (4, "MAIN.fbWheel[2].fVelocity"),
        (2, "GVL.nPressure"),
    ]
    assert log.summary.metadata["scope.name"] == "Scope Project"


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "cp1252"])
@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_encodings_and_line_ends(target: Path, encoding: str, newline: str) -> None:
    log = read(write(target, TOOL, encoding=encoding, newline=newline))
    check_tool(log)
    assert log.channels["GVL.nPressure"].field == "Druck Öl ²"
    assert any("Windows-1252" in n for n in log.summary.notes) == (encoding == "cp1252")


def test_scaling_only_on_demand(target: Path) -> None:
    log = read(write(target, TOOL), scale=True)
    np.testing.assert_array_equal(
        log.channels["MAIN.fbWheel[2].fVelocity"].values, [-2.25 * 0.5 + 10, 2.5e-05 * 0.5 + 10, np.nan, 12.0]
    )


def test_dialog_dialect_with_the_name_row_alone(target: Path) -> None:
    lines = [
        "Name,Scope,",
        "File,x.tcscopex,",
        f"Starttime of export,{START},2022-06-15,10:00:00",
        f"Endtime of export,{START},2022-06-15,10:00:00",
        "",
        "",
        "Name,Speed {left},Name,Speed {left} (1),",
        "",
        "0,1.5,0,7,",
        "0.2,-1.5,5,8,",
        "0.4,2.5, , ,",
    ]
    log = read(write(target, lines, end=""))
    assert log.channels["Speed {left}"].values.tolist() == [1.5, -1.5, 2.5]
    assert log.channels["Speed {left} (1)"].values.tolist() == [7.0, 8.0]
    assert (log.channels["Speed {left}"].stamps - START_NS).tolist() == [0, 200_000, 400_000]


def test_comma_as_separator_tears_only_the_sample_time(target: Path) -> None:
    lines = [
        "Name,Scope",
        "File,x",
        f"Starttime of export,{START},a,b",
        "",
        "Name,a,Name,b",
        "SampleTime[ms],0,2,SampleTime[ms],0,2",
        "SymbolName,MAIN.a,SymbolName,MAIN.b",
        "",
        "0,1.5,0,2.5",
        "0.2,3.5,0.2,4.5",
    ]
    log = read(write(target, lines))
    assert log.channels["MAIN.a"].values.tolist() == [1.5, 3.5]
    assert log.channels["MAIN.b"].values.tolist() == [2.5, 4.5]


def test_full_time_stamps_stay_exact(target: Path) -> None:
    lines = [*TOOL[:24], *(f"{START + i * 10_001}\t{i}\t0\t{START + i}\t{i}" for i in range(3))]
    log = read(write(target, lines))
    assert (log.channels["MAIN.fbWheel[1].fVelocity"].stamps - START_NS).tolist() == [0, 1_000_100, 2_000_200]
    assert (log.channels["GVL.nPressure"].stamps - START_NS).tolist() == [0, 100, 200]


def test_a_symbol_shown_twice_and_a_comment_of_several_lines(target: Path) -> None:
    lines = [x.replace("GVL.nPressure", "MAIN.fbWheel[1].fVelocity") for x in TOOL]
    lines[7] = "SymbolComment\tfirst\n\n2 lines\tzweite\tSymbolComment\t"
    log = read(write(target, lines, newline="\n"))
    assert log.channels["MAIN.fbWheel[1].fVelocity"].values.tolist() == [1.5, 1.75, 2.0, 2.25]
    assert log.channels["MAIN.fbWheel[1].fVelocity (0,2 ms)"].values.tolist() == [100, 101]


def test_a_trigger_table_before_the_data(target: Path) -> None:
    lines = [*TOOL[:24], "TriggerGroup\tCount\tReleaseTime\tComment", "1\t1\t133000000000000000\tx", "", *TOOL[24:]]
    check_tool(read(write(target, lines)))


def test_short_header_and_twincat_2(target: Path) -> None:
    lines = [
        "Name\tScope",
        "File\tx",
        f"StartRecord\t{START}",
        f"EndRecord\t{START}",
        "",
        "Name\ta",
        "NetId\t1.2.3.4.1.1",
        "Port\t801",
        "SampleTime\t10",
        "SymbolBased TRUE",
        "SymbolName\tMAIN.a",
        "SymbolComment\t",
        "",
        "0\t1.5",
        "10\t2.5",
    ]
    log = read(write(target, lines, end=""))
    assert log.channels["MAIN.a"].values.tolist() == [1.5, 2.5]
    assert log.channels["MAIN.a"].stamps.tolist() == [START_NS, START_NS + 10_000_000]


def test_an_export_that_was_cut_off_loses_its_last_row(target: Path) -> None:
    whole = write(target, TOOL).read_bytes()
    target.write_bytes(whole[: whole.index(b"2,25\t4") + 2])
    log = read(target)
    assert len(log.channels["MAIN.fbWheel[1].fVelocity"].values) == 3
    assert any("does not end in EOF" in d for d in log.summary.damage)


def test_cells_that_are_no_numbers_are_counted(target: Path) -> None:
    lines = [x.replace("1\t1,75", "1\t###") for x in TOOL]
    log = read(write(target, lines))
    np.testing.assert_array_equal(log.channels["MAIN.fbWheel[1].fVelocity"].values, [1.5, np.nan, 2.0, 2.25])
    assert any("1 cells of MAIN.fbWheel[1].fVelocity are no numbers" in d for d in log.summary.damage)


HEAD = ["Name,Scope", "File,x", f"Starttime of export,{START},a,b", ""]


@pytest.mark.parametrize(
    ("lines", "reason"),
    [
        ([*HEAD, "Name,a", "", "0,0,1,5", "0,2,1,5"], "both separator and decimal sign"),
        ([x.replace(",", " ") for x in HEAD] + ["Name a", "", "0 1", "1 2"], "blank separates"),
        ([*HEAD, "Name,a,b", "", "1.5,2.5", "3.5,4.5"], "timelines"),
        ([*HEAD, "", "0,1", "1,2"], "no row of channel names"),
        ([*HEAD, "Name,a", ""], "no row of data"),
        ([x.replace(",", "\t") for x in HEAD] + ["Name\ta", "", "0\t1.234,5", "1\t2.5"], "both point and comma"),
    ],
)
def test_exports_that_cannot_be_read_say_how_to_export_again(target: Path, lines: list[str], reason: str) -> None:
    write(target, lines, end="")
    with pytest.raises(LogError, match=reason):
        read_log(target, SourceOptions())
