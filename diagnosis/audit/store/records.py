"""One attempt at a mission as a document, and as rows of the store."""

from __future__ import annotations

import sqlite3
from collections.abc import Mapping, Sequence
from typing import NotRequired, TypedDict

from diagnosis.audit.store.outcome import READ, Outcome
from diagnosis.audit.store.summary import MissionSummary, ResultFacts
from diagnosis.results.json_text import dump_json

SCHEMA = "mfhca-audit-result/1"
_KEY = ("log_hash", "config_hash", "version")
_FROM_REPORT = (
    "machine_name", "verdict", "title", "start_ns", "duration_s", "driving_s", "decided_s", "distance_m", "open_loop", "left_out",
)  # fmt: skip
_ENDED = ("limit_option", "limit_value", "no_log")
_RESULT = (*_KEY, "state", "reason", "attempts", "machine_id", *_FROM_REPORT, "report", *_ENDED)
_ATTEMPT = ("number", "state", "reason", "wall_s", "cpu_s", "peak_mb")
_FAULT = (
    "id", "component", "kind", "side", "mode", "severity", "start_s", "stop_s", "start_ns",
    "epsilon", "epsilon_low", "epsilon_high", "sat", "sat_unit", "probability",
)  # fmt: skip
_COMPONENT = (
    "component", "side", "driving_s", "decided_s", "healthy_s", "faulty_s", "worst",
    "epsilon", "epsilon_low", "epsilon_high", "epsilon_s", "epsilon_relative",
)  # fmt: skip
_NO_REPORT: ResultFacts = {"machine_name": "", "title": "", "open_loop": 0, "left_out": 0}


class FileRecord(TypedDict):
    """What is known of a file; its SHA-256 where it was read."""

    path: str
    size: int
    stamp: str
    sha256: NotRequired[str | None]


class MissionRecord(TypedDict):
    """A mission and its files, by paths relative to the store's folder."""

    name: str
    files: list[FileRecord]
    bytes: int


class KeyRecord(TypedDict):
    """Fields of `diagnosis.audit.store.keys.Key`."""

    log_hash: str
    config_hash: str
    version: str


class AttemptRecord(TypedDict):
    """End of an attempt: fields of `diagnosis.audit.store.outcome.Outcome`, and its number."""

    number: int
    state: str
    reason: str
    wall_s: float
    cpu_s: float
    peak_mb: float
    limit_option: NotRequired[str | None]  # objects of older versions have none of these
    limit_value: NotRequired[float | None]
    no_log: NotRequired[bool]


class ResultObject(TypedDict):
    """One object of the folder ``results``: an attempt at a mission, or without ``attempt`` a mission that shares a result."""

    schema: NotRequired[str]
    mission: MissionRecord
    key: KeyRecord
    made_ns: NotRequired[int]
    attempt: NotRequired[AttemptRecord | None]
    report: NotRequired[str | None]
    machine_id: NotRequired[str]
    summary: NotRequired[MissionSummary | None]


def attempt_record(outcome: Outcome, number: int = 0) -> AttemptRecord:
    """Record of an attempt's end; texts that JSON cannot hold are made writable."""
    return {
        "number": number,
        "state": outcome.state,
        "reason": outcome.reason.encode("utf-8", "backslashreplace").decode(),
        "wall_s": outcome.wall_s,
        "cpu_s": outcome.cpu_s,
        "peak_mb": outcome.peak_mb,
        "limit_option": None if outcome.limit is None else outcome.limit[0],
        "limit_value": None if outcome.limit is None else outcome.limit[1],
        "no_log": outcome.no_log,
    }


def with_number(document: ResultObject, number: int) -> ResultObject:
    """An attempt's document with the attempt's number."""
    attempt = document["attempt"]
    assert attempt is not None
    return {**document, "attempt": {**attempt, "number": number}}


