"""What the last audit run brought stands first, and the same store gives the same documents."""

from __future__ import annotations

import json
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from diagnosis.audit.fleet.news import news
from diagnosis.audit.fleet.words import new_words
from diagnosis.audit.fleet_files import write_fleet
from diagnosis.audit.store.database import Database
from diagnosis.results.machine_words import HYDRAULIC
from diagnosis.results.vocabulary import Severity
from tests import fleet_samples as samples
from tests.fleet_samples import Fault, Sample

OLD = [Sample("d0", verdict="watch", faults=[Fault()]), Sample("d1", day=1.0)]
STUCK = Sample("d2", day=2.0, verdict="stop", faults=[Fault("FR", "sensor", "stuck", "high"), Fault()])
SAID = "The last audit run brought 1 mission with a report; first seen in it: HX-1 FR speed sensor stuck (high)."


def written(tmp_path: Path, run: int, missions: Sequence[Sample]) -> dict[str, Any]:
    """Document of a run of an audit that has seen these missions by then."""
    (tmp_path / "fleet.sqlite").unlink(missing_ok=True)
    store = samples.write_store(tmp_path / "fleet.sqlite", missions)
    with closing(Database(store)) as db, db.transaction() as c:
        c.execute("UPDATE meta SET value = ? WHERE name = 'run'", (str(run),))
    document: dict[str, Any] = json.loads(write_fleet(store, tmp_path).json.read_bytes())
    return document


def news_of(document: dict[str, Any]) -> list[str]:
    return [t for t in document["verdict"]["text"] if t.startswith("The last audit run")]


def test_the_first_run_calls_nothing_new(tmp_path: Path) -> None:
    d = written(tmp_path, 1, OLD)
    assert d["audit"]["run"] == 1
    assert news_of(d) == []
    assert [m["first_run"] for m in d["missions"]] == [1, 1]


def test_faults_of_the_last_run_stand_first(tmp_path: Path) -> None:
    written(tmp_path, 1, OLD)
    d = written(tmp_path, 2, [*OLD, STUCK])
    assert d["verdict"]["text"][0] == SAID
    assert [m["first_run"] for m in d["missions"]] == [1, 1, 2]
    assert sorted((f["mode"], f["first_run"]) for f in d["faults"]) == [("inefficient", 1), ("stuck", 2)]


def test_a_page_written_again_in_the_same_run_says_the_same(tmp_path: Path) -> None:
    written(tmp_path, 1, OLD)
    d = written(tmp_path, 2, [*OLD, STUCK])
    assert written(tmp_path, 2, [*OLD, STUCK]) == d
    assert news_of(written(tmp_path, 3, [*OLD, STUCK])) == []


def test_a_mission_is_new_in_the_run_that_judged_it(tmp_path: Path) -> None:
    written(tmp_path, 1, [*OLD, Sample("d2", state="crashed")])
    assert news_of(written(tmp_path, 2, [*OLD, STUCK])) == [SAID]


def test_new_missions_without_a_new_fault_say_so(tmp_path: Path) -> None:
    written(tmp_path, 1, OLD)
    d = written(tmp_path, 2, [*OLD, Sample("d2", day=2.0)])
    assert d["verdict"]["text"][0] == "The last audit run brought 1 mission with a report, and no new fault."


def test_nothing_is_called_new_where_the_run_before_is_not_known(tmp_path: Path) -> None:
    assert news_of(written(tmp_path, 2, OLD)) == []
    for text in ("{", "[]", '{"audit": {"run": 9}, "missions": []}', '{"missions": 3}'):
        (tmp_path / "fleet.json").write_text(text, encoding="utf-8")
        assert news_of(written(tmp_path, 2, [*OLD, STUCK])) == []


def test_the_page_says_of_when_its_logs_and_results_are(tmp_path: Path) -> None:
    place = tmp_path / "results" / f"{2:064x}"[:8]
    place.parent.mkdir()
    made = json.dumps({"made_ns": samples.START_NS + 3 * samples.DAY_NS, "mission": {"name": "d1"}})
    place.with_name(f"{place.name}-cccccccc-1.0-1.json").write_text(made, encoding="utf-8")
    d = written(tmp_path, 4, OLD)
    assert d["audit"] == {"run": 4, "made_ns": samples.START_NS + 3 * samples.DAY_NS, "notes": []}
    page = (tmp_path / "fleet.html").read_text("utf-8")
    span = "logs from 2026-10-26 to 2026-10-27"
    assert (
        f"Fleet audit of 2 missions · {span} · audit run 4, newest result made <time>2026-10-29 07:33</time> UTC</p>"
        in page
    )
    assert f"fleet audit, {span}</title>" in page


def test_a_fault_that_is_back_since_its_repair_is_news() -> None:
    runs = {"m1": 1, "m2": 2, "m3": 3}

    def run(name: str, day: int, *, faulty: bool) -> SimpleNamespace:
        faults = (SimpleNamespace(component="RL", side="sensor", mode="no_signal"),) if faulty else ()
        return SimpleNamespace(name=name, faults=faults, result=SimpleNamespace(start_ns=day * samples.DAY_NS))

    limits = SimpleNamespace(words=HYDRAULIC)
    missions = [run("m1", 1, faulty=True), run("m2", 5, faulty=False), run("m3", 7, faulty=True)]
    fault = SimpleNamespace(
        component="RL", side="sensor", mode="no_signal", kind="wheel", standing=True, missions=2,
        severity=Severity.HIGH, repaired_ns=4 * samples.DAY_NS, unclear=False, epsilon=None,
    )  # fmt: skip
    machine: Any = SimpleNamespace(runs=missions, faults=[fault], label="HX-1", limits=limits)
    count, found = news([machine], runs, 3)
    assert count == 1
    assert new_words(count, found) == [
        "The last audit run brought 1 mission with a report; found in it: HX-1 RL speed sensor no signal (high, back since its repair on 1970-01-05 00:00 UTC)."
    ]
    assert news([machine], runs | {"m3": 2, "m4": 3}, 3)[1] == []
