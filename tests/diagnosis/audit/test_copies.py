from __future__ import annotations

import os
from pathlib import Path

import fsspec
import pytest

from diagnosis.audit.discovery.discover import discover
from diagnosis.audit.store.store import Store
from replay.log import content_hash as reading
from tests.diagnosis.audit.samples import asked_for, run


def write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")


def counted(events: list[tuple[str, str]]) -> dict[str, list[str]]:
    return {kind: sorted(name for k, name in events if k == kind) for kind, _ in events}


def test_each_content_is_diagnosed_once(tmp_path: Path) -> None:
    logs, asked = tmp_path / "logs", asked_for(tmp_path / "out", machine_id="H-07")
    write(logs / "a" / "m.mcap", "fine one")
    write(logs / "b" / "m.mcap", "fine one")
    write(logs / "c" / "m.mcap", "fine two")  # of the same size
    ends, events = run(discover([str(logs)]), asked)
    assert counted(events) == {"mission": ["a__m", "c__m"], "skipped": ["b__m"]}
    assert {e.report for e in ends.values()} == {"missions/a__m", "missions/c__m"}
    write(logs / "d" / "m.mcap", "fine two")
    _, events = run(discover([str(logs)]), asked)
    assert counted(events) == {"skipped": ["a__m", "b__m", "c__m", "d__m"]}


def test_a_copy_whose_originals_report_was_replaced_gets_its_own(tmp_path: Path) -> None:
    logs, asked = tmp_path / "logs", asked_for(tmp_path / "out", machine_id="H-07")
    for name in ("a", "b", "c"):
        write(logs / f"{name}.mcap", "fine one")
    run(discover([str(logs)]), asked)
    write(logs / "a.mcap", "fine other")
    ends, events = run(discover([str(logs)]), asked)
    assert {n: e.report for n, e in ends.items()} == {"a": "missions/a", "b": "missions/b", "c": "missions/b"}
    shown = {n: (asked.output / str(e.report) / "report.json").read_text("utf-8") for n, e in ends.items()}
    assert shown == {"a": "['fine', 'other']", "b": "['fine', 'one']", "c": "['fine', 'one']"}
    assert [name for kind, name in events if kind == "mission"] == ["a", "b"]


def test_a_resume_reads_no_log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    logs, asked = tmp_path / "logs", asked_for(tmp_path / "out")
    for i in range(3):
        write(logs / f"m{i}.mcap", f"fine {i}")
    run(discover([str(logs)]), asked)

    def read(*_: object) -> None:
        raise AssertionError("a log was read")

    monkeypatch.setattr(reading, "_feed", read)
    for path in logs.iterdir():
        os.chmod(path, 0)  # noqa: PTH101
    _, events = run(discover([str(logs)]), asked)
    assert counted(events) == {"skipped": ["m0", "m1", "m2"]}


def test_a_lost_store_is_made_again_by_the_next_audit(tmp_path: Path) -> None:
    logs, asked = tmp_path / "logs", asked_for(tmp_path / "out")
    for i in range(3):
        write(logs / f"m{i}.mcap", f"fine {i}")
    before, _ = run(discover([str(logs)]), asked)
    for file in asked.output.glob("fleet.sqlite*"):
        file.unlink()
    after, events = run(discover([str(logs)]), asked)
    assert after == before
    assert counted(events) == {"skipped": ["m0", "m1", "m2"]}


def test_missions_that_are_gone_are_marked_and_keep_their_results(tmp_path: Path) -> None:
    logs, asked = tmp_path / "logs", asked_for(tmp_path / "out")
    for i in range(2):
        write(logs / f"m{i}.mcap", f"fine {i}")
    run(discover([str(logs)]), asked)
    (logs / "m0.mcap").unlink()
    run(discover([str(logs)]), asked)
    with Store.open(asked.output / "fleet.sqlite", read_only=True) as store:
        assert {m.name: (m.gone, m.result is not None) for m in store.missions()} == {
            "m0": (True, True),
            "m1": (False, True),
        }


def test_names_that_are_no_text(tmp_path: Path) -> None:
    logs, asked = tmp_path / "logs", asked_for(tmp_path / "out")
    write(logs / "a\udcff" / "m.mcap", "fine one")
    write(logs / "a\udcff" / "b\udcff.mcap", "broken")
    ends, _ = run(discover([str(logs)]), asked)
    assert {n: (e.state, e.machine_id) for n, e in ends.items()} == {
        "a__b": ("unreadable", "a\\xff"), "a__m": ("ok", "M1"),
    }  # fmt: skip
    _, events = run(discover([str(logs)]), asked)
    assert counted(events) == {"skipped": ["a__b", "a__m"]}


def test_objects_are_audited_and_not_fetched_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    system = fsspec.filesystem("memory")
    try:
        system.pipe_file("/fleet/H-07/m.mcap", b"fine one")
        system.pipe_file("/fleet/H-08/m.mcap", b"broken")
        asked = asked_for(tmp_path / "out")
        ends, _ = run(discover(["memory://fleet"]), asked)
        assert {n: (e.state, e.machine_id) for n, e in ends.items()} == {
            "H-07__m": ("ok", "M1"), "H-08__m": ("unreadable", "H-08"),
        }  # fmt: skip
        monkeypatch.setattr(type(system), "get_file", None)
        _, events = run(discover(["memory://fleet"]), asked)
        assert counted(events) == {"skipped": ["H-07__m", "H-08__m"]}
    finally:
        system.store.clear()
