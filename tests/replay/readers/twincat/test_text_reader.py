from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from replay.errors import LogError
from replay.log.raw_log import RawLog
from replay.log.source_options import SourceOptions
from replay.readers.registry import open_log, read_log, summarise_log
from replay.readers.tables import text_file
from replay.readers.twincat import text_header

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


@pytest.mark.parametrize(("later_s", "told"), [(0.5, False), (60.0, True)])
def test_a_header_that_ends_later_than_the_rows_is_told(target: Path, later_s: float, told: bool) -> None:
    lines = list(TOOL)
    at = next(i for i, line in enumerate(lines) if line.lower().startswith("endtime"))
    lines[at] = f"EndTime of export\t{START + int(later_s * 1e7)}\t2022-06-15\t10:01:00"
    notes = read(write(target, lines)).summary.notes
    assert any("end 60.0 s later than its rows" in n for n in notes) is told


def test_cells_that_are_no_numbers_are_counted(target: Path) -> None:
    lines = [x.replace("1\t1,75", "1\t###") for x in TOOL]
    log = read(write(target, lines))
    np.testing.assert_array_equal(log.channels["MAIN.fbWheel[1].fVelocity"].values, [1.5, np.nan, 2.0, 2.25])
    assert any("1 cells of MAIN.fbWheel[1].fVelocity are not numbers" in d for d in log.summary.damage)


def changed(lines: list[str], **cells: str) -> list[str]:
    """Lines of the export with some header rows replaced."""
    rows = {key.replace("_", " "): row for key, row in cells.items()}
    return [f"{x.split(chr(9))[0]}\t{rows[x.split(chr(9))[0]]}" if x.split("\t")[0] in rows else x for x in lines]


def test_a_torn_sample_time_is_put_together_again(target: Path) -> None:
    lines = [
        "Name,Scope",
        "File,x",
        f"Starttime of export,{START},a,b",
        "",
        "Name,a,b,Name,c",
        "SampleTime[ms],0,2,0,2,SampleTime[ms],10",
        "SymbolName,MAIN.a,MAIN.b,SymbolName,MAIN.c",
        "",
        "0,1.5,2.5,0,3.5",
        "0.2,1.5,2.5,10,4.5",
    ]
    log = read(write(target, lines))
    assert [t.name for t in log.summary.topics] == ["group 1 (0,2 ms)", "group 2 (10 ms)"]
    lines[5] = "SampleTime[ms],0,2,1,SampleTime[ms],10"
    log = read(write(target, lines))
    assert [t.name for t in log.summary.topics] == ["group 1", "group 2"]
    assert [*log.channels] == ["MAIN.a", "MAIN.b", "MAIN.c"]


def test_scaling_factors_that_the_separator_tore_apart_are_refused(target: Path) -> None:
    lines = [
        *("Name,Scope", "File,x", f"Starttime of export,{START},a,b", "", "Name,a,b", "SymbolName,MAIN.a,MAIN.b"),
        *("ScaleFactor,0,5,1", "", "0,1.5,1.5", "1,2.5,2.5"),
    ]
    assert read(write(target, lines)).channels["MAIN.a"].values.tolist() == [1.5, 2.5]
    with pytest.raises(LogError, match="splits ScaleFactor or Offset"):
        read(target, scale=True)


@pytest.mark.parametrize(
    "dropped",
    [
        ("Unit", "Unit ScaleFactor", "Unit Offset"),  # older exports: the first 14 rows
        tuple(x.split("\t")[0] for x in TOOL[7:23] if not x.startswith(("SampleTime", "SymbolBased", "SymbolName", "NetID", "Port"))),
        tuple(x.split("\t")[0] for x in TOOL[7:23]),  # the Name row alone
    ],
)  # fmt: skip
def test_older_and_short_headers(target: Path, dropped: tuple[str, ...]) -> None:
    lines = [*TOOL[:7], *(x for x in TOOL[7:] if x.split("\t")[0] not in dropped)]
    log = read(write(target, lines))
    assert [c.values.tolist()[:2] for c in log.channels.values()] == [[1.5, 1.75], [-2.25, 2.5e-05], [100, 101]]


def test_names_with_blanks_umlauts_brackets_and_a_cut_off_nc_symbol(target: Path) -> None:
    name = "\tÖldruck [bar] ²{links\tAxis 1 (Enc\tName\tc d"
    lines = changed(TOOL, SymbolName="Axes.Axis 1.ToPlc (Enc\tÖldruck [bar] ²{links\tSymbolName\tc d")
    lines[6] = "Name" + name
    log = read(write(target, lines))
    assert [*log.channels] == ["Axes.Axis 1.ToPlc (Enc", "Öldruck [bar] ²{links", "c d"]
    assert [c.field for c in log.channels.values()] == ["Öldruck [bar] ²{links", "Axis 1 (Enc", "c d"]


