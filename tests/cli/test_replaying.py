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
    text = capsys.readouterr().out
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
