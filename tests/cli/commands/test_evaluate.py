"""`mfhca evaluate`: where results and truths are found, and what is shown."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest

from cli.main import run
from replay.export.mission import write_mission
from replay.faults import FaultMode, FaultSpec, Side
from replay.simulation.options import SimulationOptions
from replay.simulation.run import simulate_mission
from replay.truth import write_truth


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with a log of 12 s, its truth (FR speed sensor stuck from 5 to 9 s), and its report in a folder beside it."""
    folder = tmp_path_factory.mktemp("missions")
    fault = FaultSpec("FR", Side.SENSOR, FaultMode.STUCK, 5.0, 9.0, 1.0, 0.3)
    mission = simulate_mission(SimulationOptions(scenario="healthy", duration_s=12.0, rate_hz=100.0, faults=(fault,)))
    write_mission(mission, folder / "drive.mcap", "mcap")
    write_truth(mission.truth, folder / "drive.truth.json")
    assert run(["-q", "diagnose", str(folder / "drive.mcap"), "-o", str(folder / "monday")]) == 1
    return folder


def document(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> Any:
    assert run(["evaluate", *arguments, "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def test_a_log_is_diagnosed_first_and_leaves_nothing_behind(
    made: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    found = document([str(made / "drive.mcap")], capsys)
    assert list(tmp_path.iterdir()) == []
    assert found["schema"] == "mfhca-evaluation/1"
    (result,) = found["results"]
    assert result["truth"] == str(made / "drive.truth.json")
    (fault,) = result["wheel"]["faults"]
    assert (fault["component"], fault["side"], fault["mode"]) == ("FR", "sensor", "stuck")
    assert fault["outcome"] == "right"
    assert abs(fault["onset_error_s"]) <= 0.02
    assert found["all"]["wheel"]["events"]["faults"] == 1


def test_a_report_gives_the_same_as_its_log(made: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from_log, folder, file = (
        document([str(made / name)], capsys)["all"] for name in ("drive.mcap", "monday", "monday/report.json")
    )
    assert folder == file == from_log


def test_many_results_are_pooled(made: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = [str(made / "drive.mcap"), str(made / "monday")]
    found = document(arguments, capsys)
    assert len(found["results"]) == 2
    assert found["all"]["wheel"]["events"]["faults"] == 2
    assert run(["evaluate", *arguments]) == 0
    shown = capsys.readouterr().out
    assert "Missions\n" in shown
    assert "injected      2: 2 right, 0 wrong row" in shown


def test_tables(made: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["evaluate", str(made / "monday")]) == 0
    shown = capsys.readouterr().out
    for words in (
        "Wheels: states over driving time",
        "Wheels, sensor: true row against reported [s]",
        "injected      1: 1 right, 0 wrong row, 0 wrong side, 0 wrong part, 0 missed",
        "onset error   median",
        "false alarms  ",
        "■ stuck",
        "Wheels: stated probability",
        "Steering",
    ):
        assert words in shown


def test_figures_by_excitation_and_reliability_are_shown(made: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["evaluate", str(made / "monday")]) == 0
    shown = capsys.readouterr().out
    for words in ("Wheels: by severity and excitation", "ε 0.7–1", " m/s ", "masked", "r_td", "delay  ", "Brier"):
        assert words in shown
    found = document([str(made / "monday")], capsys)["all"]["wheel"]
    assert sum(b["faults"] for b in found["by_speed"]) == 1  # the commanded speed comes from report.parquet
    assert found["detection_delay_s"]["n"] == 1
    assert 0.0 <= found["detection_delay_s"]["median"] < 0.1


def test_truth_as_the_second_word(made: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    elsewhere = tmp_path / "known.json"
    elsewhere.write_bytes((made / "drive.truth.json").read_bytes())
    found = document([str(made / "monday"), str(elsewhere)], capsys)
    assert [r["truth"] for r in found["results"]] == [str(elsewhere)]
    assert run(["evaluate", str(made / "monday"), str(elsewhere), "--truth", str(elsewhere)]) == 2


def test_a_folder_stands_for_its_missions(
    made: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its reports; where it has none, its logs with a truth beside them."""
    found = document([str(made)], capsys)
    assert [r["result"] for r in found["results"]] == [str(made / "monday")]
    logs = tmp_path / "logs"
    logs.mkdir()
    for name in ("drive.mcap", "drive.truth.json"):
        (logs / name).write_bytes((made / name).read_bytes())
    (logs / "unknown.mcap").write_bytes((made / "drive.mcap").read_bytes())
    found = document([str(logs)], capsys)
    assert [r["result"] for r in found["results"]] == [str(logs / "drive.mcap")]
    monkeypatch.chdir(logs)
    assert [r["result"] for r in document(["."], capsys)["results"]] == ["drive.mcap"]


def test_page(made: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    page = tmp_path / "scores.html"
    assert run(["evaluate", str(made / "monday"), "-o", str(page)]) == 0
    assert f"Wrote {page}" in capsys.readouterr().out.replace("\n", "")
    assert "1 mission against the truth" in page.read_text(encoding="utf-8")
    report = made / "monday" / "report.json"
    assert run(["evaluate", str(report), "--html", str(report)]) == 2
    assert "would be changed" in capsys.readouterr().err
    assert document([str(made / "monday"), "--html", str(page)], capsys)["schema"] == "mfhca-evaluation/1"


def test_what_was_not_right_is_listed(made: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    truth = json.loads((made / "drive.truth.json").read_text(encoding="utf-8"))
    truth["intervals"][0] |= {"component": "RL", "start_s": 3.0, "stop_s": 4.0}
    other = tmp_path / "other.json"
    other.write_text(json.dumps(truth), encoding="utf-8")
    assert run(["evaluate", str(made / "monday"), "--truth", str(other)]) == 0
    shown = capsys.readouterr().out
    lines = shown[shown.index("Wheels: not right") :].splitlines()
    assert any(line.startswith("3.00–4.00  RL speed sensor") and "missed" in line for line in lines)
    assert any("FR speed sensor" in line and "false alarm" in line and "F1" in line for line in lines)


def test_parts_that_the_result_left_out_are_said(
    made: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "only-RL"
    assert run(["-q", "diagnose", str(made / "drive.mcap"), "--wheel", "RL", "-o", str(folder)]) == 3
    assert run(["evaluate", str(folder), "--truth", str(made / "drive.truth.json")]) == 0
    assert "FR is not in the result and not scored" in capsys.readouterr().err


def test_a_log_and_its_own_report_count_twice_which_is_said(made: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log, report = str(made / "drive.mcap"), str(made / "monday")
    assert run(["evaluate", log, report]) == 0
    assert f"{report} is a report of {log}, which is given too: the mission counts twice" in capsys.readouterr().err
    assert run(["evaluate", report]) == 0
    assert "counts twice" not in capsys.readouterr().err


def test_a_truth_outside_of_driving_is_said(made: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    truth = json.loads((made / "drive.truth.json").read_text(encoding="utf-8"))
    driving = [d for d in truth["driving"] if d["component"] == "FR"]
    before = truth["intervals"][0] | {"start_s": 0.0, "stop_s": driving[0]["start_s"]}
    (tmp_path / "t.json").write_text(json.dumps(truth | {"intervals": [before]}), encoding="utf-8")
    assert run(["evaluate", str(made / "monday"), "--truth", str(tmp_path / "t.json")]) == 0
    said = " ".join(capsys.readouterr().err.split())
    assert "the truth has faults outside of driving, where nothing can show them: FR sensor stuck from 0 to" in said


def test_what_cannot_be_evaluated_is_one_line(
    made: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    log, report = str(made / "drive.mcap"), str(made / "monday")
    lonely = tmp_path / "lonely.mcap"
    lonely.write_bytes((made / "drive.mcap").read_bytes())
    late = json.loads((made / "drive.truth.json").read_text(encoding="utf-8"))
    (tmp_path / "late.json").write_text(json.dumps(late | {"start_ns": 0}), encoding="utf-8")
    (tmp_path / "no.json").write_text("{}", encoding="utf-8")
    for arguments, code, words in (
        ([log, report, "--truth", "x.json"], 2, "--truth x.json: 2 results are given"),
        ([log, "--truth", str(tmp_path / "absent.json")], 2, "absent.json: cannot be read"),
        (
            [str(lonely)],
            2,
            f"{lonely}: no truth file; looked for {tmp_path / 'lonely.truth.json'}; name it with --truth",
        ),
        ([report, "--truth", str(tmp_path / "late.json")], 2, "do not overlap; give the truth file of this log"),
        ([str(tmp_path / "no.json")], 3, "schema None found"),
        ([str(tmp_path / "absent.mcap")], 3, "absent.mcap: no such file"),
        ([log, log], 2, "given twice"),
    ):
        assert run(["evaluate", *arguments]) == code
        seen = capsys.readouterr()
        assert seen.out == ""
        assert seen.err.startswith("error: ")
        assert seen.err.count("\n") == 1
        assert words in seen.err


def test_a_log_and_a_report_with_one_truth_are_said_to_be_both_given(
    made: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log, report, truth = made / "drive.mcap", made / "monday", made / "drive.truth.json"
    for results in ([log, report], [report, log]):
        assert run(["evaluate", *map(str, results), str(truth)]) == 2
        said = " ".join(capsys.readouterr().err.split())
        assert "a log and a report are given with one truth; give the report to score it" in said
        assert f"mfhca evaluate {report} {truth}" in said.replace("\n", "")
    other = tmp_path / "other"
    shutil.copytree(report, other)
    assert run(["evaluate", str(report), str(other), str(truth)]) == 2
    assert "a truth may follow a single result, 2 are given" in " ".join(capsys.readouterr().err.split())
