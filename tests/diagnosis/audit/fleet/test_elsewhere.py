"""A copy of one machine's log in another one's folder counts once, for the machine whose it is."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from diagnosis.audit.fleet.elsewhere import copies_elsewhere
from diagnosis.audit.fleet.read import Mission, read_missions
from diagnosis.audit.fleet_files import fleet_json, load_fleet
from diagnosis.audit.store.database import Database
from tests import fleet_samples as samples
from tests.fleet_samples import Fault, Sample

NIGHT = 86_400 * 10**9
STUCK = Fault(mode="stuck", severity="high")


def store(tmp_path: Path, *missions: Sample, same: tuple[str, str]) -> Path:
    """Store of missions of which two, by their names, are one recording."""
    path = samples.write_store(tmp_path / "fleet.sqlite", missions)
    db = Database(path)
    with db.transaction() as c:
        c.execute(
            "UPDATE result SET config_hash = 'other', log_hash = (SELECT log_hash FROM result WHERE report = ?) WHERE report = ?",
            tuple(f"missions/{name}" for name in same),
        )
    db.close()
    return path


def copies(path: Path, seen: Mapping[str, int]) -> dict[str, str]:
    missions: list[Mission] = read_missions(path)
    return copies_elsewhere(missions, seen.get, str(path.parent))


def test_it_is_of_the_machine_in_whose_folder_an_earlier_audit_saw_it(tmp_path: Path) -> None:
    path = store(
        tmp_path, Sample("b/log", "b"), Sample("a/copy", "a"), Sample("a/other", "a"), same=("b/log", "a/copy")
    )
    assert copies(path, {"b/log": 0, "a/other": 5, "a/copy": NIGHT}) == {"a/copy": "b/log"}
    assert copies(path, {"b/log": NIGHT, "a/other": NIGHT + 5, "a/copy": 0}) == {"b/log": "a/copy"}


def test_of_one_audit_it_is_of_the_machine_that_has_other_logs(tmp_path: Path) -> None:
    path = store(
        tmp_path, Sample("b/log", "b"), Sample("b/other", "b"), Sample("a/copy", "a"), same=("b/log", "a/copy")
    )
    assert copies(path, {"b/log": 3, "b/other": 2, "a/copy": 1}) == {"a/copy": "b/log"}


def test_a_fault_counts_for_every_machine_whose_log_it_may_be(tmp_path: Path) -> None:
    missions = Sample("a/log", "a", faults=[STUCK]), Sample("b/log", "b", faults=[STUCK])
    path = store(tmp_path, *missions, same=("a/log", "b/log"))
    assert copies(path, {}) == {}
    assert copies(path, {"a/log": 0, "b/log": NIGHT}) == {"b/log": "a/log"}


def test_copies_make_no_machine_and_are_told_as_such(tmp_path: Path) -> None:
    path = store(
        tmp_path, Sample("a/log", "a"), Sample("a/other", "a", day=1.0), Sample("c/log", "c"), same=("a/log", "c/log")
    )
    d: Any = fleet_json(load_fleet(path))
    assert [m["label"] for m in d["machines"]] == ["a"]
    assert {m["name"]: (m["machine"], m["copy_of"]) for m in d["missions"]}["c/log"] == (0, "a/log")
    assert d["counts"]["copies"] == 1


def test_logs_of_their_own_are_no_copies(tmp_path: Path) -> None:
    path = samples.write_store(tmp_path / "fleet.sqlite", [Sample("a/log", "a"), Sample("b/log", "b")])
    assert copies(path, {}) == {}
