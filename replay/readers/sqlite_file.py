"""An SQLite file as pages: opened without touching it, its write-ahead log or rollback journal taken into account."""

from __future__ import annotations

import mmap
import re
import shutil
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from replay.readers import sqlite_scan as scan
from replay.readers.clocks import Report

MAGIC = b"SQLite format 3\0"
_WAL_MAGICS = (0x377F0682, 0x377F0683)
_JOURNAL_MAGIC = bytes.fromhex("d9d505f920a163d7")
_MAX_CELL = 16 << 20
_ENCODINGS = {2: "utf-16-le", 3: "utf-16-be"}
_SPARE = 256 << 20

Value = int | float | str | bytes | None


class SqliteError(Exception):
    """A file is no SQLite database that can be read; the text says why."""


@dataclass(frozen=True)
class Table:
    """One table or index as its schema states it."""

    name: str
    root: int
    sql: str

    def columns(self) -> list[str]:
        """Names of the columns, in order."""
        return _column_names(self.sql)


@dataclass
class Image:
    """The pages of one database.

    Attributes
    ----------
    path : Path
        The file.
    data : NDArray[np.uint8], shape (b,)
        Its bytes, with what a write-ahead log or journal says about them.
    page, usable : int
        Page size, and bytes of a page that hold content.
    seen : NDArray[np.uint8], shape (pages + 1,)
        Pages that were visited; index 0 is not used.
    suspects : list[int]
        Pages that a table names and that are none of its pages (0: beyond the file, or named twice).
    """

    path: Path
    data: NDArray[np.uint8]
    page: int
    usable: int
    seen: NDArray[np.uint8]
    suspects: list[int]
    encoding: str

    def leaves(self, root: int, wanted: NDArray[np.int64] | None = None) -> NDArray[np.int64]:
        """Leaves of a table in the order of its rows; with `wanted` only those that may hold these rows (sorted)."""
        if not 1 <= root < len(self.seen) or self.seen[root]:
            self.suspects.append(0)
            return np.empty(0, np.int64)
        rows = np.empty(0, np.int64) if wanted is None else wanted
        leaves, suspects = scan.walk(self.data, self.page, root, self.seen, rows, wanted is None)
        self.suspects += suspects.tolist()
        found: NDArray[np.int64] = leaves
        return found

    def rows(self, leaves: NDArray[np.int64], most: int = 100_000) -> list[tuple[int, list[Value]]]:
        """Row numbers and values of a small table; rows that cannot be read are left out."""
        out = []
        row, place, local, total, status = scan.locate(self.data, self.page, self.usable, leaves)
        for i in np.flatnonzero((status == scan.OK) & (total <= _MAX_CELL))[:most].tolist():
            payload = np.empty(total[i], np.uint8)
            if scan.copy_payload(
                self.data, self.page, self.usable, place[i], local[i], 0, total[i], payload, 0
            ) and (values := _values(payload, self.encoding)):  # fmt: skip
                out.append((int(row[i]), values))
        return out

    def schema(self) -> dict[str, Table]:
        """Tables and indexes by name."""
        out = {}
        for _, values in self.rows(self.leaves(1)):
            if len(values) >= 5 and isinstance(values[1], str) and isinstance(values[3], int):
                out[values[1].lower()] = Table(values[1], values[3], str(values[4]))
        return out

    def mark_free(self) -> None:
        """Mark the pages of the list of free pages as visited, so that deleted rows do not come back."""
        trunk = int.from_bytes(self.data[32:36].tobytes(), "big")
        while 1 <= trunk < len(self.seen) and not self.seen[trunk]:
            self.seen[trunk] = 1
            at = (trunk - 1) * self.page
            words = np.frombuffer(self.data[at : at + self.page - self.page % 4].tobytes(), ">u4")
            if len(words) < 2:
                return
            free = words[2 : 2 + int(words[1])]
            self.seen[free[free < len(self.seen)]] = 1
            trunk = int(words[0])


