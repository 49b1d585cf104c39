"""Write-ahead logs and rollback journals of SQLite, applied to a copy; the files themselves are never touched."""

from __future__ import annotations

import mmap
import shutil
import tempfile
from pathlib import Path
from typing import IO

import numpy as np
from numpy.typing import NDArray

from replay.arrays.compiling import njit
from replay.log.reading_notes import Report
from replay.readers.common.compiled import plain
from replay.readers.common.room import NoRoom
from replay.readers.rosbag2 import sqlite_kernel as scan

_WAL_MAGICS = (0x377F0682, 0x377F0683)
_JOURNAL_MAGIC = bytes.fromhex("d9d505f920a163d7")
_SPARE = 256 << 20


class SqliteError(Exception):
    """A file is no SQLite database that can be read; the text says why."""


def _copy(path: Path, data: NDArray[np.uint8], room: int) -> IO[bytes]:
    """Copy a database to an unnamed temporary file."""
    free = shutil.disk_usage(tempfile.gettempdir()).free
    if room + _SPARE > free:
        raise NoRoom(f"a copy of {path.name} ({room} bytes)")
    target: IO[bytes] = tempfile.TemporaryFile(prefix="mfhca-")  # noqa: SIM115
    if len(data):
        with path.open("rb") as source:
            shutil.copyfileobj(source, target, 1 << 20)
    return target


def _mapped(file: IO[bytes]) -> NDArray[np.uint8]:
    file.flush()
    with file:
        return np.memmap(file, np.uint8, "r")


@njit(cache=True, no_cpython_wrapper=True)
def _wal_sum(log, at, until, little, s0, s1):  # type: ignore[no-untyped-def]
    """Running checksum of a write-ahead log over the bytes `at` to `until`."""
    for p in range(at, until, 8):
        for half in range(2):
            word = np.int64(0)
            for i in range(4):
                word |= np.int64(log[p + 4 * half + (3 - i if little else i)]) << 24 - 8 * i
            if half == 0:
                s0 = s0 + word + s1 & 0xFFFFFFFF
            else:
                s1 = s1 + word + s0 & 0xFFFFFFFF
    return s0, s1


@njit(cache=True)
def _wal_frames(log, page, little):  # type: ignore[no-untyped-def]
    """Count of the frames up to the last complete transaction before the first one whose checksums fail."""
    s0, s1 = _wal_sum(log, np.int64(0), np.int64(24), little, np.int64(0), np.int64(0))
    if s0 != scan.unsigned(log, 24) or s1 != scan.unsigned(log, 28):
        return 0
    n = complete = 0
    at = np.int64(32)
    while at + 24 + page <= len(log):
        s0, s1 = _wal_sum(log, at, at + 8, little, s0, s1)
        s0, s1 = _wal_sum(log, at + 24, at + 24 + page, little, s0, s1)
        same = scan.unsigned(log, at + 8) == scan.unsigned(log, 16)
        same = same and scan.unsigned(log, at + 12) == scan.unsigned(log, 20)
        if not same or s0 != scan.unsigned(log, at + 16) or s1 != scan.unsigned(log, at + 20):
            break
        n += 1
        if scan.unsigned(log, at + 4):
            complete = n
        at += 24 + page
    return complete


def _holds(path: Path, text: bytes, start: int) -> bool:
    """Whether these bytes stand in a file somewhere behind `start`."""
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as mapped:
        return mapped.find(text, start) >= 0


def with_wal(path: Path, data: NDArray[np.uint8], report: Report) -> NDArray[np.uint8]:
    """Return the database as its write-ahead log leaves it. Both of shape (bytes,)."""
    wal = path.with_name(path.name + "-wal")
    if not wal.is_file() or wal.stat().st_size < 32:
        return data
    log: NDArray[np.uint8] = np.memmap(wal, np.uint8, "r")
    magic, _, page = np.frombuffer(log[:12].tobytes(), ">u4").tolist()
    if magic not in _WAL_MAGICS or page < 512 or page > 65_536 or page & (page - 1):
        report.lost(f"{wal.name} does not start as a write-ahead log; it was left out")
        return data
    complete = int(_wal_frames(plain(log), page, magic == _WAL_MAGICS[0]))
    until = 32 + complete * (24 + page)
    if len(log) > until and ((len(log) - until) % (24 + page) or _holds(wal, log[16:24].tobytes(), until)):
        report.lost(
            f"{wal.name}: {len(log) - until} bytes after byte {until} belong to no complete transaction or fail their "
            "checksums; they were left out"
        )
    if not complete:
        return data
    numbers = np.ndarray((complete, 2), ">u4", log, 32, (24 + page, 4))
    size = int(numbers[complete - 1, 1])
    target = _copy(path, data, len(data) + complete * page)
    last = dict(zip(numbers[:, 0].tolist(), range(complete), strict=True))  # the last frame of a page counts
    for number, k in last.items():
        if 1 <= number <= size:
            target.seek((number - 1) * page)
            target.write(log[56 + k * (24 + page) : 56 + k * (24 + page) + page].data)
    target.truncate(size * page if size * page <= len(data) + complete * page else None)
    report.note(f"{path.name} was not closed by its recorder; it was read together with {wal.name}")
    return _mapped(target)


def with_journal(path: Path, data: NDArray[np.uint8], report: Report) -> NDArray[np.uint8]:
    """Return the database as it was before the transaction that a rollback journal undoes. Both of shape (bytes,)."""
    journal = path.with_name(path.name + "-journal")
    if not journal.is_file() or journal.stat().st_size < 28:
        return data
    log: NDArray[np.uint8] = np.memmap(journal, np.uint8, "r")
    target: IO[bytes] | None = None
    at, done, size, page = 0, set[int](), 0, 0
    while at + 28 <= len(log) and log[at : at + 8].tobytes() == _JOURNAL_MAGIC:
        count, nonce, before, sector, width = np.frombuffer(log[at + 8 : at + 28].tobytes(), ">u4").tolist()
        if target is None:
            if width < 512 or width > 65_536 or width & (width - 1) or before * width > len(data):
                break
            size, page = before, width
            target = _copy(path, data, len(data))
        if width != page or sector < 32 or sector > 65_536:
            break
        place = at + sector
        room = (len(log) - place) // (page + 8)
        for _ in range(room if count == 0xFFFFFFFF else min(count, room)):
            number = int.from_bytes(log[place : place + 4].tobytes(), "big")
            old = log[place + 4 : place + 4 + page]
            check = int.from_bytes(log[place + 4 + page : place + 8 + page].tobytes(), "big")
            if (nonce + int(old[page - 200 : 0 : -200].astype(np.int64).sum())) & 0xFFFFFFFF != check:
                break
            if 1 <= number <= size and number not in done:  # the oldest content counts
                done.add(number)
                target.seek((number - 1) * page)
                target.write(old.data)
            place += page + 8
        at = -(-place // sector) * sector
    if target is None:
        return data
    target.truncate(size * page)
    report.note(f"{path.name} was not closed by its recorder; {journal.name} undid its last, unfinished transaction")
    return _mapped(target)
