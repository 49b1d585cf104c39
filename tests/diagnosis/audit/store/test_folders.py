from __future__ import annotations

import errno
import os
import subprocess
import sys
from pathlib import Path

import pytest

from diagnosis.audit.store.folders import run_folders, sweep, swept_folder
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


def test_folders_whose_process_was_ended_while_it_made_or_removed_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "temporary"))
    now, before, fresh = (tmp_path / "temporary" / f"mfhca-audit-{name}" for name in ("now", "before", "fresh"))
    for folder in (now, before, fresh):
        (folder / "files").mkdir(parents=True)

    def end(path: Path, *_: object, **__: object) -> None:
        raise KeyboardInterrupt  # as SIGTERM does

    ending = swept_folder()
    half = ending.__enter__()
    (half / "warm").mkdir()
    with monkeypatch.context() as patch:
        patch.setattr("shutil.rmtree", end)
        with pytest.raises(KeyboardInterrupt):
            ending.__exit__(None, None, None)
    assert (half / ".held").exists()  # its lock goes last, and so the next one finds it
    os.utime(before, (1e9, 1e9))
    (tmp_path / WORKING).mkdir()
    sweep(tmp_path)
    assert sorted(p.name for p in (tmp_path / "temporary").iterdir()) == ["mfhca-audit-fresh", "mfhca-audit-now"]


def test_a_signal_as_soon_as_a_folder_is_made_leaves_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "temporary"))
    (tmp_path / "temporary").mkdir()
    make, made = os.mkdir, list[str]()

    def ended(path: str, *words: object, **more: object) -> None:
        make(path, *words, **more)  # type: ignore[arg-type]
        if "mfhca-audit-" in str(path):
            made.append(str(path))
            raise SystemExit(143)  # as SIGTERM does

    monkeypatch.setattr("os.mkdir", ended)
    for act in (swept_folder, lambda: run_folders(tmp_path / "out")):
        with pytest.raises(SystemExit), act():
            pass
    assert len(made) == 2
    assert not list((tmp_path / "temporary").iterdir())


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


def test_a_folder_is_removed_although_a_signal_comes_while_it_is(tmp_path: Path) -> None:
    call = (
        "import shutil, sys, threading, time; from diagnosis.audit.store import folders; remove = shutil.rmtree; calls = []\n"
        "def ended(*args, **kwargs):\n"
        "    if not calls:\n"
        "        calls.append(1); sys.exit(3)\n"
        "    remove(*args, **kwargs)\n"
        "folders.shutil.rmtree = ended\n"
        "with folders.swept_folder() as folder:\n"
        "    (folder / 'log').write_text('')"
    )
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(p for p in sys.path if p), "TMPDIR": str(tmp_path)}
    assert subprocess.run([sys.executable, "-c", call], env=environment, check=False).returncode == 3
    assert list(tmp_path.iterdir()) == []
