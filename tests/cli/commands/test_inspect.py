"""`mfhca inspect` and `mfhca channels`."""

from __future__ import annotations

import json
import os
from itertools import pairwise
from pathlib import Path

import fsspec
import pytest

from cli.main import run
from cli.tables.inspection import inspect_parts, list_parts
from cli.terminal.console import Terminal
from replay.inspection.report import InspectReport, TopicTiming


def test_inspect_lists_topics_of_the_index_and_says_what_it_does_not_know(
    mission_log: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["inspect", str(mission_log)]) == 0
    seen = capsys.readouterr()
    rows = {line.split()[0]: line.split() for line in seen.out.splitlines() if line.startswith("/")}
    assert rows["/joint_states"][1:5] == ["JointState", "cdr", "1200", "100"]
    assert rows["/imu"][1] == "Imu"
    assert "2025-10-09 08:53:20" in seen.out
    assert "compression zstd" in seen.out
    assert "Only the index was read" in seen.out
    assert seen.err == ""


def test_inspect_looks_behind_urls(mission_log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    system = fsspec.filesystem("memory")
    system.pipe_file("/looked/drive.mcap", mission_log.read_bytes())
    try:
        assert run(["inspect", "memory://looked/drive.mcap"]) == 0
        first = capsys.readouterr().out
        assert run(["inspect", "memory://looked", "memory://none", str(mission_log), "--full", "--json"]) == 3
        seen = capsys.readouterr()
    finally:
        system.rm("/looked", recursive=True)
    assert "Only the index was read" in first
    logs = json.loads(seen.out)["logs"]
    assert [log["source"] for log in logs] == [str(mission_log), "memory:///looked/drive.mcap"]
    assert logs[0]["topics"] == logs[1]["topics"]
    assert "memory://none" in seen.err


def test_full_inspection_measures_timing_and_says_that_checksums_are_right(
    mission_log: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["inspect", str(mission_log), "--full"]) == 0
    out = capsys.readouterr().out
    rows = {line.split()[0]: line.split() for line in out.splitlines() if line.startswith("/")}
    assert rows["/joint_states"][1:4] == ["JointState", "1200", "100"]
    assert "checksums: all read and right" in out
    assert "Only the index" not in out


def test_several_logs_are_a_table_and_degraded_ones_are_told(
    mission_log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    torn = tmp_path / "torn.mcap"
    torn.write_bytes(mission_log.read_bytes()[:-4000])
    assert run(["inspect", str(mission_log), str(torn)]) == 0
    seen = capsys.readouterr()
    lines = {line.split()[0]: line for line in seen.out.splitlines() if line.strip()}
    folder = Path(os.path.commonpath([mission_log.parent, tmp_path]))
    assert lines["in"] == f"in {folder}{os.sep}"
    assert lines[str(mission_log.relative_to(folder))].endswith("index ok")
    assert lines["degraded:"].startswith("degraded: ")
    assert "2 logs read, 1 degraded" in seen.out
    assert run(["inspect", str(torn), "--json"]) == 0
    seen = capsys.readouterr()
    assert json.loads(seen.out)["logs"][0]["status"] == "degraded"
    assert seen.err.startswith(f"note: {torn} is degraded: ")


def test_detail_of_each_log_with_verbose(mission_log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    copy = tmp_path / "copy.mcap"
    copy.write_bytes(mission_log.read_bytes())
    assert run(["inspect", str(mission_log), str(copy), "-v"]) == 0
    assert capsys.readouterr().out.count("/joint_states ") == 2


def test_an_inspection_of_nothing_readable_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    Terminal().show(*list_parts([], ["a: no such file", "b: no such file"]))
    assert "0 logs read, 2 could not be read" in capsys.readouterr().out


def test_one_bad_file_does_not_stop_the_others(
    mission_log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bad = tmp_path / "bad.mcap"
    bad.write_bytes(b"nothing of the kind")
    assert run(["inspect", str(bad), str(mission_log), str(tmp_path / "absent.bag"), "--full", "--json"]) == 3
    seen = capsys.readouterr()
    document = json.loads(seen.out)
    assert [log["source"] for log in document["logs"]] == [str(mission_log)]
    assert len(document["errors"]) == 2
    assert [line.startswith("error: ") for line in seen.err.splitlines()] == [True, True]
    topics = {t["name"]: t for t in document["logs"][0]["topics"]}
    assert topics["/joint_states"]["rate_hz"] == pytest.approx(100.0)
    assert document["logs"][0]["duration_s"] == pytest.approx(12.0, abs=0.02)


def test_gaps_repeats_and_backward_stamps_are_told(capsys: pytest.CaptureFixture[str]) -> None:
    topics = (
        TopicTiming("/odd", "x/msg/Odd", 10, 100.0, 1, 1.7, 0.001, backwards=1, duplicates=2),
        TopicTiming("/image", "sensor_msgs/msg/Image", 3, note="holds no numbers"),
    )
    Terminal().show(*inspect_parts(InspectReport("a.mcap", "mcap", 0, 0, topics, ())))
    out = capsys.readouterr().out
    assert "a.mcap  mcap, no stamps" in out
    assert "• /odd: 1 gap, longest 1.7 s; 1 stamp goes back; 2 stamps repeat the one before" in out
    assert "• /image: holds no numbers" in out


def test_damage_is_told(mission_log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    torn = tmp_path / "torn.mcap"
    torn.write_bytes(mission_log.read_bytes()[:-4000])
    assert run(["inspect", str(torn)]) == 0
    assert "degraded: " in capsys.readouterr().out
    assert run(["channels", str(torn)]) == 0
    assert "Damage" in capsys.readouterr().out


def test_channels_show_mapping_and_costs(mission_log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["channels", str(mission_log)]) == 0
    out = capsys.readouterr().out
    row = next(line for line in out.splitlines() if line.startswith("wheel.FR.v "))
    assert row.split()[1:4] == ["/joint_states.velocity[front_right_wheel]", "rad/s", "100"]
    missing = out.partition("Missing signals and their effect")[2]
    assert "wheel.*.{pressure_a,pressure_b}" in missing


def test_channels_as_json_are_one_document(mission_log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["channels", str(mission_log), "--json"]) == 0
    seen = capsys.readouterr()
    document = json.loads(seen.out)
    assert seen.err == ""
    signals = {s["name"]: s for s in document["signals"]}
    fr = signals["wheel.FR.v"]
    assert (fr["unit"], fr["recorded_unit"], fr["guessed"], fr["samples"]) == ("m/s", "rad/s", True, 1200)
    assert fr["max"] == pytest.approx(0.3, abs=0.002)
    assert all(m["cost"] for m in document["missing"])


def test_given_signals_and_their_absence(mission_log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    machine = tmp_path / "machine.toml"
    machine.write_text(
        "[signals]\n"
        '"cmd.v" = { topic = "/cmd_vel", field = "twist.linear.x", unit = "mm/s" }\n'
        '"wheel.FR.u" = { topic = "/valves", field = "data[0]" }\n'
    )
    assert run(["channels", str(mission_log), "-m", str(machine)]) == 0
    out = capsys.readouterr().out
    assert "/cmd_vel.twist.linear.x  (given)" in out
    assert "names '/valves.data[0]', which no source holds" in out


def test_several_files_are_named(mission_log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    table = tmp_path / "plc.csv"
    rows = "".join(f"{1_760_000_000_000_000_000 + i * 10_000_000},{i / 1000}\n" for i in range(1000))
    table.write_text("time_ns,wheel.FR.pressure_a\n" + rows)
    assert run(["channels", str(mission_log), str(table)]) == 0
    out = capsys.readouterr().out
    below = {
        line.split()[0]: next_line for line, next_line in pairwise(out.splitlines()) if line.startswith("wheel.FR.")
    }
    assert "wheel.FR.pressure_a  in plc.csv" in below["wheel.FR.pressure_a"]
    assert "in drive.mcap" in below["wheel.FR.v"]


@pytest.mark.parametrize("columns", ["80", "120"])
def test_tables_keep_to_the_width(
    columns: str, mission_log: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", columns)
    assert run(["channels", str(mission_log)]) == 0
    assert run(["inspect", str(mission_log)]) == 0
    assert run(["inspect", str(mission_log), "--full"]) == 0
    assert max(len(line) for line in capsys.readouterr().out.splitlines()) <= int(columns)


def test_names_of_all_channels_are_never_broken(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    log = Path(__file__).resolve().parents[3] / "sample_logs" / "paper.mcap"
    assert run(["channels", str(log), "--all", "--json"]) == 0
    fields = [row["field"] for row in json.loads(capsys.readouterr().out)["channels"]]
    assert run(["channels", str(log), "--all"]) == 0
    words = set(capsys.readouterr().out.split())
    named = [field for field in fields if "covariance" not in field]
    assert max(map(len, named)) > 25
    assert {field for field in named if field not in words} == set()


def test_a_crash_in_one_file_does_not_stop_the_others(
    mission_log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def inspect_index(path: Path, options: object) -> InspectReport:
        if path.name == "poison.mcap":
            raise ValueError("boom")
        return InspectReport(str(path), "mcap", 0, 0, (), ())

    (tmp_path / "poison.mcap").write_text("x")
    monkeypatch.setattr("replay.inspection.inspect_log.inspect_index", inspect_index)
    monkeypatch.setenv("COLUMNS", "300")  # temporary folders have long names
    assert run(["inspect", str(tmp_path), str(mission_log)]) == 70
    seen = capsys.readouterr()
    assert "poison.mcap: ValueError: boom" in seen.err
    assert str(mission_log) in seen.out


def test_holes_in_the_values_are_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = tmp_path / "t.csv"
    log.write_text(
        "t,a,b,c\n"
        + "".join(f"{i / 10},{'' if 20 <= i < 50 else i},NaN,{'1e300' if i == 3 else 1.5}\n" for i in range(100))
    )
    assert run(["inspect", str(log), "--full"]) == 0
    out = " ".join(capsys.readouterr().out.split())
    assert "a: 30 of 100 samples hold no number, the longest stretch lasts 3.1 s, from 1.9 s on" in out
    assert "b holds no number at all" in out
    assert "c: 1 of 100 values are absurdly large (up to 1e+300)" in out


def test_a_table_has_no_index_that_could_be_right(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("a.csv", "b.csv"):
        (tmp_path / name).write_text("t,v\n" + "".join(f"{i / 10},{i}\n" for i in range(50)))
    assert run(["inspect", str(tmp_path)]) == 0
    out = capsys.readouterr().out
    assert out.count("head ok") == 2
    assert "index ok" not in out
    assert run(["inspect", str(tmp_path / "a.csv")]) == 0
    assert "Only the first and last rows were read" in capsys.readouterr().out


def test_stamps_where_64_bits_end_are_no_date(capsys: pytest.CaptureFixture[str]) -> None:
    end = 2**63 - 1
    Terminal().show(*inspect_parts(InspectReport("a.mcap", "mcap", end, end, (), ())))
    out = capsys.readouterr().out
    assert "no usable stamps" in out
    assert "2262" not in out


def test_the_summary_that_a_recorder_leaves_is_not_printed_raw(capsys: pytest.CaptureFixture[str]) -> None:
    kept = {"ros_distro": "jazzy", "rosbag2.serialized_metadata": "version: 9\nstorage_identifier: mcap"}
    Terminal().show(*inspect_parts(InspectReport("a.mcap", "mcap", 0, 10**9, (), (), metadata=kept)))
    out = capsys.readouterr().out
    assert "ros_distro: jazzy" in out
    assert "serialized_metadata" not in out


@pytest.mark.parametrize(
    ("first", "said"),
    [("0.0", "from 0.000 s of a clock without a date"), ("1760000000.0", "2025-10-09 08:53:20.000 UTC")],
)
def test_time_that_counts_from_a_start_is_no_date(
    first: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = "".join(f"{float(first) + k / 10:.1f},{k}\n" for k in range(50))
    (tmp_path / "a.csv").write_text(f"t [s],speed\n{rows}", encoding="utf-8")
    assert run(["inspect", str(tmp_path / "a.csv")]) == 0
    assert said in " ".join(capsys.readouterr().out.split())


def test_without_a_wheel_in_the_log_the_missing_machine_file_is_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = "".join(f"{k / 10:.1f},{k % 7},0.1\n" for k in range(50))
    (tmp_path / "a.csv").write_text(f"t [s],cmd.v,steer.front.phi_ref\n{rows}", encoding="utf-8")
    assert run(["channels", str(tmp_path / "a.csv")]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "no machine file was given" in said
    assert "times max_speed" not in said
