"""`mfhca replay`: file, readings and JSON."""

from __future__ import annotations

import json
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from cli.main import run


def test_readings_are_printed_and_columns_written(
    mission_log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "loop.parquet"
    assert run(["replay", str(mission_log), "-o", str(out), "--start", "2", "--end", "4"]) == 0
    text = " ".join(capsys.readouterr().out.split())
    assert "control law" in text
    assert "200 steps of 10 ms" in text or "201 steps of 10 ms" in text
    table = pq.read_table(out)
    assert {"stamp_ns", "t", "wheel.FR.v", "replay.FR.psi_implied"} <= set(table.column_names)


def test_json(mission_log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "loop.mcap"
    assert run(["replay", str(mission_log), "-o", str(out), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["steps"] == 1200
    assert "/mfhca/psi_hat" in document["written"]
    assert document["readings"][0]["name"].startswith("commanded wheel speed")


def test_the_name_decides_the_format_before_anything_is_read(
    mission_log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["replay", str(mission_log), "-o", str(tmp_path / "loop.xlsx")]) == 2
    assert "expected .parquet, .csv or .mcap" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_a_foreign_file_is_replaced_only_when_forced(
    mission_log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("loop.csv", "loop.parquet", "loop.mcap"):
        out = tmp_path / name
        out.write_bytes(mission_log.read_bytes() if name.endswith("mcap") else b"my,own\n1,2\n")
        before = out.read_bytes()
        command = ["replay", str(mission_log), "-o", str(out), "--start", "2", "--end", "4"]
        assert run(command) == 2
        assert "no replay wrote it" in capsys.readouterr().err
        assert out.read_bytes() == before
        assert run([*command, "--force"]) == 0
        assert run(command) == 0  # its own result may be replaced


def test_raw_conversion(mission_log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "recorded"
    assert run(["replay", str(mission_log), "--raw", "-o", str(out)]) == 0
    text = capsys.readouterr().out
    assert "joint_states.parquet" in text
    assert f"Wrote {out}: " in text.replace("\n", " ")
    assert run(["replay", str(mission_log), "--raw", "-o", str(out), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["schema"] == "mfhca-raw/1"
    assert {f["topic"] for f in document["files"]} >= {"/joint_states", "/imu"}
    assert run(["replay", str(mission_log), str(mission_log.parent), "--raw", "-o", str(out)]) == 2
    assert "one log at a time" in capsys.readouterr().err
