from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import fsspec
import pytest

from diagnosis.audit.discovery.mission_source import MissionSource
from diagnosis.audit.store.ingest import ingest
from diagnosis.audit.store.keys import Key
from diagnosis.audit.store.objects import Objects
from diagnosis.audit.store.outcome import Outcome
from diagnosis.audit.store.store import Store
from diagnosis.audit.store.summary import summarise

Report = Callable[..., dict[str, Any]]
Missions = Callable[..., MissionSource]
Keys = Callable[..., Key]
_SHOWN = {
    "file": "SELECT * FROM file ORDER BY path",
    "mission": "SELECT m.name, files, bytes, log_hash FROM mission m JOIN result r ON r.id = m.result ORDER BY 1",
    "result": "SELECT * FROM result ORDER BY log_hash",
    "attempt": "SELECT log_hash, a.* FROM attempt a JOIN result ON id = result ORDER BY 1, number",
    "fault": "SELECT log_hash, f.* FROM fault f JOIN result r ON r.id = result ORDER BY 1, f.id",
    "component": "SELECT log_hash, c.* FROM component c JOIN result ON id = result ORDER BY 1, component, side",
}


def rows(store: Store) -> dict[str, list[dict[str, Any]]]:
    """All rows, without the numbers that a store gives them."""
    return {
        table: [
            {k: row[k] for k in row.keys() if k not in ("result",) and (k, table) != ("id", "result")}  # noqa: SIM118
            for row in store.database.rows(query)
        ]
        for table, query in _SHOWN.items()
    }


@pytest.fixture
def audited(tmp_path: Path, make_mission: Missions, make_key: Keys, make_report: Report) -> Path:
    """A store with a retried mission, a copy of it, a changed mission and one that failed."""
    path = tmp_path / "audit" / "fleet.sqlite"
    with Store.open(path) as store:
        store.begin_run()
        missions = store.adopt([make_mission(f"m{i}") for i in range(4)])
        for mission in missions:
            store.remember_hash(mission.files[0], mission.bytes, mission.stamps[0], mission.name * 8)
        ok = Outcome("ok", wall_s=1.5, cpu_s=1.0, peak_mb=200.0, summary=summarise(make_report()))
        store.record(missions[0], make_key("a"), ok, "missions/m0", [Outcome("timeout", "stopped after 60 s")])
        stored = store.lookup(make_key("a"))
        assert stored is not None
        store.reuse(missions[1], stored)
        store.record(missions[2], make_key("old"), ok, "missions/m2")
        store.record(missions[2], make_key("new"), ok, "missions/m2")
        store.record(missions[3], make_key("bad"), Outcome("unreadable", "no log"), None, machine_id="H-01")
    return path


def lose(path: Path) -> None:
    for file in path.parent.glob("fleet.sqlite*"):
        file.unlink()


def test_a_lost_store_is_made_again(audited: Path) -> None:
    with Store.open(audited) as store:
        before = rows(store)
    assert {t: len(r) for t, r in before.items()} == {
        "file": 4, "mission": 4, "result": 4, "attempt": 5, "fault": 3, "component": 12,
    }  # fmt: skip
    lose(audited)
    with Store.open(audited) as store:
        found = ingest(store)
        assert (found.attempts, found.links, found.problems) == (5, 1, ())
        assert rows(store) == before
        again = ingest(store)
        assert (again.attempts, again.links) == (0, 0)


def test_attempts_of_another_computer_are_taken_over(
    audited: Path, tmp_path: Path, make_mission: Missions, make_key: Keys
) -> None:
    other = tmp_path / "other" / "fleet.sqlite"
    with Store.open(other) as store:
        (mission,) = store.adopt([make_mission("m9")])
        store.record(mission, make_key("z"), Outcome("crashed", "signal 9"), None)
    with Store.open(audited) as store:
        assert ingest(store, str(other.parent / "results")).attempts == 1
        assert store.counts() == {"crashed": 1, "ok": 3, "unreadable": 1}


