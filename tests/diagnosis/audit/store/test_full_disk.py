"""A disk that is full at one write after the other: one sentence, no damage, and the next audit does exactly the rest."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from diagnosis.audit import engines
from diagnosis.audit.session import audit
from diagnosis.audit.store.store import Store
from replay.errors import OutputError
from tests.diagnosis.audit.samples import COLD, asked_for, missions, run

_PAGE = 4096
_STEPS = int(os.environ.get("MFHCA_FULL_DISK_STEPS", "12"))  # sizes of the disk, from one page to all that is needed
_WORKS = ("fine-1", "broken", "fine-2", "fine-3")


class Disk:
    """A file system in memory whose size can be set."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def mount(self, pages: int) -> bool:
        self.path.mkdir(exist_ok=True)
        return _mount("-t", "tmpfs", "-o", f"size={pages * _PAGE}", "tmpfs", str(self.path))

    def grow(self, pages: int) -> None:
        assert _mount("-o", f"remount,size={pages * _PAGE}", str(self.path))

    def used(self) -> int:
        told = subprocess.run(["stat", "-f", "-c", "%b %f", str(self.path)], capture_output=True, text=True, check=True)
        whole, free = map(int, told.stdout.split())
        return whole - free

    def unmount(self) -> None:
        subprocess.run(["umount", str(self.path)], check=False, capture_output=True)


def _mount(*words: str) -> bool:
    try:
        return subprocess.run(["mount", *words], check=False, capture_output=True).returncode == 0
    except OSError:
        return False


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[Disk]:
    made = Disk(tmp_path / "disk")
    if sys.platform != "linux" or not made.mount(1 << 14):
        pytest.skip("this user may not mount a file system in memory")
    made.unmount()
    yield made
    made.unmount()


def acknowledged(disk: Disk, folder: Path) -> tuple[list[str], str]:
    """Missions that an audit acknowledges, and the sentence with which it ends; empty where it completes."""
    told: list[str] = []

    def tell(event: str, facts: dict[str, object]) -> None:
        if event == "mission":
            told.append(str(facts["name"]))

    try:
        audit(missions(folder, *_WORKS), asked_for(disk.path / "out"), lambda: engines.local(1, COLD), tell)
    except OutputError as error:
        return told, str(error)
    return told, ""


def test_a_disk_that_is_full_at_any_write(disk: Disk, tmp_path: Path) -> None:
    disk.mount(1 << 14)
    run(missions(tmp_path / "logs", *_WORKS), asked_for(disk.path / "out"), jobs=1)
    needed = disk.used()
    disk.unmount()
    stopped = 0
    for step in range(_STEPS):
        disk.mount(1 + step * needed // _STEPS)
        told, sentence = acknowledged(disk, tmp_path / "logs")
        if sentence:
            stopped += 1
            assert "cannot be written" in sentence
            assert "\n" not in sentence
        disk.grow(1 << 14)
        if (disk.path / "out" / "fleet.sqlite").is_file():
            with Store.open(disk.path / "out" / "fleet.sqlite") as store:
                assert store.database.rows("PRAGMA integrity_check")[0][0] == "ok"
                kept = {one.name for one in store.missions() if one.result is not None}
            assert set(told) <= kept
        ends, events = run(missions(tmp_path / "logs", *_WORKS), asked_for(disk.path / "out"), jobs=1)
        assert {name: end.state for name, end in ends.items()} == {
            name: "unreadable" if name == "broken" else "ok" for name in _WORKS
        }
        assert not {name for kind, name in events if kind == "mission"} & set(told)
        assert [p.name for p in (disk.path / "out" / ".work").iterdir()] == ["claims"]
        disk.unmount()
    assert stopped > _STEPS // 2