def open_image(path: Path, report: Report) -> Image:
    """Open a database.

    Parameters
    ----------
    path : Path
        The file; files called the same with ``-wal`` or ``-journal`` beside it belong to it.
    report : Report
        Takes notes and what is damaged.

    Raises
    ------
    SqliteError
        Where the file is too short or there is no room for a copy of it.
    OSError
        Where it cannot be read.
    """
    size = path.stat().st_size
    data: NDArray[np.uint8] = np.memmap(path, np.uint8, "r") if size else np.empty(0, np.uint8)
    data = _with_wal(path, data, report)
    data = _with_journal(path, data, report)
    if len(data) < 512:
        raise SqliteError(f"it has {len(data)} bytes, an SQLite file has at least 512")
    head = data[:100].tobytes()
    page = int.from_bytes(head[16:18], "big")
    page = 65_536 if page == 1 else page
    if not head.startswith(MAGIC) or page < 512 or page & (page - 1):
        report.lost(f"{path.name}: its first page is damaged; a page size of 4096 bytes was assumed")
        page = 4096
    usable = page - head[20] if page - head[20] >= 480 else page
    if head[24:28] == head[92:96]:
        stated = int.from_bytes(head[28:32], "big") * page
        if len(data) < stated:
            report.lost(f"{path.name} was cut off: {len(data)} of {stated} bytes are there")
    seen = np.zeros(-(-len(data) // page) + 1, np.uint8)
    return Image(path, _plain(data), page, usable, seen, [], _ENCODINGS.get(head[59], "utf-8"))


def _plain(data: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """The same bytes as a plain read-only array, so that the compiled walks are compiled once."""
    plain = np.frombuffer(data.data, np.uint8)
    plain.flags.writeable = False
    return plain


def _copy(path: Path, data: NDArray[np.uint8], room: int) -> IO[bytes]:
    """Copy a database to an unnamed temporary file."""
    free = shutil.disk_usage(tempfile.gettempdir()).free
    if room + _SPARE > free:
        raise SqliteError(
            f"its copy needs {room} bytes and the temporary folder {tempfile.gettempdir()} has {free}; set TMPDIR to a "
            "folder with more room"
        )
    target: IO[bytes] = tempfile.TemporaryFile(prefix="mfhca-")  # noqa: SIM115
    if len(data):
        with path.open("rb") as source:
            shutil.copyfileobj(source, target, 1 << 20)
    return target


def _mapped(file: IO[bytes]) -> NDArray[np.uint8]:
    file.flush()
    with file:
        return np.memmap(file, np.uint8, "r")


@njit(cache=True)
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
    s0, s1 = _wal_sum(log, 0, 24, little, np.int64(0), np.int64(0))
    if s0 != scan.unsigned(log, 24) or s1 != scan.unsigned(log, 28):
        return 0
    n = complete = 0
    at = 32
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


def _with_wal(path: Path, data: NDArray[np.uint8], report: Report) -> NDArray[np.uint8]:
    """Return the database as its write-ahead log leaves it."""
    wal = path.with_name(path.name + "-wal")
    if not wal.is_file() or wal.stat().st_size < 32:
        return data
    log: NDArray[np.uint8] = np.memmap(wal, np.uint8, "r")
    magic, _, page = np.frombuffer(log[:12].tobytes(), ">u4").tolist()
    if magic not in _WAL_MAGICS or page < 512 or page > 65_536 or page & (page - 1):
        report.lost(f"{wal.name} does not start as a write-ahead log; it was left out")
        return data
    complete = int(_wal_frames(_plain(log), page, magic == _WAL_MAGICS[0]))
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


def _with_journal(path: Path, data: NDArray[np.uint8], report: Report) -> NDArray[np.uint8]:
    """Return the database as it was before the transaction that a rollback journal undoes."""
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


def _values(payload: NDArray[np.uint8], encoding: str) -> list[Value]:
    """Values of one record; empty where it is damaged."""
    size, p = scan.varint(payload, 0, len(payload))
    if p < 0 or size > len(payload) or size > 4096:
        return []
    out: list[Value] = []
    body = int(size)
    while p < size:
        kind, p = scan.varint(payload, p, size)
        if p < 0 or kind < 0:
            return []
        width = (kind - 12) // 2 if kind >= 12 else (0, 1, 2, 3, 4, 6, 8, 8, 0, 0, 0, 0)[kind]
        if body + width > len(payload):
            return []
        raw: Any = payload[body : body + width].tobytes()
        if kind >= 12:
            out.append(raw.decode(encoding, "replace") if kind % 2 else raw)
        elif kind == 7:
            out.append(float(np.frombuffer(raw, ">f8")[0]))
        elif kind in (0, 10, 11):
            out.append(None)
        else:
            out.append(kind - 8 if kind > 7 else int.from_bytes(raw, "big", signed=True))
        body += width
    return out


def _column_names(sql: str) -> list[str]:
    """Column names of a CREATE TABLE statement."""
    text = re.sub(r"--[^\n]*|/\*.*?\*/", " ", sql[:65_536], flags=re.DOTALL)
    inner = text.partition("(")[2]
    parts, depth, part = [], 0, ""
    for sign in inner:
        if sign == ")" and depth == 0:
            break
        depth += (sign == "(") - (sign == ")")
        if sign == "," and depth == 0:
            parts.append(part)
            part = ""
        else:
            part += sign
    names = [re.match(r"""\s*(?:"([^"]+)"|`([^`]+)`|\[([^\]]+)\]|([^\s(]+))""", p) for p in [*parts, part]]
    found = [next(g for g in n.groups() if g is not None).lower() for n in names if n]
    return [n for n in found if n not in ("primary", "unique", "check", "foreign", "constraint")]
