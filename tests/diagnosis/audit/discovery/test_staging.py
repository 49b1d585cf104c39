"""A mission's time counts from its first byte, over the fetching and hashing of its files."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import fsspec
import pytest

from diagnosis.audit import task
from diagnosis.audit.discovery.mission_source import MissionSource
from diagnosis.audit.discovery.staging import Late, stage
from diagnosis.audit.isolation.limits import Limits
from diagnosis.audit.isolation.run import Isolation, run_isolated
from tests.diagnosis.audit.isolation.test_child import work_of
from tests.diagnosis.audit.samples import asked_for, missions, run


def test_files_that_are_not_ready_in_time_are_told(tmp_path: Path) -> None:
    (tmp_path / "a.mcap").write_bytes(b"x")
    mission = MissionSource("a", (str(tmp_path / "a.mcap"),), 1, ("1",), sizes=(1,))
    assert len(stage(mission, tmp_path / "files", until=time.monotonic() + 60.0).hashes) == 1
    with pytest.raises(Late):
        stage(mission, tmp_path / "files", until=time.monotonic() - 1.0)


def test_a_copy_from_a_server_ends_with_the_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    memory = fsspec.filesystem("memory")
    memory.pipe_file("/late/a.mcap", b"xyz")
    now, pieces = [0.0], list[int]()
    monkeypatch.setattr(time, "monotonic", lambda: now[0])

    def get_file(path: str, local: str, callback: Any) -> None:
        for i in range(10):
            pieces.append(i)
            now[0] += 1.0
            callback.relative_update(1)

    monkeypatch.setattr(type(memory), "get_file", staticmethod(get_file))
    mission = MissionSource("a", ("memory://late/a.mcap",), 3, ("1",), sizes=(3,))
    with pytest.raises(Late):
        stage(mission, tmp_path / "files", until=2.5)
    assert pieces == [0, 1, 2]


def test_a_mission_whose_files_take_all_its_time_met_its_limit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def late(*_: object) -> None:
        raise Late

    found = missions(tmp_path / "logs", "fine-1")
    with monkeypatch.context() as patched:
        patched.setattr(task, "stage", late)
        ends, _ = run(found, asked_for(tmp_path / "out"))
    assert (ends["fine-1"].state, ends["fine-1"].reason) == (
        "timeout", "took longer than 3 s; allow more with --timeout",
    )  # fmt: skip
    ends, _ = run(found, asked_for(tmp_path / "out"))
    assert ends["fine-1"].state == "ok"


def test_what_fetching_took_is_missing_in_the_child(forks: Isolation, tmp_path: Path) -> None:
    outcome = run_isolated(work_of("hang", tmp_path), Limits(wall_s=60.0), forks, 59.9)
    assert (outcome.state, outcome.reason) == ("timeout", "took longer than 60 s; allow more with --timeout")
    assert 60.0 < outcome.wall_s < 75.0