@pytest.mark.parametrize(
    ("rows", "label"),
    [
        ({"NetID": "5.1\t5.2\tNetID\t5.1"}, "MAIN.v (5.2)"),
        ({"Port": "851\t852\tPort\t851"}, "MAIN.v (port 852)"),
        ({"SampleTime[ms]": "1\t10\tSampleTime[ms]\t1"}, "MAIN.v (10 ms)"),
        ({}, "MAIN.v (1)"),
    ],
)
def test_the_key_of_a_channel_is_net_port_symbol_and_sample_time(
    target: Path, rows: dict[str, str], label: str
) -> None:
    lines = changed(TOOL, **{"SymbolName": "MAIN.v\tMAIN.v\tSymbolName\tx"} | rows)
    log = read(write(target, lines))
    assert [*log.channels] == ["MAIN.v", label, "x"]
    assert log.channels["MAIN.v"].values.tolist() == [1.5, 1.75, 2.0, 2.25]


def test_blank_time_cells_on_the_grid_are_filled_and_others_counted(target: Path) -> None:
    rows = ["0\t1\t1", "1\t2\t2", " \t3\t3", "3\t4\t4", "\t5\t5", "9\t6\t6", "10\t7\t7", "\t\t"]
    log = read(write(target, [*TOOL[:24], *rows]))
    first = log.channels["MAIN.fbWheel[1].fVelocity"]
    assert ((first.stamps - START_NS) // 1_000_000).tolist() == [0, 1, 2, 3, 9, 10]
    assert first.values.tolist() == [1, 2, 3, 4, 6, 7]
    assert any("1 blank time cells got the time half-way" in n for n in log.summary.notes)
    assert log.summary.damage == ("scope.csv, group 1: 1 rows hold values without a time and were left out",)


def test_samples_repeated_by_fill_with_previous_value_are_left_out(target: Path) -> None:
    head = changed(TOOL[:24], **{"SampleTime[ms]": "1\t3\tSampleTime[ms]\t5"})
    rows = [f"{i}\t{i * i}\t{(i + 1) // 3}" for i in range(12)]
    log = read(write(target, [*head, *rows]))
    fast, slow = log.channels["MAIN.fbWheel[1].fVelocity"], log.channels["MAIN.fbWheel[2].fVelocity"]
    assert len(fast.values) == 12
    assert slow.values.tolist() == [1, 2, 3, 4]
    assert ((slow.stamps - START_NS) // 1_000_000).tolist() == [2, 5, 8, 11]
    assert any("MAIN.fbWheel[2].fVelocity repeat slower samples" in n for n in log.summary.notes)


def test_samples_that_only_seem_repeated_stay_and_are_told(target: Path) -> None:
    lines = [*TOOL[:7], "", *(f"{i}\t{i * i}\t{i // 4}" for i in range(200))]
    log = read(write(target, lines))
    assert len(log.channels["fbWheel[2].fVelocity"].values) == 200
    assert any("fbWheel[2].fVelocity change only every few rows" in n for n in log.summary.notes)


def test_twincat_2_with_its_own_order_and_types(target: Path) -> None:
    lines = [
        *("Name\tScope", "File\tx.tsc", f"StartRecord\t{START}", f"EndRecord\t{START}", "", ""),
        *("Name\ta\tName\tb", "NetId\t1.2.3.4.1.1\tNetId\t1.2.3.4.1.1", "Port\t801\tPort\t801"),
        *("SampleTime\t10\tSampleTime\t20", "SymbolBased\tTRUE\tSymbolBased\tTRUE"),
        *("SymbolName\tMAIN.a\tSymbolName\tMAIN.b", "SymbolComment\t\tSymbolComment\t"),
        *("Data-Type\tADST_REAL32\tData-Type\tADST_INT16", "", "0\t1.5\t0\t3", "10\t2.5\t20\t4"),
    ]
    log = read(write(target, lines, end=""))
    assert [(c.values.tolist(), c.type_name) for c in log.channels.values()] == [
        ([1.5, 2.5], "ADST_REAL32"),
        ([3, 4], "ADST_INT16"),
    ]
    assert log.channels["MAIN.b"].stamps.tolist() == [START_NS, START_NS + 20_000_000]


def test_symbols_of_two_dimensions_with_a_comma_as_separator(target: Path) -> None:
    lines = [
        *("Name,Scope", "File,x", f"Starttime of export,{START},a,b", "", "Name,a[1,2],b[2,2]", "Port,851,851"),
        *("", "0,1.5,7", "1,2.5,8"),
    ]
    log = read(write(target, lines))
    assert [*log.channels] == ["a[1,2]", "b[2,2]"]
    assert log.channels["b[2,2]"].values.tolist() == [7, 8]


def test_long_integers_stay_exact(target: Path) -> None:
    lines = [x.replace("0\t1,5\t", "0\t9007199254740993\t").replace("1,75", "2") for x in TOOL]
    lines = [x.replace("3\t2,25", "3\t-9223372036854775807") for x in lines]
    values = read(write(target, lines)).channels["MAIN.fbWheel[1].fVelocity"].values
    assert values.tolist() == [9007199254740993, 2, 2, -9223372036854775807]


def test_a_decimal_comma_that_comes_late(target: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(text_header, "_SAMPLE", 40)
    monkeypatch.setattr(text_file.TextFile, "tail", lambda self, skip: b"")
    lines = [*TOOL[:24], *(f"{i}\t{i}\t{i}" for i in range(20)), "20\t0,5\t0", "21\t1\t0,25"]
    log = read(write(target, lines))
    assert log.channels["MAIN.fbWheel[1].fVelocity"].values.tolist() == [*range(20), 0.5, 1.0]
    assert log.summary.damage == ()


@pytest.mark.parametrize("size", [64, 97, 300])
def test_blocks_change_nothing(target: Path, size: int, monkeypatch: pytest.MonkeyPatch) -> None:
    rows = [f"{i},5\t{i * 7 % 13}\t{-i}\t{i * 5}\t{i}" for i in range(60)] + [f"{i}\t1\t0,5" for i in range(61, 90)]
    whole = read(write(target, [*TOOL[:24], *rows]))
    monkeypatch.setattr(text_file, "BLOCK", size)
    parts = read_log(target, SourceOptions())
    assert parts.summary == whole.summary
    for name, channel in whole.channels.items():
        np.testing.assert_array_equal(parts.channels[name].values, channel.values)
        np.testing.assert_array_equal(parts.channels[name].stamps, channel.stamps)


def test_a_window_cuts_every_group_by_its_own_stamps(target: Path) -> None:
    write(target, TOOL)
    log = read_log(target, SourceOptions(), window=(START_NS + 1_000_000, START_NS + 3_000_000))
    assert log.channels["MAIN.fbWheel[1].fVelocity"].values.tolist() == [1.75, 2.0]
    assert log.channels["GVL.nPressure"].values.tolist() == [101]


def test_the_summary_comes_from_head_and_tail(target: Path) -> None:
    rows = [f"{i}\t{i * i}\t0\t{5 * i}\t1" for i in range(2000)] + [f"{i}\t{i * i}\t0" for i in range(2000, 9000)]
    log = read(write(target, [*TOOL[:24], *rows]))
    index = summarise_log(target, SourceOptions())
    assert (index.start_ns, index.metadata) == (log.summary.start_ns, log.summary.metadata)
    assert [t.fields for t in index.topics] == [t.fields for t in log.summary.topics]
    assert index.topics[0].count == log.summary.topics[0].count == 9000
    assert "estimated" in index.topics[1].note
    assert abs(index.topics[1].count - 1800) <= 2  # as if it went on to the end of the first group


def test_a_last_row_of_the_dialog_dialect_that_was_cut_off(target: Path) -> None:
    lines = [*HEAD, "Name,a,Name,b", "", "0,1.5,0,2.5", "1,2.5,1,3.5", "2,4.5,2"]
    target.write_text("\n".join(lines))
    log = read(target)
    assert log.channels["a"].values.tolist() == [1.5, 2.5]
    assert any("ends in the middle of a row" in d for d in log.summary.damage)


def test_zeros_of_a_lost_tail_are_told(target: Path) -> None:
    raw = write(target, TOOL).read_bytes()
    target.write_bytes(raw[: raw.index(b"2\t2\tNaN")] + bytes(5000))
    log = read(target)
    assert log.channels["MAIN.fbWheel[1].fVelocity"].values.tolist() == [1.5, 1.75]
    assert any("4999 bytes are zero" in d for d in log.summary.damage)
    assert any("does not end in EOF" in d for d in log.summary.damage)


def test_an_export_without_a_header_says_how_to_export_again(target: Path) -> None:
    write(target, ["0,5\t1,5\t0\t100", "1,5\t1,75\t5\t101", "2,5\t2\t10\t102"])
    with pytest.raises(LogError, match=r'header "None".*export again with the full header'):
        read_log(target, SourceOptions())


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
