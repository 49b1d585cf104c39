"""`mfhca export`: what it refuses, writes and says."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from mcap.reader import make_reader

from cli.main import run
from diagnosis.output import write_result
from diagnosis.pipeline import diagnose
from replay.machine.config import haulotte


def topics(path: Path) -> set[str]:
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    return {c.topic for c in summary.channels.values()}


@pytest.fixture(scope="module")
def result(mission_log: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a report of the log."""
    folder = tmp_path_factory.mktemp("saved") / "report"
    write_result(diagnose([mission_log], haulotte()), folder)
    return folder


def test_a_saved_result_is_written_as_ros_messages(
    mission_log: Path, result: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "r.mcap"
    command = ["export", str(mission_log), "--diagnostics", "--result", str(result), "-o", str(out)]
    assert run([*command, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["written"][0] == str(out)
    assert topics(out) == {"/mfhca/diagnostics", "/mfhca/events"}
    assert run(command) == 0  # its own file may be replaced
    assert "Layouts for Foxglove and PlotJuggler: r.foxglove.json, r.plotjuggler.xml" in capsys.readouterr().out


def test_the_log_and_the_loop_alone(mission_log: Path, result: Path, tmp_path: Path) -> None:
    out = tmp_path / "all.mcap"
    words = ["--no-diagnostics", "--loop", "--log", "--result", str(result)]
    assert run(["export", str(mission_log), "-o", str(out), *words]) == 0
    assert "/mfhca/u_replayed" in topics(out)
    assert "/mfhca/diagnostics" not in topics(out)
    assert topics(mission_log) <= topics(out)
    assert [p.name for p in tmp_path.iterdir()] == ["all.mcap"]


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (["-o", "r.json"], 2, "the file is MCAP"),
        (["-o", "r.mcap", "--no-diagnostics"], 2, "nothing is left to write"),
        (["-o", "mine.mcap"], 2, "no export wrote it"),
        (["-o", "r.mcap", "--result", "nowhere"], 3, "no such file"),
    ],
)
def test_what_cannot_be_done_is_said_before_anything_is_read(
    mission_log: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    words: list[str],
    code: int,
    said: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.mcap").write_bytes(b"mine")
    assert run(["export", str(mission_log), *words]) == code
    assert said in capsys.readouterr().err
    assert (tmp_path / "mine.mcap").read_bytes() == b"mine"


def test_a_log_is_never_replaced(mission_log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = mission_log.read_bytes()
    assert run(["export", str(mission_log), "-o", str(mission_log), "--force"]) == 2
    assert mission_log.read_bytes() == before


def test_a_report_in_place_of_its_log_is_told_how_to_be_given(
    result: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "r.mcap"
    for saved in (result, result / "report.json"):
        assert run(["export", str(saved), "-o", str(out)]) == 2
        assert f"mfhca export LOG -o {out} --result {saved}" in capsys.readouterr().err.replace("\n", " ")
    assert not out.exists()
