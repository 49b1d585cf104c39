from __future__ import annotations

from pathlib import Path

import pytest

from diagnosis.audit.store.folders import run_folders, sweep
from diagnosis.audit.store.locks import WORKING, FileLock


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
