"""Which name each discovered mission has in the store, and which known missions are gone."""

from __future__ import annotations

import hashlib
import json
import os
import sqlite3
from collections.abc import Sequence

from diagnosis.audit.discovery.mission_source import MissionSource
from diagnosis.audit.store.records import FileRecord, names_of, point

Given = Sequence[tuple[MissionSource, list[FileRecord]]]


def adopt(connection: sqlite3.Connection, given: Given, roots: Sequence[str], run: int, folder: str) -> list[str]:
    """Enter missions within a transaction; see `diagnosis.audit.store.store.Store.adopt`.

    Parameters
    ----------
    connection : sqlite3.Connection
        With a transaction begun.
    given : Sequence
        Missions and their files as the store holds them.
    roots : Sequence[str]
        Places that were looked through, as the store holds paths.
    run : int
        Number of the audit run.
    folder : str
        The store's folder.

    Returns
    -------
    list[str]
        Name of each mission.
    """
    rows = connection.execute("SELECT name, files, result FROM mission").fetchall()
    owner = {json.loads(row["files"])[0]: row for row in rows}
    taken = {row["name"].casefold() for row in rows}
    known = {row["path"]: (row["size"], row["stamp"]) for row in connection.execute("SELECT * FROM file")}
    names = []
    for mission, files in given:
        row = owner.get(files[0]["path"])
        result = None
        if row is not None:
            name = row["name"]
            unchanged = all(known.get(f["path"]) == (f["size"], f["stamp"]) for f in files)
            result = row["result"] if unchanged and row["files"] == names_of(files) else None
        else:
            name = _free_name(mission.name, files[0]["path"], taken)
            taken.add(name.casefold())
        names.append(name)
        point(connection, {"name": name, "files": files, "bytes": mission.bytes}, result, run)
    here = set(names)
    gone = [row["name"] for row in rows if row["name"] not in here and _below(json.loads(row["files"]), roots, folder)]
    marked = [(run, name) for name in gone]
    connection.executemany("UPDATE mission SET gone = ? WHERE name = ? AND gone IS NULL", marked)
    return names


def _free_name(name: str, path: str, taken: set[str]) -> str:
    """The name, or where another mission has it, with a mark of the file's path behind it."""
    digest, size = hashlib.sha256(path.encode()).hexdigest(), 0
    free = name
    while free.casefold() in taken:
        size += 6
        free = f"{name}-{digest[:size]}"
    return free


def _below(files: Sequence[str], roots: Sequence[str], folder: str) -> bool:
    """Whether the first of some files lies at or below one of the roots."""
    first = _absolute(files[0], folder)
    return any(first == (root := _absolute(r, folder)) or first.startswith(root.rstrip("/") + "/") for r in roots)


def _absolute(path: str, folder: str) -> str:
    return path if "://" in path else os.path.normpath(os.path.join(folder, path)).replace(os.sep, "/")  # noqa: PTH118
