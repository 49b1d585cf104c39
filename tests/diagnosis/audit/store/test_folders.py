from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest

from diagnosis.audit.store.folders import run_folders, sweep
from diagnosis.audit.store.locks import WORKING, FileLock, check_locks
from replay.errors import OutputError


def test_a_sweep_between_opening_and_locking_costs_no_run_its_folders(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    acquire, swept = FileLock.acquire, list[Path]()

    def late(self: FileLock) -> bool:
        if self.path.suffix == ".lock" and not swept:
            swept.append(self.path)
            sweep(tmp_path)
        return acquire(self)

    (tmp_path / WORKING).mkdir()
    monkeypatch.setattr(FileLock, "acquire", late)
    with run_folders(tmp_path) as place:
        sweep(tmp_path)  # another audit begins
        assert place.folder.is_dir()
        assert place.temporary.is_dir()
    assert swept
    assert list((tmp_path / WORKING).iterdir()) == []


@pytest.mark.parametrize("number", [errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP])
def test_a_file_system_without_locks_is_said_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    def refuse(*_: object) -> None:
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr("fcntl.flock", refuse)
    for act in (check_locks, lambda output: run_folders(output).__enter__()):
        with pytest.raises(
            OutputError, match=r"its file system gives no locks \(.*\), .*give an output folder on a local"
        ):
            act(tmp_path)
    assert not list((tmp_path / WORKING).glob("*.lock"))
    sweep(tmp_path)
