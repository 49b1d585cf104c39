"""The newest report of a machine is held against the machine's mission before it, once."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest

from diagnosis.audit.previous_pages import compare_newest
from diagnosis.audit.store.folders import mark_report
from diagnosis.audit.store.keys import Key
from diagnosis.audit.store.locks import lock_mission
from diagnosis.audit.store.store import Store
from diagnosis.output import write_result
from diagnosis.pages.labels import utc
from diagnosis.results.result import MissionResult
from tests import fleet_samples as samples
from tests import report_samples
from tests.fleet_samples import Sample
from tests.whole_documents import whole_report


def written(folder: Path, sample: Sample, made: tuple[dict[str, Any], Any], start_ns: int) -> None:
    """Report of a mission of the store."""
    report, columns = made
    report["log"]["start_ns"], report["machine"]["id"] = start_ns, sample.machine
    write_result(MissionResult(whole_report(report), columns), folder / "missions" / sample.name)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("store")
    missions = [Sample("new", day=1.0), Sample("old", day=0.0), Sample("other", "HX-2", day=2.0)]
    path = samples.write_store(folder / "fleet.sqlite", missions)
    with Store.open(path, read_only=True) as opened:
        starts = dict(
            opened.database.rows("SELECT m.name, r.start_ns FROM mission m JOIN result r ON r.id = m.result", ())
        )
    written(folder, missions[0], report_samples.five_faults(), starts["new"])
    written(folder, missions[1], report_samples.no_faults(), starts["old"])
    written(folder, missions[2], report_samples.no_faults(), starts["other"])
    return folder


@pytest.fixture
def store(made: Path, tmp_path: Path) -> Path:
    """Three missions of two machines, with their pages."""
    return shutil.copytree(made, tmp_path, dirs_exist_ok=True) / "fleet.sqlite"


def compare(path: Path, *names: str) -> list[tuple[str, dict[str, Any]]]:
    told: list[tuple[str, dict[str, Any]]] = []
    with Store.open(path) as opened:
        compare_newest(opened, names, 15.0, lambda event, facts: told.append((event, facts)))
    return told


def document(path: Path, name: str) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((path.parent / "missions" / name / "report.json").read_text("utf-8"))
    return found


def test_newest_report_is_compared_and_the_others_are_left(store: Path) -> None:
    assert compare(store, "old") == []  # one of the machine's missions is enough
    assert document(store, "new")["previous"]["counts"]["new"] == 5
    assert "previous" not in document(store, "old")
    assert "previous" not in document(store, "other")
    assert "previous mission" in (store.parent / "missions/new/report.html").read_text("utf-8")


def test_a_report_that_says_it_already_is_left(store: Path) -> None:
    compare(store, "new")
    page = store.parent / "missions/new/report.html"
    before = page.stat().st_mtime_ns
    compare(store, "new", "old")
    assert page.stat().st_mtime_ns == before


@pytest.mark.parametrize("name", ["new", "old"])
def test_a_report_of_another_result_is_not_compared(store: Path, name: str) -> None:
    mark_report(store.parent / "missions" / name, Key("d" * 64, "c" * 64, "1.0"))
    assert compare(store, "new") == []
    assert "previous" not in document(store, "new")


def test_a_report_that_another_audit_makes_anew_is_left_to_it(store: Path) -> None:
    claim = lock_mission(store.parent, "new")
    assert claim is not None
    assert compare(store, "new") == []
    assert "previous" not in document(store, "new")
    claim.release()
    compare(store, "new")
    assert "previous" in document(store, "new")


def test_a_broken_report_is_told_and_costs_nothing(store: Path) -> None:
    (store.parent / "missions/new/report.json").write_text("{", "utf-8")
    ((event, facts),) = compare(store, "new")
    assert event == "not_compared"
    assert "not JSON" in facts["reason"]


def test_the_newest_report_says_what_is_open_from_earlier_missions(tmp_path: Path) -> None:
    """A report judges its own mission; the fleet holds a severe fault open that nobody is known to have repaired."""
    silent = samples.Fault("FR", "sensor", "no_signal", "high")
    missions = [Sample("old", day=0.0, verdict="stop", faults=[silent]), Sample("mid", day=1.0), Sample("new", day=2.0)]
    path = samples.write_store(tmp_path / "fleet.sqlite", missions)
    for k, mission in enumerate(missions):
        written(tmp_path, mission, report_samples.no_faults(), samples.START_NS + k * samples.DAY_NS)
    assert compare(path, "new") == []
    (said,) = document(path, "new")["previous"]["open_faults"]
    assert said.startswith("FR speed sensor no signal, last found in old (2026-10-")
    assert said.endswith(", no repair recorded, clean in 2 of the 10 missions that it takes to close it")
    page = (tmp_path / "missions/new/report.html").read_text("utf-8")
    assert "Open from earlier missions" in page
    written_on = utc(document(path, "new")["previous"]["open_asof_ns"])[:10]
    assert f"when the audit wrote this, on {written_on}; the fleet page holds the newest state." in page
    assert f"a fault of an earlier mission was open on {written_on}, when this was written" in page
    assert said in page
    assert "Ready for the next mission" not in page.partition('id="verdict"')[2].partition("</section>")[0]
    assert "No fault in this mission" in page
    before = (tmp_path / "missions/new/report.html").stat().st_mtime_ns
    compare(path, "new")
    assert (tmp_path / "missions/new/report.html").stat().st_mtime_ns == before
