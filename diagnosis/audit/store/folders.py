"""Places in an audit's folder: a run's own working folder, locks on missions, and reports that appear whole."""

from __future__ import annotations

import atexit
import ctypes
import errno
import os
import secrets
import shutil
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from diagnosis.audit.store.keys import Key
from diagnosis.audit.store.locks import WORKING, FileLock, cannot_write, lock_mission
from replay.errors import OutputError

MISSIONS, RESULTS = "missions", "results"
_TEMPORARY = "mfhca-audit-"
_HELD = ".held"
_MARK = ".key"
_TRIES = 100
_LONG_S = 3600.0  # nobody takes so long from making a folder to locking it
_AT_FDCWD, _RENAME_EXCHANGE = -100, 2
#: This process's folders for temporary files that are not removed yet.
_MADE: set[Path] = set()


@dataclass(frozen=True)
class RunFolders:
    """A run's own folders, gone after it.

    Attributes
    ----------
    folder : Path
        Below the output, so that a finished report is moved and not copied.
    temporary : Path
        Below the system's folder for temporary files.
    """

    folder: Path
    temporary: Path


@contextmanager
def run_folders(output: Path) -> Iterator[RunFolders]:
    """Make the run's own folders; remove them at the end, and those that runs ended by force have left.

    Raises
    ------
    OutputError
        Where the output cannot be written.
    """
    base = output / WORKING
    with ExitStack() as ending:
        try:
            for name in (MISSIONS, RESULTS, WORKING):
                (output / name).mkdir(parents=True, exist_ok=True)
            sweep(output)
            folder, lock = _own_folder(base, ending)
            temporary = _own_temporary(lock.path, ending)
        except OSError as error:
            raise cannot_write(error, output) from error
        yield RunFolders(folder, temporary)


def _own_folder(base: Path, ending: ExitStack) -> tuple[Path, FileLock]:
    for _ in range(_TRIES):
        folder = base / f"{os.getpid()}-{secrets.token_hex(4)}"
        lock = FileLock(base / f"{folder.name}.lock")
        if _acquired(lock):
            ending.callback(lock.release)
            ending.callback(_unlink, lock.path)
            ending.callback(shutil.rmtree, folder, ignore_errors=True)
            folder.mkdir()
            return folder, lock
        lock.release()  # another run that sweeps was faster
    raise OSError(errno.EBUSY, "other processes remove its files as fast as they are made", str(base))


def _acquired(lock: FileLock) -> bool:
    """Acquire a lock whose file is of no use where there are no locks."""
    try:
        return lock.acquire()
    except BaseException:
        lock.release()
        _unlink(lock.path)
        raise


def _own_temporary(note: Path, ending: ExitStack) -> Path:
    for _ in range(_TRIES):
        temporary = Path(tempfile.gettempdir()) / f"{_TEMPORARY}{secrets.token_hex(8)}"
        note.write_bytes(os.fsencode(temporary))  # first, so that the next run finds it in any case
        ending.callback(_remove, temporary)
        temporary.mkdir(0o700)
        held = FileLock(temporary / _HELD)
        ending.callback(held.release)
        if _acquired(held):
            return temporary
        held.release()  # another run that sweeps was faster
    raise OSError(errno.EBUSY, "other processes remove its folders as fast as they are made", tempfile.gettempdir())


@contextmanager
def swept_folder() -> Iterator[Path]:
    """Make a temporary folder that the next audit removes where this process is ended by force."""
    with ExitStack() as ending:
        folder = Path(tempfile.gettempdir()) / f"{_TEMPORARY}{secrets.token_hex(8)}"
        _MADE.add(folder)
        ending.callback(_remove, folder)  # first: a signal may end this process as soon as the folder is made
        folder.mkdir(0o700)
        held = FileLock(folder / _HELD)
        ending.callback(held.release)
        held.acquire()
        yield folder


def _remove(folder: Path) -> None:
    """Remove a folder for temporary files, its lock last: who is ended meanwhile leaves what the next audit removes."""
    with suppress(OSError):
        for path in folder.iterdir():
            if path.is_dir() and not path.is_symlink():
                shutil.rmtree(path, ignore_errors=True)
            elif path.name != _HELD:
                _unlink(path)
    shutil.rmtree(folder, ignore_errors=True)
    if not folder.exists():
        _MADE.discard(folder)


@atexit.register
def _remove_left() -> None:
    """Remove what is left because a signal came while it was being removed, or a thread that had not ended wrote once more."""
    for folder in tuple(_MADE):
        _remove(folder)


