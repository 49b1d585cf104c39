"""`mfhca diagnose` and `mfhca report`: what they call, print and end with."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from rich.console import Console

from cli.main import run
from cli.tables.verdict import verdict_parts
from diagnosis.results.document import ReportDocument
from diagnosis.results.result import MissionResult
from replay.errors import NotJudged
from replay.export.mission import write_mission
from replay.progress import Progress, Stage
from replay.simulation.options import SimulationOptions
from replay.simulation.run import simulate_mission
from tests.whole_documents import whole_report


def interval(severity: str, number: int = 1) -> dict[str, Any]:
    return {
        "id": f"F{number}",
        "component": "FR",
        "kind": "wheel",
        "side": "sensor",
        "mode": "stuck",
        "start_s": 5.0,
        "stop_s": 9.0,
        "epsilon": {"value": 1.0, "low": 0.99, "high": 1.0},
        "sat": {"mean": 0.3, "rms": 0.3, "low": 0.29, "high": 0.31, "unit": "m/s"},
        "probability": 0.999,
        "severity": severity,
    }


def result(*severities: str) -> MissionResult:
    verdict = {
        "status": "stop" if severities else "ready",
        "title": f"{len(severities)} faults [/]",
        "text": "The FR speed sensor was stuck.",
        "caveats": ["Steering is not assessed."],
        "actions": [{"n": 1, "text": "Repair it.", "faults": ["F1"], "severity": "high"}] if severities else [],
    }
    intervals = [interval(s, i) for i, s in enumerate(severities, 1)]
    return MissionResult(report_of(verdict, intervals), {"t": np.arange(2.0)})


def report_of(verdict: dict[str, Any], intervals: list[dict[str, Any]]) -> ReportDocument:
    machine = {"wheels": ["FR"]}
    log = {"files": [{"path": "drive.mcap"}], "duration_s": 12.0, "open_loop": False}
    return whole_report({"log": log, "machine": machine, "verdict": verdict, "intervals": intervals})


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> dict[str, Any]:
    """Replace the pipeline by one that returns `calls['result']` and notes what it was asked."""
    seen: dict[str, Any] = {"result": result()}

    def diagnose(paths: list[Path], machine: Any, **options: Any) -> MissionResult:
        seen.update(paths=paths, machine=machine, **options)
        options["progress"](Progress(Stage.READING, "drive.mcap"))
        if isinstance(seen["result"], Exception):
            raise seen["result"]
        return seen["result"]  # type: ignore[no-any-return]

    def write_result(result: MissionResult, folder: Path, *, max_size_mb: float) -> tuple[Path, ...]:
        seen.update(folder=folder, max_size_mb=max_size_mb)
        return folder / "report.html", folder / "report.json"

    monkeypatch.setattr("diagnosis.pipeline.diagnose", diagnose)
    monkeypatch.setattr("diagnosis.output.write_result", write_result)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "drive.mcap").write_text("x")
    return seen


@pytest.mark.parametrize(
    ("severities", "fail_on", "code"),
    [
        ((), "info", 0),
        (("info",), "low", 0),
        (("info",), "info", 1),
        (("low",), "low", 1),
        (("low", "medium"), "high", 0),
        (("medium", "high"), "high", 1),
        (("high",), "never", 0),
    ],
)
def test_exit_code_by_severity(severities: tuple[str, ...], fail_on: str, code: int, calls: dict[str, Any]) -> None:
    calls["result"] = result(*severities)
    assert run(["diagnose", "drive.mcap", "--fail-on", fail_on]) == code


def test_options_reach_the_pipeline(calls: dict[str, Any]) -> None:
    Path("crane.toml").write_text('[machine]\nname = "Crane"\n')
    words = "diagnose drive.mcap -m crane.toml --start 1 --end 9 -w rl -w FR --machine-id HX4 -o out --max-size 5"
    assert run(words.split()) == 0
    assert calls["paths"] == [Path("drive.mcap")]
    assert (calls["machine"].name, calls["machine_source"], calls["machine_id"]) == ("Crane", "crane.toml", "HX4")
    assert (calls["start_s"], calls["stop_s"], calls["wheels"]) == (1.0, 9.0, ("FR", "RL"))
    assert (calls["folder"], calls["max_size_mb"]) == (Path("out"), 5.0)


@pytest.mark.parametrize(
    ("log", "folder"),
    [
        ("drive.mcap", "drive-report"),
        ("a.b.csv.gz", "a.b-report"),
        ("plain", "plain-report"),
        ("rec.v1", "rec.v1-report"),
    ],
)
def test_the_default_folder_stands_in_the_current_one(log: str, folder: str, calls: dict[str, Any]) -> None:
    path = Path("deep") / log
    if log.startswith("rec"):
        path.mkdir(parents=True)
    else:
        path.parent.mkdir()
        path.write_text("x")
    assert run(["diagnose", str(path)]) == 0
    assert calls["folder"] == Path(folder)


def test_the_verdict_is_printed(calls: dict[str, Any], capsys: pytest.CaptureFixture[str]) -> None:
    calls["result"] = result("high")
    run(["diagnose", "drive.mcap"])
    seen = capsys.readouterr()
    assert seen.out.startswith(" STOP AND REPAIR – must not go out before repair\n1 faults [/]\n")
    for words in (
        "Repair it.  F1",
        "■ stuck",
        "5.00–9.00",
        "1.00 (0.99–1.00)",
        "+0.300 m/s",
        "0.999",
        "Steering is not",
    ):
        assert words in seen.out
    assert seen.out.endswith("Report: drive-report/report.html\n")
    assert seen.err == ""


def test_many_faults_are_cut_with_a_word_about_it(calls: dict[str, Any], capsys: pytest.CaptureFixture[str]) -> None:
    many = result(*["medium"] * 55)
    for k, fault in enumerate(many.report["intervals"]):
        fault["component"] = f"wheel {k // 2}"  # two of a part may be two faults
    calls["result"] = many
    run(["diagnose", "drive.mcap"])
    assert "… and 15 more in the report" in capsys.readouterr().out


def test_what_comes_again_and_again_is_one_line(calls: dict[str, Any], capsys: pytest.CaptureFixture[str]) -> None:
    calls["result"] = result(*["medium"] * 55)
    run(["diagnose", "drive.mcap"])
    seen = capsys.readouterr().out
    assert "stuck, 55 times" in seen
    assert "more in the report" not in seen


def test_one_line_of_spells_says_between_which_values_they_lie(
    calls: dict[str, Any], capsys: pytest.CaptureFixture[str]
) -> None:
    several = result(*["medium"] * 3)
    for fault, p, loss in zip(several.report["intervals"], (0.6, 0.96, 0.7), (0.15, 0.1, 0.47), strict=True):
        fault["probability"] = p
        fault["epsilon"] = {"value": loss, "low": 0.0, "high": 0.9}
    several.report["intervals"][2]["sat"] = None
    calls["result"] = several
    run(["diagnose", "drive.mcap"])
    seen = capsys.readouterr().out
    assert "0.600 to 0.960" in seen
    assert "0.10 to 0.47" in seen
    assert "differs" in seen


def test_a_spell_whose_kind_is_unclear_stands_beside_those_that_are_clear(
    calls: dict[str, Any], capsys: pytest.CaptureFixture[str]
) -> None:
    several = result(*["medium"] * 4)
    rows = [("stuck", 0.4), ("noisy", 0.35), ("inefficient", 0.25)]
    several.report["intervals"][2]["hypotheses"] = [{"side": "sensor", "mode": mode, "p": p} for mode, p in rows]
    calls["result"] = several
    run(["diagnose", "drive.mcap"])
    seen = capsys.readouterr().out
    assert "stuck, 3 times" in seen
    assert "faulty, kind unclear" in seen


def test_json_is_the_report_alone(calls: dict[str, Any], capsys: pytest.CaptureFixture[str]) -> None:
    calls["result"] = result("low")
    assert run(["diagnose", "drive.mcap", "--json", "-v"]) == 1
    seen = capsys.readouterr()
    assert json.loads(seen.out) == calls["result"].report
    assert "Report: drive-report/report.html" in seen.err


def test_quiet_prints_nothing(calls: dict[str, Any], capsys: pytest.CaptureFixture[str]) -> None:
    calls["result"] = result("low")
    assert run(["diagnose", "drive.mcap", "-q"]) == 1
    assert capsys.readouterr() == ("", "")


def test_nothing_to_judge_is_3_with_the_reason(calls: dict[str, Any], capsys: pytest.CaptureFixture[str]) -> None:
    calls["result"] = NotJudged("drive.mcap: no wheel was assessed")
    assert run(["diagnose", "drive.mcap"]) == 3
    assert capsys.readouterr() == ("", "error: drive.mcap: no wheel was assessed\n")


def test_a_dry_run_writes_nothing(mission_log: Path, calls: dict[str, Any], capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["diagnose", str(mission_log), "--dry-run", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert "paths" not in calls
    assert document["would_read"][0]["format"] == "mcap"
    assert document["would_write"][0] == str(Path("drive-report") / "report.html")
    assert run(["diagnose", str(mission_log), "--dry-run"]) == 0
    assert "drive-report/report.json" in capsys.readouterr().out
    assert not Path("drive-report").exists()


def test_open_shows_the_page(
    calls: dict[str, Any], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    opened: list[str] = []
    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setattr("webbrowser.open", lambda page: not opened.append(page))
    assert run(["diagnose", "drive.mcap", "--open"]) == 0
    assert opened == [(Path.cwd() / "drive-report" / "report.html").as_uri()]
    assert capsys.readouterr().err == ""


def test_clips_are_cut_from_the_mission_that_was_diagnosed(
    mission_log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["diagnose", str(mission_log), "--clips", "--clip-margin", "1", "--json"]) == 1
    seen = capsys.readouterr()
    report = json.loads(seen.out)
    names = [p.name for p in (tmp_path / "drive-report" / "clips").glob("*.mcap")]
    assert len(names) == sum(i["severity"] != "info" for i in report["intervals"])
    assert any(name.endswith("FR sensor stuck.mcap") for name in names)
    assert f"Clips: {len(names)} in drive-report/clips" in seen.err
    assert run(["diagnose", str(mission_log), "-o", "plain", "--json"]) == 1
    assert json.loads(capsys.readouterr().out) == report


def test_a_dry_run_names_the_clips(
    mission_log: Path, calls: dict[str, Any], capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["diagnose", str(mission_log), "--dry-run", "--json", "--clips"]) == 0
    assert json.loads(capsys.readouterr().out)["would_write"][-1] == "drive-report/clips"


def test_a_real_mission_from_log_to_page_and_again(
    mission_log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["diagnose", str(mission_log), "--json"]) == 1
    report = json.loads(capsys.readouterr().out)
    stuck = [i for i in report["intervals"] if (i["component"], i["side"], i["mode"]) == ("FR", "sensor", "stuck")]
    assert len(stuck) == 1
    assert (stuck[0]["start_s"], stuck[0]["stop_s"]) == pytest.approx((5.0, 9.0), abs=0.1)
    folder = tmp_path / "drive-report"
    assert json.loads((folder / "report.json").read_text()) == report
    page = (folder / "report.html").read_bytes()
    (folder / "report.html").unlink()
    assert run(["report", "drive-report"]) == 0
    assert (folder / "report.html").read_bytes() == page
    assert run(["report", str(folder / "report.json")]) == 0


def test_a_file_that_is_no_result(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "report.json").write_text('{"schema": "other"}')
    assert run(["report", str(tmp_path)]) == 3
    assert "schema 'other' found" in capsys.readouterr().err


def test_a_log_that_cannot_be_judged_ends_with_3(tmp_path: Path) -> None:
    log = tmp_path / "short.mcap"
    options = SimulationOptions(scenario="healthy", seed=3, duration_s=6.0, rate_hz=200.0, evidence="direct")
    write_mission(simulate_mission(options), log, "mcap")
    assert run(["diagnose", str(log), "-o", str(tmp_path / "out")]) == 3
    assert (tmp_path / "out" / "report.html").is_file()
    assert run(["diagnose", str(log), "-o", str(tmp_path / "out"), "--fail-on", "never"]) == 0


def small_table(tmp_path: Path) -> pd.DataFrame:
    log = tmp_path / "ok.csv"
    options = SimulationOptions(scenario="healthy", seed=1, duration_s=30.0, rate_hz=100.0)
    write_mission(simulate_mission(options), log, "csv")
    return pd.read_csv(log)


@pytest.mark.parametrize(
    ("name", "code"), [("three rows", 3), ("infinite", 0), ("beyond any speed", 0), ("two minutes' gap", 3)]
)
def test_odd_tables_are_judged_or_refused_without_a_crash(tmp_path: Path, name: str, code: int) -> None:
    table = small_table(tmp_path)
    half = len(table) // 2
    if name == "three rows":
        table = table.head(3)
    elif name == "infinite":
        table.loc[::7, "wheel.FR.v_ref"] = np.inf
    elif name == "beyond any speed":
        table.loc[half, "wheel.FR.v"] = 1e300
    else:
        table.loc[half:, "time_ns"] += 120 * 10**9
    log = tmp_path / "odd.csv"
    table.to_csv(log, index=False)
    assert run(["diagnose", str(log), "-o", str(tmp_path / "out")]) == code
    report = json.loads((tmp_path / "out" / "report.json").read_text(encoding="utf-8"))
    assert report["intervals"] == []


def test_steering_that_ends_early_gives_no_all_clear(tmp_path: Path) -> None:
    table = small_table(tmp_path)
    table.loc[len(table) // 2 :, [name for name in table.columns if name.startswith("steer.")]] = np.nan
    table.to_csv(tmp_path / "half.csv", index=False)
    assert run(["diagnose", str(tmp_path / "half.csv"), "-o", str(tmp_path / "out")]) == 3
    report = json.loads((tmp_path / "out" / "report.json").read_text(encoding="utf-8"))
    assert not report["verdict"]["cleared"]
    assert any(
        "without data, the front and rear steering was not judged" in text for text in report["verdict"]["scope"]
    )


def test_a_second_file_that_gives_nothing_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    table = small_table(tmp_path)
    table["time_ns"] += 120 * 10**9
    table.to_csv(tmp_path / "later.csv", index=False)
    assert run(["diagnose", str(tmp_path / "ok.csv"), str(tmp_path / "later.csv"), "-o", str(tmp_path / "out")]) == 3
    assert "later.csv: none of its channels is used" in capsys.readouterr().err
    table["time_ns"] -= 595 * 10**9
    table.to_csv(tmp_path / "same.csv", index=False)
    assert run(["diagnose", str(tmp_path / "ok.csv"), str(tmp_path / "same.csv"), "-o", str(tmp_path / "out")]) == 3
    assert "none of its channels is used" in capsys.readouterr().err


def test_a_table_of_something_else_is_refused_with_its_columns(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "weather.csv").write_text(
        "time,temperature\n" + "".join(f"{i},20.5\n" for i in range(50)), encoding="utf-8"
    )
    assert run(["diagnose", str(tmp_path / "weather.csv"), "-o", str(tmp_path / "out")]) == 3
    said = capsys.readouterr().err
    assert "no column (temperature) is called like a signal" in said
    assert "an audit takes patterns" in said


def test_a_part_of_a_mission_says_so(tmp_path: Path) -> None:
    small_table(tmp_path)
    out = tmp_path / "out"
    run(["diagnose", str(tmp_path / "ok.csv"), "-o", str(out), "--start", "10", "--end", "25"])
    report = json.loads((out / "report.json").read_text(encoding="utf-8"))
    assert any("10.000 s into the log" in text for text in report["verdict"]["caveats"])


@pytest.mark.parametrize("width", [80, 120])
def test_the_fault_table_breaks_no_number(width: int) -> None:
    fault = {
        "component": "FR",
        "kind": "wheel",
        "side": "sensor_or_actuator",
        "mode": "noisy",
        "start_s": 1000.0,
        "stop_s": 1105.18,
        "epsilon": {"value": 0.94, "low": 0.87, "high": 1.01},
        "sat": {"mean": 0.3, "rms": 0.3, "low": 0.2, "high": 0.4, "unit": "m/s"},
        "probability": 0.998,
        "severity": "medium",
    }
    report = report_of({"status": "not_assessed", "title": "Not assessed"}, [{**fault, "id": "F10"}])
    console = Console(width=width, color_system=None)
    with console.capture() as seen:
        console.print(*verdict_parts(report))
    out = seen.get()
    assert all(word in out for word in ("1000.00–1105.18", "0.94", "0.998", "medium", "sensor or"))
    assert ("+0.300 m/s" in out) == (width == 120)
    assert out.lower().count("not assessed") == 1, "once"


@pytest.mark.parametrize(
    ("source", "words"), [("paper defaults", "No machine file was given"), ("m.toml", "m.toml leaves out")]
)
def test_the_paper_s_numbers_are_said_behind_the_verdict(source: str, words: str) -> None:
    report = result("high").report
    report["machine"] |= {"source": source, "assumed": ["gear ratio 17.7"]}
    console = Console(width=80)
    with console.capture() as capture:
        console.print(*verdict_parts(report))
    out = capture.get()
    assert -1 < out.index("1 faults") < out.index(words) < out.index("gear ratio 17.7") < out.index("What to do")


def test_a_second_file_without_any_signal_is_a_note(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    table = small_table(tmp_path)
    other = table[["time_ns"]].assign(temperature=21.5)
    other.to_csv(tmp_path / "weather.csv", index=False)
    out = tmp_path / "out"
    assert run(["diagnose", str(tmp_path / "ok.csv"), str(tmp_path / "weather.csv"), "-o", str(out)]) in (0, 1, 3)
    report = json.loads((out / "report.json").read_text(encoding="utf-8"))
    assert "none of its channels is a signal" in capsys.readouterr().out
    assert any("weather.csv: none of its channels is a signal" in q["result"] + q["effect"] for q in report["quality"])


@pytest.mark.parametrize("name", ["report.html", "report.json", "report.parquet"])
def test_a_file_of_somebody_else_is_not_replaced(
    name: str, tmp_path: Path, calls: dict[str, Any], capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / name).write_text("<html>my own page</html>")
    assert run(["diagnose", "drive.mcap", "-o", str(tmp_path)]) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert "was not written by mfhca and was not replaced; move it away, or give another folder with -o" in said
    assert (tmp_path / name).read_text() == "<html>my own page</html>"


def test_a_column_of_text_that_is_called_like_a_signal_is_said(tmp_path: Path) -> None:
    table = small_table(tmp_path)
    table["wheel.FR.v"] = [f"{x:.3f} m/s" for x in table["wheel.FR.v"]]
    table["driver"] = "somebody"
    table.to_csv(tmp_path / "text.csv", index=False)
    assert run(["diagnose", str(tmp_path / "text.csv"), "-o", str(tmp_path / "out")]) == 3
    caveats = json.loads((tmp_path / "out" / "report.json").read_text(encoding="utf-8"))["verdict"]["caveats"]
    said = "Columns of text were left out that are called like signals: wheel.FR.v. Export them as numbers."
    assert said in caveats


def test_of_a_part_of_a_log_the_whole_is_what_clears_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    small_table(tmp_path)
    assert run(["diagnose", str(tmp_path / "ok.csv"), "--start", "5", "--end", "8", "-o", str(tmp_path / "out")]) == 3
    assert "To clear it: diagnose the whole log" in " ".join(capsys.readouterr().out.split())


def test_no_name_of_a_wheel_is_shown_as_such(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    small_table(tmp_path)
    assert run(["diagnose", str(tmp_path / "ok.csv"), "--wheel", "", "-o", str(tmp_path / "out")]) == 2
    assert "--wheel '': no such wheel" in capsys.readouterr().err
