"""Work that goes wrong in the ways that logs make it go wrong; named by the first line of the file, never by a log."""

from __future__ import annotations

import ctypes
import errno
import mmap
import os
import signal
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

from diagnosis.audit.isolation.child import REPORT, Work
from replay.arrays.processors import each
from replay.errors import LogError, NotJudged, OutputError


def judge(work: Work) -> dict[str, Any]:
    """Do what the mission's file says."""
    told = Path(work.files[0]).read_text(encoding="utf-8").split()
    found = globals()[f"_{told[0]}"](work) if told[0] != "fine" else None
    report = Path(work.folder) / REPORT
    try:
        report.mkdir()
        for name in ("report.html", "report.json", "report.parquet"):
            (report / name).write_text(f"{told}", encoding="utf-8")
    except OSError as error:
        raise OutputError(f"{report}: cannot be written ({error.strerror})") from error
    facts = {"machine_id": "M1", "machine_name": "test", "verdict": "ready", "title": "No fault found"}
    return found or {"state": "ok", "reason": "", "summary": {"result": facts, "faults": [], "components": []}}


def _damaged(work: Work) -> dict[str, Any]:
    return {"state": "degraded", "reason": "12 bytes are missing", "summary": None}


def _parts(work: Work) -> dict[str, Any]:
    threads = set(each(lambda _: threading.get_ident(), range(8), rows=1))
    return {"state": "degraded", "reason": f"{len(threads)} thread", "summary": None}


def _kill(work: Work) -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def _hang(work: Work) -> None:
    time.sleep(60)


def _spin(work: Work) -> None:
    while True:
        pass


def _raise(work: Work) -> None:
    raise KeyError("topic")


def _segfault(work: Work) -> None:
    ctypes.string_at(0)


def _exhaust(work: Work) -> None:
    held = []
    while True:
        held.append(bytearray(1 << 22))


def _exhaust_shared(work: Work) -> None:
    held = mmap.mmap(-1, 4 << 30)
    for at in range(0, len(held), mmap.PAGESIZE):
        held[at] = 1


def _leave(work: Work) -> None:
    os._exit(5)


def _fill(work: Work) -> None:
    with tempfile.TemporaryFile() as file:
        while True:
            file.write(bytes(1 << 20))


def _cut(work: Work) -> None:
    with Path(work.temporary, "log").open("w+b") as file:
        file.write(bytes(1 << 16))
        file.flush()
        held = mmap.mmap(file.fileno(), 0)
        file.truncate(0)
        _ = held[100]


def _broken(work: Work) -> None:
    raise LogError("x.bag ends at byte 12")


def _dumb(work: Work) -> None:
    raise NotJudged("x.bag: no wheel speed was found")


def _unwritten(work: Work) -> None:
    raise OutputError("report.json: cannot be written (No space left on device)")


def _changed(work: Work) -> None:
    Path(work.files[0]).write_text("fine but longer", encoding="utf-8")


def _touched(work: Work) -> None:
    """Is given another time while it is read, once."""
    if _first(work):
        os.utime(work.files[0], (1e9, 1e9))


def _away(work: Work) -> None:
    """Is on a disk that fails once."""
    if _first(work):
        raise OSError(errno.EIO, os.strerror(errno.EIO), work.files[0])


def _dropped(work: Work) -> None:
    """Is on a server that loses the connection once."""
    if _first(work):
        raise LogError("x.bag: cannot be read") from ConnectionResetError(errno.ECONNRESET, "reset")


def _slow(work: Work) -> None:
    time.sleep(0.3)


def _once(work: Work) -> None:
    """Ends badly the first time."""
    if _first(work):
        os.abort()


def _first(work: Work) -> bool:
    mark = Path(f"{work.files[0]}.mark")
    if mark.exists():
        return False
    mark.touch()
    return True
