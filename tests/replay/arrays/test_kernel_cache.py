from __future__ import annotations

from pathlib import Path

import pytest

from replay.arrays.kernel_cache import drop_stale_kernels


@pytest.fixture
def package(tmp_path: Path) -> Path:
    for folder in ("a", "a/b"):
        cache = tmp_path / folder / "__pycache__"
        cache.mkdir(parents=True)
        (tmp_path / folder / "kernel.py").write_text("x = 1\n")
    return tmp_path / "a"


def compiled(folder: Path) -> Path:
    path = folder / "__pycache__" / "kernel.scan-1.py311.nbi"
    path.write_bytes(b"old")
    return path


def test_kernels_of_changed_sources_alone_are_removed(package: Path, tmp_path: Path) -> None:
    stamp = tmp_path / "stamp.json"
    assert drop_stale_kernels([package], stamp) == []  # nothing compiled yet: what is there is remembered
    outer, inner = compiled(package), compiled(package / "b")
    assert drop_stale_kernels([package], stamp) == []
    (package / "b" / "models.py").write_text("y = 2\n")
    assert drop_stale_kernels([package], stamp) == [str(package / "b")]
    assert outer.exists()
    assert not inner.exists()
    compiled(package / "b")
    assert drop_stale_kernels([package], stamp) == []


def test_kernels_that_take_something_of_changed_sources_are_removed(package: Path, tmp_path: Path) -> None:
    beside, far = tmp_path / "a" / "c", tmp_path / "a" / "d"
    for folder, text in ((beside, "from a.b.models import y\n@njit\n"), (far, "from a.c import kernel\nnjit\n")):
        (folder / "__pycache__").mkdir(parents=True)
        (folder / "kernel.py").write_text(text)
    stamp = tmp_path / "stamp.json"
    drop_stale_kernels([package], stamp)
    outer, user, users_user = compiled(package), compiled(beside), compiled(far)
    (package / "b" / "models.py").write_text("y = 2\n")
    assert drop_stale_kernels([package], stamp) == [str(beside), str(far)]
    assert (outer.exists(), user.exists(), users_user.exists()) == (True, False, False)


def test_kernels_of_unknown_age_are_removed(package: Path, tmp_path: Path) -> None:
    old = compiled(package)
    stamp = tmp_path / "stamp.json"
    stamp.write_text("not JSON")
    assert drop_stale_kernels([package], stamp) == [str(package)]
    assert not old.exists()


def test_where_nothing_can_be_remembered_nothing_is_removed(package: Path, tmp_path: Path) -> None:
    kernel = compiled(package)
    assert drop_stale_kernels([package], tmp_path / "no folder" / "below" / "stamp.json") == []
    assert kernel.exists()


def test_the_stamp_gets_its_folder(package: Path, tmp_path: Path) -> None:
    stamp = tmp_path / "__pycache__" / "stamp.json"
    drop_stale_kernels([package], stamp)
    kernel = compiled(package)
    assert drop_stale_kernels([package], stamp) == []
    assert kernel.exists()
