"""An SQLite file as pages: opened without touching it, its write-ahead log or rollback journal taken into account."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from replay.log.reading_notes import Report
from replay.readers.common.compiled import plain
from replay.readers.rosbag2 import sqlite_kernel as scan
from replay.readers.rosbag2.sqlite_wal import SqliteError, with_journal, with_wal

MAGIC = b"SQLite format 3\0"
_MAX_CELL = 16 << 20
_ENCODINGS = {2: "utf-16-le", 3: "utf-16-be"}

Value = int | float | str | bytes | None


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
        """Leaves of a table in the order of its rows; with `wanted` only those that may hold these rows (sorted).

        Page numbers, shape (k,).
        """
        if not 1 <= root < len(self.seen) or self.seen[root]:
            self.suspects.append(0)
            return np.empty(0, np.int64)
        rows = np.empty(0, np.int64) if wanted is None else wanted
        leaves, suspects = scan.walk(self.data, self.page, root, self.seen, rows, wanted is None)
        self.suspects += suspects.tolist()
        found: NDArray[np.int64] = leaves
        return found

    def rows(self, leaves: NDArray[np.int64], most: int = 100_000) -> list[tuple[int, list[Value]]]:
        """Row numbers and values of a small table; rows that cannot be read are left out. `leaves` of shape (k,)."""
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
            held = min(self.page, len(self.data) - at) // 4 * 4  # the file may end within the page
            words = np.frombuffer(self.data[at : at + held].tobytes(), ">u4")
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
    data = with_wal(path, data, report)
    data = with_journal(path, data, report)
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
    return Image(path, plain(data), page, usable, seen, [], _ENCODINGS.get(head[59], "utf-8"))


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
