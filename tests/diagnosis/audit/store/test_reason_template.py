from __future__ import annotations

import os

import pytest

from diagnosis.audit.store.reason_template import reason_template

FILES = [[f"logs/m{i}.mcap", f"logs/m{i}.csv"] for i in range(1000)]


def test_each_mission_is_told_of_its_own_files() -> None:
    reason = "/data/logs/m10.csv: 3 columns, 4 expected; /data/logs/m10.mcap is whole"
    shared = reason_template(reason, FILES, "/data")
    assert shared.for_files(["a.mcap", "b.csv"]) == "b.csv: 3 columns, 4 expected; a.mcap is whole"
    assert shared.for_files(["a.mcap"]) == "/data/logs/m10.csv: 3 columns, 4 expected; a.mcap is whole"


def test_paths_from_where_the_audit_runs_are_known_too() -> None:
    folder = os.path.realpath(".")
    assert reason_template("logs/m1.mcap is empty", FILES, folder).for_files(["x.mcap"]) == "x.mcap is empty"


@pytest.mark.parametrize("reason", ["", "/data/logs/m1.mcap.old ends", "/more/data/logs/m1.mcap ends", "m1.mcap ends"])
def test_what_is_no_file_of_theirs_stays(reason: str) -> None:
    assert reason_template(reason, FILES, "/data").for_files(["x.mcap"]) == reason


def test_urls_stay() -> None:
    assert (
        reason_template("s3://b/m.mcap ends", [["s3://b/m.mcap"]], "/data").for_files(["s3://b/n.mcap"])
        == "s3://b/m.mcap ends"
    )
