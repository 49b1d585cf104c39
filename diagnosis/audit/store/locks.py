"""Locks on what only one audit of an output may do at a time; they end with their holder."""

from __future__ import annotations

import errno
import hashlib
import os
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from replay.errors import OutputError

WORKING = ".work"
_POLL_S = 0.05
_HELD = {errno.EAGAIN, errno.EWOULDBLOCK, errno.EACCES, errno.EDEADLK, errno.ENOENT, errno.EINTR}
"""Errors that say that another process holds a lock, or has just removed its file."""
_REMEDY = (
    "give an output folder on a local disk with -o (and set TMPDIR to one where this is the folder for temporary files), or "
    "have the file system mounted with locks (Lustre: -o flock, NFS: with its lock daemon)"
)


class FileLock:
    """A file lock that the system lets go of when its holder ends, however that happens."""

    def __init__(self, path: Path) -> None:
        self._file: IO[bytes] = path.open("ab")
        self.path = path

    def acquire(self) -> bool:
        """Acquire it unless another process holds it.

        Raises
        ------
        OutputError
            Where the file system gives no locks at all.
        """
        try:
            if sys.platform == "win32":
                import msvcrt

                self._file.seek(0)
                msvcrt.locking(self._file.fileno(), msvcrt.LK_NBLCK, 1)
            else:
                import fcntl

                fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                # a run that sweeps may have removed the file before it was locked
                return os.path.samestat(os.fstat(self._file.fileno()), self.path.stat())
        except OSError as error:
            if error.errno in _HELD:
                return False
            raise OutputError(
                f"{self.path.parent}: its file system gives no locks ({error.strerror or error}), and without them two audits "
                f"would write over each other; {_REMEDY}"
            ) from error
        return True

    def release(self) -> None:
        """Release it."""
        self._file.close()


def lock_mission(output: Path, name: str) -> FileLock | None:
    """FileLock a mission for this run; None where another run on the same output is at it.

    Raises
    ------
    OutputError
        Where the output cannot be written.
    """
    folder = output / WORKING / "claims"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        lock = FileLock(folder / hashlib.sha256(name.encode("utf-8", "surrogateescape")).hexdigest()[:24])
    except OSError as error:
        raise cannot_write(error, output) from error
    taken = False
    try:
        taken = lock.acquire()
    finally:
        if not taken:
            lock.release()
    return lock if taken else None


def check_locks(output: Path) -> None:
    """Find out at once whether the output's file system gives locks.

    Raises
    ------
    OutputError
        Where it does not, or the output cannot be written.
    """
    lock = lock_mission(output, "locks")
    if lock is not None:
        lock.release()


@contextmanager
def exclusively(output: Path, name: str, patience_s: float) -> Iterator[None]:
    """Do something that only one audit of an output may do at a time; after `patience_s` it is done all the same.

    Patience in s.

    Raises
    ------
    OutputError
        Where the output cannot be written.
    """
    end = time.monotonic() + patience_s
    lock = lock_mission(output, name)
    while lock is None and time.monotonic() < end:
        time.sleep(_POLL_S)
        lock = lock_mission(output, name)
    try:
        yield
    finally:
        if lock is not None:
            lock.release()


def cannot_write(error: OSError, path: Path) -> OutputError:
    """One sentence for an output that cannot be written."""
    return OutputError(
        f"{error.filename or path}: cannot be written ({error.strerror or error}); finished missions are kept; "
        "run the same command again to continue"
    )
