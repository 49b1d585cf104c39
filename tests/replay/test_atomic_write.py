"""Results appear whole or not at all; several that belong together all or none."""

from __future__ import annotations

import errno
from pathlib import Path

import pytest

from replay.atomic_write import atomic_path, atomic_paths, made_folder
from replay.errors import OutputError


def fill(names: list[Path]) -> None:
    with atomic_paths(*names) as temporary:
        temporary[0].write_text("second")
        raise OSError(errno.ENOSPC, "No space left on device")


def test_all_of_them_or_none(tmp_path: Path) -> None:
    names = [tmp_path / "a", tmp_path / "b"]
    with atomic_paths(*names) as temporary:
        for t in temporary:
            t.write_text("first")
        assert not any(n.exists() for n in names)
    assert [n.read_text() for n in names] == ["first", "first"]
    with pytest.raises(OutputError, match="No space left"):
        fill(names)
    assert [n.read_text() for n in names] == ["first", "first"]
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a", "b"]


def test_a_read_only_place_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(self: Path, missing_ok: bool = False) -> None:
        raise OSError(errno.EROFS, "Read-only file system", str(self))

    monkeypatch.setattr(Path, "unlink", refuse)
    words = r"out\.mcap: cannot be written \(Read-only file system\); give another place"
    with pytest.raises(OutputError, match=words), atomic_path(tmp_path / "out.mcap"):
        pass


def test_folders_made_for_nothing_are_removed_and_others_stay(tmp_path: Path) -> None:
    (tmp_path / "old").mkdir()
    with pytest.raises(OutputError, match="No space left"):
        fill([tmp_path / "old" / "new" / "deep" / "a"])
    with pytest.raises(OutputError, match="No space left"):
        fill([tmp_path / "old" / "a"])
    assert [p.name for p in tmp_path.rglob("*")] == ["old"]
    (tmp_path / "kept").mkdir()
    (tmp_path / "kept" / "file").touch()
    with pytest.raises(OutputError, match="No space left"), made_folder(tmp_path / "kept" / "empty"):
        fill([tmp_path / "kept" / "empty" / "a"])
    assert sorted(p.name for p in tmp_path.rglob("*")) == ["file", "kept", "old"]
