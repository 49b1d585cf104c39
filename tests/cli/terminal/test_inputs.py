"""Words of the command line become paths, wheels and times."""

from __future__ import annotations

import io
from pathlib import Path

import pytest

from cli.terminal.inputs import find_logs


def make(folder: Path, *names: str) -> None:
    for name in names:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("x")


def test_a_folder_gives_its_logs_sorted_and_counts_the_rest(tmp_path: Path) -> None:
    make(tmp_path, "b.mcap", "a.bag", "notes.md", "deep/c.CSV", "rec/metadata.yaml", "rec/rec_0.db3", ".x/d.mcap")
    found = find_logs([str(tmp_path)])
    assert [p.relative_to(tmp_path).as_posix() for p in found.paths] == ["a.bag", "b.mcap", "deep/c.CSV", "rec"]
    assert (found.left_aside, found.missing) == (1, [])


def test_a_saved_result_is_no_log(tmp_path: Path) -> None:
    make(tmp_path, "m-report/report.json", "m-report/report.parquet", "plain/report.parquet")
    assert [p.parent.name for p in find_logs([str(tmp_path)]).paths] == ["plain"]


def test_globs_stdin_and_repetitions(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    make(tmp_path, "a.mcap", "sub/b.mcap", "c [1].mcap")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.stdin", io.StringIO("sub/b.mcap\n\nc [1].mcap\n"))
    found = find_logs(["**/*.mcap", "a.mcap", "-"])
    assert sorted(p.as_posix() for p in found.paths) == ["a.mcap", "c [1].mcap", "sub/b.mcap"]


def test_nothing_found_is_said(tmp_path: Path) -> None:
    make(tmp_path, "empty/readme.md")
    found = find_logs([str(tmp_path / "no.mcap"), str(tmp_path / "*.bag"), str(tmp_path / "empty")])
    assert found.paths == []
    assert [m.partition(": ")[2][:13] for m in found.missing] == ["no such file", "matches no fi", "holds no log "]


def test_links_to_folders_are_not_followed(tmp_path: Path) -> None:
    make(tmp_path, "logs/a.mcap")
    (tmp_path / "logs" / "loop").symlink_to(tmp_path / "logs", target_is_directory=True)
    assert [p.name for p in find_logs([str(tmp_path / "logs")]).paths] == ["a.mcap"]
