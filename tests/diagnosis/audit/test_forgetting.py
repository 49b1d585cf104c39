"""Logs that were not judged and were moved away: told as gone, never clear a machine, and are left out where a user says so."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from cli.main import run
from diagnosis.audit.fleet_files import fleet_json, load_fleet
from diagnosis.audit.forgetting import forget_missions
from diagnosis.audit.store.store import Store
from replay.errors import ConfigError, OutputError
from tests import fleet_samples as samples
from tests.diagnosis.audit.samples import asked_for, missions
from tests.diagnosis.audit.samples import run as audited
from tests.fleet_samples import Sample

LOST = Sample("HX-1/torn", state="unreadable", reason="/data/HX-1/torn.mcap ends after 12 bytes", gone=True)


def document(folder: Path) -> dict[str, Any]:
    return fleet_json(load_fleet(folder / "fleet.sqlite"))


def unheard(*_: object) -> None:
    pass


def test_a_damaged_log_that_was_moved_away_clears_nothing_until_it_is_left_out(tmp_path: Path) -> None:
    samples.write_store(tmp_path / "fleet.sqlite", [Sample("HX-1/a"), Sample("HX-1/b", day=1.0), LOST])
    (one,) = document(tmp_path)["machines"]
    assert (one["verdict"], one["note"]) == ("not_assessed", "1 log not read and no longer there")
    with pytest.raises(ConfigError, match="no such mission"):
        forget_missions(tmp_path, ["HX-1/torn", "torn"], unheard)
    with pytest.raises(ConfigError, match="was there in the last audit"):
        forget_missions(tmp_path, ["HX-1/a"], unheard)
    (before,) = document(tmp_path)["machines"]
    assert before["verdict"] == "not_assessed"  # nothing of a wrong command was done
    (listed,) = forget_missions(tmp_path, ["HX-1/torn"], unheard)
    assert (listed.verdict, listed.words) == ("ready", "Ready")
    assert document(tmp_path)["counts"]["gone"] == 0


def test_what_was_judged_is_not_left_out(tmp_path: Path) -> None:
    samples.write_store(tmp_path / "fleet.sqlite", [Sample("a", gone=True), Sample("b", day=1.0)])
    with pytest.raises(ConfigError, match="it was judged"):
        forget_missions(tmp_path, ["a"], unheard)
    with pytest.raises(OutputError, match="there is no store"):
        forget_missions(tmp_path / "none", ["a"], unheard)


def test_copies_of_a_log_that_was_not_read_count_once_and_one_that_is_there_first(tmp_path: Path) -> None:
    torn = Sample("HX-1/torn", state="unreadable", reason="it ends after 12 bytes", copies=["HX-1/again"])
    samples.write_store(tmp_path / "fleet.sqlite", [Sample("HX-1/a"), torn])
    (one,) = document(tmp_path)["machines"]
    assert (one["note"], one["unjudged"], len(one["failed"])) == ("1 log not read", 1, 2)


def test_a_left_out_log_stays_out_in_the_next_audit_and_counts_again_once_it_is_back(tmp_path: Path) -> None:
    asked = asked_for(tmp_path / "out")
    found = missions(tmp_path / "logs", "fine-1", "broken-2")
    audited(found, asked)
    torn = tmp_path / "logs" / "broken-2.bag"
    kept = torn.rename(tmp_path / "torn")
    audited(missions(tmp_path / "logs", "fine-1"), asked)
    forget_missions(asked.output, ["broken-2"], unheard)

    def names() -> list[str]:
        with Store.open(asked.output / "fleet.sqlite", read_only=True) as store:
            return [m.name for m in store.missions()]

    audited(missions(tmp_path / "logs", "fine-1"), asked)
    assert names() == ["fine-1"]
    kept.rename(torn)
    audited(found, asked)
    assert names() == ["broken-2", "fine-1"]


def test_the_command_says_what_it_left_out_and_takes_no_logs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    samples.write_store(tmp_path / "fleet.sqlite", [Sample("HX-1/a"), LOST])
    assert run(["audit", "logs", "-o", str(tmp_path), "--forget", "HX-1/torn"]) == 2
    assert "audits nothing" in capsys.readouterr().err
    assert run(["audit", "-o", str(tmp_path), "--forget", "HX-1/torn"]) == 0
    assert "Left out: HX-1/torn" in capsys.readouterr().out