def write_document(connection: sqlite3.Connection, document: ResultObject, run: int) -> None:
    """Write a document's rows, within a transaction.

    A mission points to the document's key afterwards. Where the document holds an attempt, it becomes the result of its
    key, unless it failed and an earlier one did not.

    Parameters
    ----------
    connection : sqlite3.Connection
        With a transaction begun.
    document : ResultObject
        As `diagnosis.audit.store.objects` keeps it.
    run : int
        Number of the audit run.
    """
    mission, key = document["mission"], tuple(document["key"][k] for k in ("log_hash", "config_hash", "version"))
    attempt = document.get("attempt")
    known = connection.execute(
        f"SELECT id, state FROM result WHERE {' AND '.join(f'{k} = ?' for k in _KEY)}", key
    ).fetchone()
    identity: int | None = known["id"] if known else None
    if attempt is not None:
        if known is None or attempt["state"] in READ or known["state"] not in READ:
            identity = _write_result(connection, document, attempt, identity)
        _insert(connection, "attempt", ("result", *_ATTEMPT), [{**attempt, "result": identity}], "OR REPLACE")
        connection.execute(
            "UPDATE result SET attempts = (SELECT count(*) FROM attempt WHERE result = id) WHERE id = ?", (identity,)
        )
    if identity is None:  # a copy whose original is not there yet
        return
    write_files(connection, mission["files"])
    point(connection, mission, identity, run)


def _write_result(
    connection: sqlite3.Connection, document: ResultObject, attempt: AttemptRecord, identity: int | None
) -> int:
    summary = document.get("summary") or MissionSummary(result={}, faults=[], components=[])
    facts: ResultFacts = {**_NO_REPORT, **summary["result"]}
    row: dict[str, object] = {
        **document["key"],
        **{name: facts.get(name) for name in _FROM_REPORT},
        "state": attempt["state"],
        "reason": attempt["reason"],
        "attempts": 1,
        "machine_id": facts.get("machine_id") or document.get("machine_id", ""),
        "report": document.get("report"),
        "limit_option": attempt.get("limit_option"),
        "limit_value": attempt.get("limit_value"),
        "no_log": None if "no_log" not in attempt else int(attempt["no_log"]),
    }
    if identity is None:
        identity = connection.execute(
            f"INSERT INTO result ({', '.join(_RESULT)}) VALUES ({_marks(_RESULT)})", [row[c] for c in _RESULT]
        ).lastrowid
        assert identity is not None
    else:
        connection.execute(
            f"UPDATE result SET {', '.join(f'{c} = ?' for c in _RESULT)} WHERE id = ?",
            [*(row[c] for c in _RESULT), identity],
        )
        for table in ("fault", "component"):
            connection.execute(f"DELETE FROM {table} WHERE result = ?", (identity,))
    for table, columns, rows in (
        ("fault", _FAULT, [{"unclear": 0, **fault} for fault in summary["faults"]]),
        ("component", _COMPONENT, summary["components"]),
    ):
        _insert(connection, table, ("result", *columns), [{**r, "result": identity} for r in rows])
    return identity


def write_files(connection: sqlite3.Connection, files: Sequence[FileRecord]) -> None:
    """Write what is known of files' contents: ``path``, ``size``, ``stamp``, ``sha256``."""
    columns = ("path", "size", "stamp", "sha256")
    _insert(connection, "file", columns, [f for f in files if f.get("sha256")], "OR REPLACE")


def point(connection: sqlite3.Connection, mission: MissionRecord, result: int | None, run: int) -> None:
    """Enter a mission, or let it point to a result."""
    connection.execute(
        "INSERT INTO mission (name, files, bytes, result, seen) VALUES (?, ?, ?, ?, ?) ON CONFLICT (name) DO UPDATE SET "
        "files = excluded.files, bytes = excluded.bytes, result = excluded.result, seen = max(seen, excluded.seen), "
        "gone = NULL",
        (mission["name"], names_of(mission["files"]), mission["bytes"], result, run),
    )


def names_of(files: Sequence[FileRecord]) -> str:
    """JSON list of files' paths, as the store holds it."""
    return dump_json([f["path"] for f in files]).decode()


def _insert(
    connection: sqlite3.Connection,
    table: str,
    columns: Sequence[str],
    rows: Sequence[Mapping[str, object]],
    how: str = "",
) -> None:
    connection.executemany(
        f"INSERT {how} INTO {table} ({', '.join(columns)}) VALUES ({_marks(columns)})",
        [[row[c] for c in columns] for row in rows],
    )


def _marks(columns: Sequence[str]) -> str:
    return ", ".join("?" * len(columns))
