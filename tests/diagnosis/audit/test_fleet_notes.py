"""The newest report of a machine says what the fleet knows beyond its mission: repairs that were recorded since, losses that grow."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest

from cli.main import run
from diagnosis.api.verdict import Verdict
from diagnosis.audit.fleet.leave import lists_of
from diagnosis.audit.fleet_files import fleet_json, load_fleet
from diagnosis.audit.previous_pages import compare_newest
from diagnosis.audit.repairs import record_repairs
from diagnosis.audit.store.locks import lock_mission
from diagnosis.audit.store.store import Store
from diagnosis.output import load_report, rebuild, write_result
from diagnosis.pages.labels import utc_moment
from diagnosis.results.result import MissionResult
from diagnosis.results.vocabulary import Leave
from tests import fleet_samples as samples
from tests import report_samples
from tests.fleet_samples import DAY_NS, START_NS, Fault, Sample
from tests.whole_documents import whole_report

SILENT = Fault("FR", "sensor", "no_signal", "high")


def at(day: float) -> int:
    return START_NS + int(day * DAY_NS)


def stored(folder: Path, missions: list[Sample], reports: dict[str, Any]) -> Path:
    path = samples.write_store(folder / "fleet.sqlite", missions)
    for s in missions:
        report, columns = reports.get(s.name, report_samples.no_faults)()
        report["log"]["start_ns"], report["machine"]["id"] = at(s.day or 0.0), s.machine
        write_result(MissionResult(whole_report(report), columns), folder / "missions" / s.name)
    return path


def with_silent() -> Any:
    """A report whose one severe fault is a silent sensor of FR."""
    report, columns = report_samples.five_faults()
    first = next(f for f in report["intervals"] if f["severity"] == "high")
    report["intervals"] = [{**first, "component": "FR", "kind": "wheel", "side": "sensor", "mode": "no_signal"}]
    report["verdict"]["actions"] = [a for a in report["verdict"]["actions"] if first["id"] in a["faults"]]
    return report, columns


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("stopped")
    missions = [Sample("old", day=0.0), Sample("new", day=1.0, verdict="stop", faults=[SILENT])]
    path = stored(folder, missions, {"new": with_silent})
    compare(path, "new")
    return folder


@pytest.fixture
def stopped(made: Path, tmp_path: Path) -> Path:
    """A machine whose newest mission stopped it."""
    return shutil.copytree(made, tmp_path, dirs_exist_ok=True)


def compare(path: Path, *names: str) -> None:
    with Store.open(path) as opened:
        compare_newest(opened, names, 15.0, lambda event, facts: None)


def repair(folder: Path, words: str = "HX-1 FR sensor", day: float = 2.0, **more: bool) -> Any:
    return record_repairs(folder, [words], at(day), lambda event, facts: None, **more)


def page(folder: Path, name: str = "new") -> str:
    return (folder / "missions" / name / "report.html").read_text("utf-8")


def report(folder: Path, name: str = "new") -> Any:
    return load_report(folder / "missions" / name / "report.json")


def test_a_repair_is_written_into_the_report_of_the_mission_before_it(stopped: Path) -> None:
    assert "fleet" not in report(stopped)
    assert "<b>No</b>, not before repair." in page(stopped)
    done = repair(stopped)
    assert done.reports == ("missions/new",)
    note = report(stopped)["fleet"]
    assert [(r["part"], r["repaired_ns"]) for r in note["repairs"]] == [("FR speed sensor", at(2.0))]
    (left,) = lists_of(fleet_json(load_fleet(stopped / "fleet.sqlite")))
    assert (note["leave"], note["reason"]) == (left.leave, left.reason) == (Leave.CHECK, left.reason)
    said = page(stopped)
    when = utc_moment(at(2.0))
    assert f"Repaired since this mission: FR speed sensor ({note['repairs'][0]['faults'][0]}), {when}" in said
    assert f"Repaired since, {when}." in said
    assert ", repaired since</h1>" in said
    assert '<a href="../../fleet.html">the fleet page</a>' in said
    assert "not before repair" not in said
    words = Verdict.of(report(stopped))
    assert (
        words.headline
        == "Repaired since this mission – check before it goes out: the fleet page says what is known since"
    )


def test_a_repair_that_is_taken_back_leaves_the_report_as_it_was(stopped: Path) -> None:
    before = report(stopped)
    repair(stopped)
    repair(stopped, withdrawn=True)
    assert report(stopped) == before
    assert "<b>No</b>, not before repair." in page(stopped)


def test_a_repair_of_another_part_or_of_before_the_mission_changes_nothing(stopped: Path) -> None:
    before = (stopped / "missions/new/report.html").stat().st_mtime_ns
    assert repair(stopped, "HX-1 RL sensor").reports == ()
    assert repair(stopped, day=0.5).reports == ()
    assert (stopped / "missions/new/report.html").stat().st_mtime_ns == before


def test_a_repair_of_one_of_two_severe_faults_is_no_leave(tmp_path: Path) -> None:
    def both() -> Any:
        made, columns = with_silent()
        other = {**made["intervals"][0], "id": "F9", "component": "RL"}
        return {**made, "intervals": [*made["intervals"], other]}, columns

    faults = [SILENT, Fault("RL", "sensor", "no_signal", "high")]
    stored(tmp_path, [Sample("new", day=1.0, verdict="stop", faults=faults)], {"new": both})
    repair(tmp_path)
    assert report(tmp_path)["fleet"]["leave"] == Leave.MUST_NOT
    assert "Repaired since this mission: FR speed sensor" in page(tmp_path)
    assert "<b>No</b>, not before repair." in page(tmp_path)


def test_a_report_that_another_audit_makes_anew_is_left_and_the_command_does_not_name_it(stopped: Path) -> None:
    claim = lock_mission(stopped, "new")
    assert claim is not None
    assert repair(stopped).reports == ()
    claim.release()
    compare(stopped / "fleet.sqlite", "new")  # the next audit of it does
    assert report(stopped)["fleet"]["repairs"]


def test_an_open_fault_that_is_repaired_is_open_no_more_on_the_newest_report(tmp_path: Path) -> None:
    missions = [Sample("old", day=0.0, verdict="stop", faults=[SILENT]), Sample("new", day=1.0)]
    path = stored(tmp_path, missions, {})
    compare(path, "new")
    assert "Open from earlier missions" in page(tmp_path)
    assert "fleet" not in report(tmp_path)  # the open fault is told by itself
    repair(tmp_path, day=0.5)
    assert "open_faults" not in report(tmp_path)["previous"]
    assert "Open from earlier missions" not in page(tmp_path)
    assert "<b>Yes</b>" in page(tmp_path)
    (left,) = lists_of(fleet_json(load_fleet(path)))
    assert (left.leave, left.note) == (Leave.MAY, "")


def growing(values: list[float]) -> list[Sample]:
    return [
        Sample(f"m{k}", day=float(k), epsilon={("RL", "actuator"): samples.bounds(v, 0.01)})
        for k, v in enumerate(values)
    ]


@pytest.mark.parametrize("values", [[0.02, 0.12, 0.3], [0.02, 0.02, 0.021]])
def test_a_loss_that_grows_fast_is_told_by_the_newest_mission_too(tmp_path: Path, values: list[float]) -> None:
    path = stored(tmp_path, growing(values), {})
    compare(path, "m2")
    (left,) = lists_of(fleet_json(load_fleet(path)))
    if left.leave is Leave.MAY:
        assert "fleet" not in report(tmp_path, "m2")
        assert "<b>Yes</b>" in page(tmp_path, "m2")
        return
    assert "grows so fast" in left.reason
    assert report(tmp_path, "m2")["fleet"]["reason"] == left.reason
    said = page(tmp_path, "m2")
    assert "By the fleet page: check before it goes out" in said
    assert left.reason == (
        "RL drive valve lost 30 % over the whole of its last mission, beyond the limit of 10 %, though no fault was stated in it: check the part; "
        "the loss of the RL drive valve was 12 % over the mission before, and grows so fast that half may be lost before two more are over"
    )
    assert left.reason in said.replace("\u00a0", " ").replace("\u202f", " ")
    assert "<b>Yes</b>" not in said
    assert Verdict.of(report(tmp_path, "m2")).headline == (
        "No fault in this mission – check before it goes out: the fleet page says why"
    )
    before = (tmp_path / "missions/m2/report.html").stat().st_mtime_ns
    compare(path, "m2")  # says it already
    assert (tmp_path / "missions/m2/report.html").stat().st_mtime_ns == before
    rebuild(tmp_path / "missions/m2")
    assert page(tmp_path, "m2") == said


def test_a_fault_of_the_mission_before_that_the_newest_did_not_judge_is_told(tmp_path: Path) -> None:
    """The fleet says *must not go out*, and the newest report is without a finding of that part."""
    part = ("FR", "sensor")
    missions = [
        Sample("old", day=0.0, verdict="stop", faults=[SILENT]),
        Sample("new", day=1.0, verdict="not_assessed", blind=[part]),
    ]
    path = stored(tmp_path, missions, {})
    compare(path, "new")
    (left,) = lists_of(fleet_json(load_fleet(path)))
    assert left.leave is Leave.MUST_NOT
    kept = report(tmp_path)
    assert "fleet" in kept or kept["previous"].get("open_faults")
    assert "<b>Yes</b>" not in page(tmp_path)


def test_a_page_elsewhere_is_no_link(stopped: Path) -> None:
    repair(stopped)
    path = stopped / "missions/new/report.json"
    kept = json.loads(path.read_text("utf-8"))
    kept["fleet"]["page"] = "javascript:alert(1)"
    path.write_text(json.dumps(kept), "utf-8")
    rebuild(path.parent)
    assert "javascript:alert(1)" not in page(stopped)


def test_the_terminal_names_the_report_that_says_so(stopped: Path, capsys: pytest.CaptureFixture[str]) -> None:
    day = utc_moment(at(2.0))[:10]
    assert run(["audit", "-o", str(stopped), "--repaired", "HX-1 FR sensor", "--on", day]) == 0
    said = capsys.readouterr()
    assert "new/report.html, written anew" in " ".join((said.out + said.err).split()).replace("\n", "")
