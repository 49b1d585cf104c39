"""Missions and results as the store holds them."""

from __future__ import annotations

import json
import sqlite3
from dataclasses import dataclass

from diagnosis.audit.store.keys import Key
from diagnosis.audit.store.outcome import MissionState, limit_in_words
from diagnosis.results.vocabulary import Verdict


@dataclass(frozen=True)
class StoredResult:
    """A row of ``result``; see ``schema.sql`` for its columns."""

    id: int
    key: Key
    state: MissionState
    reason: str
    attempts: int
    machine_id: str
    verdict: Verdict | None
    start_ns: int | None
    report: str | None
    limit: tuple[str, float] | None = None


@dataclass(frozen=True)
class StoredMission:
    """A mission and its result, if it has one.

    Attributes
    ----------
    name : str
        As in `MissionSource`.
    files : tuple[str, ...]
        Relative to the store's folder, or URLs.
    bytes : int
        Size of all files.
    seen : int
        Number of the run that saw it last.
    gone : bool
        Whether the last run that looked where it was did not find it.
    result : StoredResult or None
        None: not audited yet, or changed since.
    """

    name: str
    files: tuple[str, ...]
    bytes: int
    seen: int
    gone: bool
    result: StoredResult | None


def result_of_row(row: sqlite3.Row) -> StoredResult:
    """A row of the table ``result``."""
    return StoredResult(
        id=row["id"],
        key=Key(row["log_hash"], row["config_hash"], row["version"]),
        state=MissionState(row["state"]),
        reason=row["reason"],
        attempts=row["attempts"],
        machine_id=row["machine_id"],
        verdict=Verdict(row["verdict"]) if row["verdict"] is not None else None,
        start_ns=row["start_ns"],
        report=row["report"],
        limit=limit_of_row(row),
    )


def limit_of_row(row: sqlite3.Row) -> tuple[str, float] | None:
    """Option and value of the limit at which a mission was stopped; of a result of an earlier version those in its reason."""
    if "no_log" not in row.keys() or row["no_log"] is None:  # noqa: SIM118
        return limit_in_words(row["state"], row["reason"])
    return None if row["limit_option"] is None else (row["limit_option"], row["limit_value"])


def mission_of_row(row: sqlite3.Row) -> StoredMission:
    """A row of the table ``mission`` joined with its result; whose `id` is null where it has none."""
    result = result_of_row(row) if row["id"] is not None else None
    files = tuple(json.loads(row["files"]))
    return StoredMission(row["name"], files, row["bytes"], row["seen"], row["gone"] is not None, result)
