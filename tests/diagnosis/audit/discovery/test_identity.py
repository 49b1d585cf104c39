"""Folders that tell machines apart, machine files beside logs, and what is not looked into."""

from __future__ import annotations

import io
from pathlib import Path

import pytest

from diagnosis.audit.discovery.discover import discover
from diagnosis.audit.discovery.identity import fallback_id, telling_folder


def put(root: Path, *names: str) -> None:
    for name in names:
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(b"\x89MCAP0\r\n" + name.encode())


@pytest.mark.parametrize(
    ("path", "machine"),
    [
        ("srv/Lader_07/2026-03-01", "Lader_07"),
        ("srv/AX/2026/03/17", "AX"),
        ("srv/AX/2026/March/17", "AX"),
        ("srv/AX/2026/KW12", "AX"),
        ("srv/AX/20260301_101500", "AX"),
        ("srv/AX/2026-03-01T10:15:00Z/csv", "AX"),
        ("srv/AX/14.03.2026", "AX"),
        ("robots/kitchen/bags", "kitchen"),
        ("fleet/1", "1"),
        ("fleet/12/logs", "12"),
        ("fleet/May", "May"),
        ("logs", "logs"),
        ("logs/2026-03-01", "2026-03-01"),
        ("", ""),
    ],
)
def test_dates_and_usual_words_are_no_machines(path: str, machine: str) -> None:
    assert telling_folder(path.split("/")) == machine


def test_missions_of_one_machine_on_several_days(tmp_path: Path) -> None:
    put(tmp_path, "AX/2026-03-01/m.mcap", "AX/2026-03-02/m.mcap", "BX/2026-03-01/m.mcap", "BX/bags/n.mcap")
    assert sorted(fallback_id(m) for m in discover([str(tmp_path)]).missions) == ["AX", "AX", "BX", "BX"]


def test_the_closest_machine_file_counts(tmp_path: Path) -> None:
    put(tmp_path, "AX/1/m.mcap", "AX/2/m.mcap", "BX/m.mcap", "m.mcap", "rec/metadata.yaml", "rec/r.db3", "AX/3/m.mcap")
    for place in ("AX", "AX/2", "BX"):
        (tmp_path / place / "machine.toml").write_text("")
    (tmp_path / "AX/3/own.toml").write_text("")
    (tmp_path / "AX/3/mission.toml").write_text('machine = "own.toml"')
    found = {m.name: m.machine_file for m in discover([str(tmp_path)]).missions}
    expected = {
        "AX__1__m": "AX/machine.toml",
        "AX__2__m": "AX/2/machine.toml",
        "AX__3": "AX/3/own.toml",
        "BX__m": "BX/machine.toml",
    }
    assert found == {n: str(tmp_path / f) for n, f in expected.items()} | {"m": None, "rec": None}
    single = discover([str(tmp_path / "BX/m.mcap")]).missions
    assert [m.machine_file for m in single] == [str(tmp_path / "BX/machine.toml")]


def test_archives_are_named_and_open_bags_are_logs(tmp_path: Path) -> None:
    put(tmp_path, "m.mcap", "old.zip", "x/run.bag.active", "notes.md")
    found = discover([str(tmp_path)])
    assert [m.name for m in found.missions] == ["m", "x__run"]
    (note,) = found.notes
    assert note == f"not looked into: {tmp_path}/old.zip; unpack what holds logs of machines, to have them audited"


def by_machine_file(*words: str) -> dict[str, str | None]:
    return {m.name: m.machine_file for m in discover(words).missions}


def test_a_machine_file_is_found_however_logs_are_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    put(tmp_path, "logs/AX/run_1/a.mcap", "logs/AX/run_2/b.mcap", "logs/BX/c.mcap")
    for machine in ("AX", "BX"):
        (tmp_path / f"logs/{machine}/machine.toml").write_text("")
    logs = tmp_path / "logs"
    whole = by_machine_file(str(logs))
    assert whole == {
        "AX__run_1__a": str(logs / "AX/machine.toml"),
        "AX__run_2__b": str(logs / "AX/machine.toml"),
        "BX__c": str(logs / "BX/machine.toml"),
    }
    assert by_machine_file(f"{logs}/**/*.mcap") == whole
    assert by_machine_file(f"{logs}/AX/run_*/a.mcap", f"{logs}/*/*.mcap") == {
        k: whole[k] for k in ("AX__run_1__a", "BX__c")
    }
    listed = "\n".join(str(p) for p in sorted(logs.rglob("*.mcap")))
    monkeypatch.setattr("sys.stdin", io.StringIO(listed))
    assert by_machine_file("-") == whole
    assert by_machine_file(str(logs / "AX/run_1")) == {"a": whole["AX__run_1__a"]}


def test_a_folder_for_temporary_files_has_no_machine_file(tmp_path: Path) -> None:
    put(tmp_path, "x/m.mcap")
    (tmp_path / "machine.toml").write_text("")
    tmp_path.chmod(0o1777)
    assert by_machine_file(str(tmp_path / "x")) == {"m": None}
