"""`--previous` of `mfhca diagnose` and `mfhca report`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from cli.main import run


@pytest.fixture(scope="module")
def older(mission_log: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Result of the mission, an hour older by its log's clock, and without its fault."""
    folder = tmp_path_factory.mktemp("monday")
    assert (
        run(["-q", "diagnose", str(mission_log), "-o", str(folder), "--machine-id", "HX4-07", "--fail-on", "never"])
        == 0
    )
    report = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    report["log"]["start_ns"] -= 3600 * 10**9
    report["log"]["files"][0]["path"] = "monday.mcap"
    report["intervals"] = []
    (folder / "report.json").write_text(json.dumps(report), encoding="utf-8")
    return folder


def diagnose(log: Path, out: Path, *words: str) -> int:
    return run(["diagnose", str(log), "-o", str(out), "--machine-id", "HX4-07", *words])


def load(folder: Path) -> dict[str, Any]:
    return json.loads((folder / "report.json").read_text(encoding="utf-8"))  # type: ignore[no-any-return]


def test_comparison_in_terminal_result_and_page(
    mission_log: Path, older: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert diagnose(mission_log, tmp_path, "--previous", str(older)) == 1
    out = capsys.readouterr().out
    assert "Faults: 1 new (previous mission: monday.mcap)" in out
    assert "new: FR speed sensor stuck" in out
    assert load(tmp_path)["previous"]["counts"] == {"new": 1}
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "Against the previous mission" in page
    # from the result alone, without the older one
    assert run(["-q", "report", str(tmp_path)]) == 0
    assert (tmp_path / "report.html").read_text(encoding="utf-8") == page


def test_comparison_can_be_added_later(mission_log: Path, older: Path, tmp_path: Path) -> None:
    assert diagnose(mission_log, tmp_path, "-q") == 1
    assert "previous" not in load(tmp_path)
    assert "Against the previous" not in (tmp_path / "report.html").read_text(encoding="utf-8")
    assert run(["-q", "report", str(tmp_path), "--previous", str(older / "report.json")]) == 0
    assert load(tmp_path)["previous"]["counts"] == {"new": 1}
    assert "Against the previous" in (tmp_path / "report.html").read_text(encoding="utf-8")


def test_another_machine_is_refused_before_the_log_is_read(
    mission_log: Path, older: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["diagnose", str(mission_log), "-o", str(tmp_path / "new"), "--machine-id", "HX4-09"]
    assert run([*words, "--previous", str(older)]) == 2
    error = capsys.readouterr().err
    assert "HX4-07" in error
    assert "HX4-09" in error
    assert not (tmp_path / "new").exists()


def test_what_is_no_result_is_refused(mission_log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert diagnose(mission_log, tmp_path, "--previous", str(tmp_path / "absent")) == 3
    assert "no such file" in capsys.readouterr().err
    assert diagnose(mission_log, tmp_path, "--previous", str(mission_log)) == 3
    assert "is not a report.json" in capsys.readouterr().err
