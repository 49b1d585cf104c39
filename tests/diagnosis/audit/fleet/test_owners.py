"""Logs that were not judged count for the machine whose logs lie around them, not for one of their folder's name."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from diagnosis.audit.discovery.identity import fallback_id
from diagnosis.audit.discovery.mission_source import MissionSource
from diagnosis.audit.fleet.leave import lists_of
from diagnosis.audit.fleet_files import fleet_json, load_fleet
from diagnosis.audit.store.keys import Key
from diagnosis.audit.store.outcome import Outcome
from diagnosis.audit.store.store import Store
from diagnosis.results.vocabulary import Leave
from tests import fleet_samples as samples
from tests.fleet_samples import Sample

EMPTY = Sample("d2", "", state="unreadable", reason="d2.csv: is empty.")
NO_SIGNAL = Sample("z", "", state="degraded", verdict="not_assessed", day=None, parts=(), reason="no wheel speed")


def document(tmp_path: Path, *missions: Sample) -> dict[str, Any]:
    return fleet_json(load_fleet(samples.write_store(tmp_path / "fleet.sqlite", missions)))


def test_a_log_that_may_be_of_several_machines_leaves_none_ready_for_certain(tmp_path: Path) -> None:
    d = document(tmp_path, Sample("d0"), Sample("d1", "HX-2"), EMPTY)
    assert [m["verdict"] for m in d["machines"]] == ["ready", "ready"]
    assert d["verdict"]["status"] == "not_assessed"
    assert d["verdict"]["title"] == "Both machines may go out, but 1 log of no known machine was not judged"


def test_a_log_counts_for_the_machine_that_alone_has_judged_missions_around_it(tmp_path: Path) -> None:
    broken = Sample("a/new/day2", "", state="unreadable")
    d = document(tmp_path, Sample("a/old/day0"), Sample("a/old/day1", day=1.0), Sample("b/day0", "HX-2"), broken)
    assert {m["label"]: m["verdict"] for m in d["machines"]} == {"HX-1": "not_assessed", "HX-2": "ready"}
    assert d["verdict"]["title"] == "1 of 2 machines may go out, 1 must be checked first"
    assert lists_of(d)[0].label == "HX-1"
    assert lists_of(d)[0].leave is Leave.CHECK


@pytest.mark.parametrize(
    "newest", [Sample("z", "", state="unreadable"), NO_SIGNAL, Sample("z", "", None, "ok", "not_assessed")]
)
@pytest.mark.parametrize("folders", [("", ""), ("", "new/"), ("old/", "new/"), ("old/", "")])
def test_a_folders_name_is_no_machine_where_the_logs_name_their_own(
    tmp_path: Path, newest: Sample, folders: tuple[str, str]
) -> None:
    d = document(tmp_path, Sample(f"{folders[0]}a"), replace(newest, name=f"{folders[1]}z"))
    assert {m["label"]: m["verdict"] for m in d["machines"]} == {"HX-1": "not_assessed"}
    assert [m["machine"] for m in d["missions"]] == [0, 0]


@pytest.mark.parametrize("place", [".", "logs", "logs/out"])
@pytest.mark.parametrize("file", ["", "s3://bucket/logs/z.mcap", "s3://logs/z.mcap"])
def test_the_folders_name_is_the_one_that_an_audit_gives(tmp_path: Path, place: str, file: str) -> None:
    path = samples.write_store(tmp_path / place / "fleet.sqlite", [Sample("a")])
    source = MissionSource("z", (file or f"{tmp_path}/logs/z.mcap",), 9, ("1",))
    with Store.open(path) as store:
        outcome = Outcome("unreadable", "is empty")
        store.record(source, Key("e" * 64, "c" * 64, "1.0"), outcome, None, machine_id=fallback_id(source))
    d = fleet_json(load_fleet(path))
    assert [(m["label"], m["verdict"]) for m in d["machines"]] == [("HX-1", "not_assessed")]


@pytest.mark.parametrize("names", [("HX-1/a", "HX-2/a"), ("HX-1/a", "HX-1/b")])
def test_a_folder_named_as_a_machine_is_one_where_others_are(tmp_path: Path, names: tuple[str, str]) -> None:
    read = [Sample(name, name[:4], day=k) for k, name in enumerate(names)]
    d = document(tmp_path, *read, Sample("HX-3/z", "", state="crashed"))
    assert {m["label"]: m["verdict"] for m in d["machines"]} == {
        "HX-3": "not_assessed",
        **dict.fromkeys((name[:4] for name in names), "ready"),
    }


def test_a_log_among_those_of_two_machines_may_be_of_either(tmp_path: Path) -> None:
    unnamed = Sample("d1", "logs", day=1.0)
    d = document(tmp_path, Sample("d0"), unnamed, EMPTY)
    assert {m["label"]: m["verdict"] for m in d["machines"]} == {"HX-1": "ready", "logs": "not_assessed"}
    assert d["counts"]["unknown"] == 1
    assert "1 log was not judged and may be of a machine that is shown as ready." in d["verdict"]["text"]


def test_a_copy_in_another_folder_makes_no_folder_doubtful(tmp_path: Path) -> None:
    one = Sample("HX-1/a", "HX-1", copies=("backup/old/a",))
    two = Sample("HX-2/b", "", verdict="not_assessed", day=1.0)
    d = document(tmp_path, one, two)
    assert {m["label"]: m["verdict"] for m in d["machines"]} == {"HX-1": "ready", "HX-2": "not_assessed"}