def _unlink(path: Path) -> None:
    with suppress(OSError):
        path.unlink()


def sweep(output: Path) -> None:
    """Remove what runs that were ended by force have left, of this output and of others: their locks are free."""
    base = output / WORKING
    for path in base.glob("*.lock"):
        try:
            lock = FileLock(path)
        except OSError:
            continue
        if lock.acquire():
            with suppress(OSError):
                temporary = Path(os.fsdecode(path.read_bytes()).strip() or ".")
                if temporary.name.startswith(_TEMPORARY):
                    shutil.rmtree(temporary, ignore_errors=True)
                shutil.rmtree(path.with_suffix(""), ignore_errors=True)
                path.unlink()
        lock.release()
    for folder in base.glob("[0-9]*-*"):  # a run makes its lock before its folder
        if folder.is_dir() and not folder.with_name(f"{folder.name}.lock").exists():
            shutil.rmtree(folder, ignore_errors=True)
    for held in Path(tempfile.gettempdir()).glob(f"{_TEMPORARY}*/{_HELD}"):
        try:
            lock = FileLock(held)
        except OSError:  # another user's
            continue
        with suppress(OutputError):  # a disk without locks: whose folder it is cannot be told
            if lock.acquire():
                _remove(held.parent)
        lock.release()
    for folder in Path(tempfile.gettempdir()).glob(f"{_TEMPORARY}*"):  # ended between making it and its lock
        with suppress(OSError):
            if not (folder / _HELD).exists() and time.time() - folder.stat().st_mtime > _LONG_S:
                shutil.rmtree(folder, ignore_errors=True)


def publish(made: Path, place: Path, key: Key) -> None:
    """Move a finished report to its place; one that stands there is exchanged in one step where the system can.

    The report is marked with the key of its result: the next one of the mission, under another configuration or of
    another content, takes the same place.

    Raises
    ------
    OutputError
        Where the place cannot be written; what stood there stands still.
    """
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        mark_report(made, key)
        for file in made.iterdir():
            _flush(file)
        if not place.exists():
            made.rename(place)
        elif not _exchange(made, place):
            aside = made.with_name(f"{made.name}.old")
            place.rename(aside)
            made.rename(place)
        _flush(place.parent)
    except OSError as error:
        raise cannot_write(error, place) from error


def mark_report(folder: Path, key: Key) -> None:
    """Mark a report with the key of its result."""
    (folder / _MARK).write_bytes(_marked(key))


def holds_report(folder: Path | str, key: Key) -> bool:
    """Whether the report in a folder is that of a key's result, not of another one that took its place."""
    try:
        mark = os.open(f"{folder}/{_MARK}", os.O_RDONLY)  # asked of every mission of a fleet
        try:
            return os.read(mark, 1 << 12) == _marked(key)
        finally:
            os.close(mark)
    except (OSError, ValueError):  # a name from a damaged store
        return False


@contextmanager
def own_report(output: Path, report: str, key: Key) -> Iterator[Path | None]:
    """Lock a result's report to change it; None where another run is at its mission, or it is not there any more.

    Raises
    ------
    OutputError
        Where the output cannot be written.
    """
    lock = lock_mission(output, report.removeprefix(f"{MISSIONS}/"))
    try:
        folder = output / report
        yield folder if lock is not None and holds_report(folder, key) else None
    finally:
        if lock is not None:
            lock.release()


def _marked(key: Key) -> bytes:
    return f"{key.log_hash}\n{key.config_hash}\n{key.version}\n".encode()


def write_whole(path: Path, data: bytes) -> None:
    """Write a file under a temporary name, and give it its own once it is on the disk.

    Raises
    ------
    OutputError
        Where it cannot be written.
    """
    part = path.with_name(f".{path.name}.{os.getpid()}-{secrets.token_hex(4)}.part")
    try:
        with part.open("wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        part.replace(path)
    except OSError as error:
        with suppress(OSError):
            part.unlink()
        raise cannot_write(error, path) from error


def _exchange(one: Path, other: Path) -> bool:
    if sys.platform != "linux":
        return False
    try:
        call = ctypes.CDLL(None, use_errno=True).renameat2
    except (AttributeError, OSError):
        return False
    done: int = call(_AT_FDCWD, os.fsencode(one), _AT_FDCWD, os.fsencode(other), _RENAME_EXCHANGE)
    return done == 0


def _flush(path: Path) -> None:
    if os.name == "nt":
        return
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