def test_an_attempt_whose_row_was_not_written_is_found(audited: Path, make_key: Keys) -> None:
    with Store.open(audited) as store:
        store.database.rows("DELETE FROM attempt WHERE state = 'unreadable'")
        assert ingest(store).attempts == 1


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"schema": "other/1"}, "schema 'other/1'"),
        ({"report": "../../etc"}, "not in the folder missions"),
        ({"report": "missions/../x"}, "not in the folder missions"),
        ({"report": "missions/a<b>"}, "not in the folder missions"),
        ({"mission": {"name": "../m", "files": [{"path": "m"}], "bytes": 1}}, "name is not safe"),
        ({"mission": {"name": "m", "files": [], "bytes": 1}}, "files or time of making"),
        (
            {"mission": {"name": "m", "files": [{"path": "m"}], "bytes": "many"}},
            "mission.files[0]: key 'size' expected, not found",
        ),
        ({"attempt": {"number": 1, "state": "fine", "reason": ""}}, "state 'fine'"),
        ({"attempt": {"number": 1, "state": "ok", "reason": ""}}, "attempt: key 'wall_s' expected, not found"),
        ({"mission": {"name": "m", "files": [1.5], "bytes": 1}}, "mission.files[0]: float found, object expected"),
        ({"attempt": None}, "its name is not that of its key"),
        ({"key": {"log_hash": "x", "config_hash": "y", "version": "1"}}, "its name is not that of its key"),
        ({"made_ns": None}, "time of making"),
        ({"summary": {"result": {"start_ns": 2**70}, "faults": [], "components": []}}, "is not a result object"),
        ({"summary": {"result": {}, "faults": [{"id": "F1"}], "components": []}}, "is not a result object"),
        (
            {"summary": {"result": {}, "faults": [{"id": "F1", "severity": "low"}], "components": []}},
            "is not a result object",
        ),
        ({"summary": {"result": {}, "faults": [{"severity": "dire"}], "components": []}}, "a fault's severity"),
        (
            {"summary": {"result": {}, "faults": [{"severity": "low", "side": "SENSOR"}], "components": []}},
            "the side of a fault",
        ),
        ({"summary": {"result": {}, "faults": [], "components": [{"side": ""}]}}, "the side of a fault or component"),
        ({"summary": {"result": {"verdict": "fine"}, "faults": [], "components": []}}, "verdict 'fine'"),
        ({"summary": [1]}, "is not a result object"),
    ],
)
def test_objects_that_are_off_are_left_out(audited: Path, change: dict[str, Any], said: str) -> None:
    lose(audited)
    path = sorted(audited.parent.glob("results/*-1.json"))[0]
    document = {**json.loads(path.read_text()), **change}
    path.write_text(json.dumps(document))
    (audited.parent / "results" / "notes.txt").write_text("not ours")
    (audited.parent / "results" / "00000000-00000000-1-1.json").write_bytes(b"{")
    with Store.open(audited) as store:
        found = ingest(store)
        assert len(found.problems) == 2
        assert any(said in text for text in found.problems), found.problems
        assert store.database.rows("PRAGMA integrity_check")[0][0] == "ok"
        assert len(store.missions()) >= 3


@pytest.fixture
def bucket() -> Iterator[str]:
    yield "memory://audit/results"
    fsspec.filesystem("memory").store.clear()


@pytest.mark.parametrize("remote", [False, True])
def test_objects_are_never_changed(tmp_path: Path, bucket: str, remote: bool) -> None:
    objects = Objects(bucket if remote else str(tmp_path / "results"))
    name = "0123abcd-0123abcd-1.0-1.json"
    assert objects.names() == []
    assert objects.put(name, b"first")
    assert not objects.put(name, b"second")
    assert objects.read(name) == b"first"
    assert objects.names() == [name]
    document = {"attempt": {"state": "ok"}}
    assert [objects.put_attempt("0123abcd-0123abcd-1.0", document, 1) for _ in range(2)] == [2, 3]
    if not remote:
        assert sorted(p.name for p in tmp_path.glob("results/*")) == objects.names()


def test_objects_behind_a_url_are_taken_over(audited: Path, bucket: str) -> None:
    objects, local = Objects(bucket), Objects(str(audited.parent / "results"))
    for name in local.names():
        objects.put(name, local.read(name))
    with Store.open(audited) as store:
        before = rows(store)
    with Store(audited.with_name("again.sqlite"), objects=False) as store:
        assert ingest(store, bucket).attempts == 5
        assert rows(store) == before
