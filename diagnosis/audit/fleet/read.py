"""The audit store as plain values: every mission with its result, faults and parts, in four queries."""

from __future__ import annotations

import hashlib
import json
import math
import os
import sqlite3
from collections import defaultdict
from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import orjson

from diagnosis.audit.fleet.parts import LARGEST, LONGEST, NO_PARTS, Parts, read_parts
from diagnosis.audit.store.database import Database
from diagnosis.audit.store.outcome import MissionState
from diagnosis.audit.store.reason_template import ReasonTemplate, reason_template, whole_path
from diagnosis.audit.store.repairs import Repair, read_repairs
from diagnosis.audit.store.store import FILE_NAME
from diagnosis.results.ending import lasts
from diagnosis.results.vocabulary import Severity, Verdict
from replay.faults import Side
from replay.unused_files import NO_LOG

CALENDAR_NS = 946_684_800 * 10**9  # a clock that says a time before 2000 does not know the date


class Bounds(NamedTuple):
    """ε̂ with 95 % bounds [1]."""

    value: float
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class FoundFault:
    """One fault of one mission; see the table ``fault``. `lasting`: to the end of its log."""

    id: str
    component: str
    kind: str
    side: str
    mode: str
    severity: Severity
    seconds: float
    epsilon: Bounds | None
    probability: float
    unclear: bool = False
    lasting: bool = False


@dataclass(frozen=True, slots=True)
class Result:
    """What became of one log; see the table ``result``.

    `left_out`: the log lacks nothing but whole files that were left out. `no_log`: it is a table that is no machine's
    log, so that nothing of a machine is missing with it. `start_ns` is None where the log's clock does not know the date. `order` is its place in the store.
    """

    id: int
    state: MissionState
    reason: str
    attempts: int
    machine_id: str
    machine_name: str
    verdict: Verdict | None
    title: str
    start_ns: int | None
    duration_s: float | None
    driving_s: float | None
    distance_m: float | None
    open_loop: bool
    left_out: bool
    no_log: bool
    report: str | None
    version: str
    log_hash: str
    config_hash: str
    faults: tuple[FoundFault, ...]
    parts: Parts

    @property
    def judged(self) -> bool:
        """Whether there is a report."""
        return self.verdict is not None


@dataclass(frozen=True, slots=True)
class Mission:
    """A mission as found; `result` is None where it is not audited yet. Copies share one; `gone`: the log is no longer there."""

    name: str
    files: tuple[str, ...]
    bytes: int
    result: Result | None
    gone: bool


_COLUMNS = (
    "id", "state", "reason", "attempts", "machine_id", "machine_name", "verdict", "title", "start_ns", "duration_s", "driving_s",
    "distance_m", "open_loop", "left_out", "no_log", "report", "version", "log_hash", "config_hash",
)  # fmt: skip
_RESULTS = "SELECT {} FROM result WHERE id IN (SELECT result FROM mission) ORDER BY id"
_FAULTS = (
    "SELECT result, id, component, kind, side, mode, severity, stop_s - start_s, epsilon, epsilon_low, epsilon_high, "
    "probability, {}, stop_s, (SELECT duration_s FROM result WHERE result.id = fault.result) FROM fault ORDER BY result, start_ns, length(id), id"
)
_STATES = {state.value: state for state in MissionState}
_VERDICTS: dict[str | None, Verdict | None] = {None: None, **{verdict.value: verdict for verdict in Verdict}}
_MISSIONS = "SELECT name, files, bytes, result, gone IS NOT NULL FROM mission ORDER BY name"
_NOTES = "SELECT value FROM meta WHERE name = 'notes'"
_CONTENT = (
    _NOTES,
    "SELECT id, attempts, state, reason, machine_id, verdict, report FROM result ORDER BY id",
    _MISSIONS,
)


def read_missions(store: Path) -> list[Mission]:
    """Every mission of a store, by name.

    Parameters
    ----------
    store : Path
        ``fleet.sqlite`` of an audit, or the folder that holds it.

    Raises
    ------
    OutputError
        Where there is no store, it is damaged, or of another kind or version.
    """
    with closing(_opened(store)) as db, db.snapshot(), db.decoding():
        faults: dict[int, list[FoundFault]] = defaultdict(list)
        for row in db.rows(_FAULTS.format("unclear" if db.has_column("fault", "unclear") else "0")):
            r, name, component, kind, side, mode, severity, seconds, e, low, high, p, unclear, *end = _plausible(row)
            found = FoundFault(
                name,
                component,
                kind,
                Side(side),
                mode,
                Severity(severity),
                seconds,
                _bounds(e, low, high),
                p,
                bool(unclear),
                end[1] is not None and lasts(*end),
            )
            faults[r].append(found)
        parts = read_parts(db)
        later = {"left_out": "0", "no_log": "NULL"}  # a store that is only read may be of an earlier version
        lacking = {name: value for name, value in later.items() if not db.has_column("result", name)}
        columns = ", ".join(lacking.get(name, name) for name in _COLUMNS)
        results = {
            row[0]: _result(row, tuple(faults.get(row[0], ())), parts.get(row[0], NO_PARTS))
            for row in db.rows(_RESULTS.format(columns))
        }
        missions = [
            Mission(name, _files(files), size, results.get(r), bool(gone))
            for name, files, size, r, gone in db.rows(_MISSIONS)
        ]
    return _with_own_reasons(missions, os.path.realpath(store if store.is_dir() else store.parent))


def _with_own_reasons(missions: Sequence[Mission], folder: str) -> list[Mission]:
    """Missions whose results' reasons name their own files, also where a copy was diagnosed in their place."""
    sharing: dict[int, list[Sequence[str]]] = defaultdict(list)
    for one in missions:
        if one.result is not None and one.result.reason:
            sharing[one.result.id].append(one.files)
    reasons: dict[int, ReasonTemplate] = {}
    out = []
    for one in missions:
        if one.result is not None and len(theirs := sharing[one.result.id]) > 1:
            if one.result.id not in reasons:
                reasons[one.result.id] = reason_template(one.result.reason, theirs, folder)
            reason = reasons[one.result.id].for_files([whole_path(folder, file) for file in one.files])
            one = replace(one, result=replace(one.result, reason=reason))
        out.append(one)
    return out


def read_run(store: Path) -> int:
    """Number of the last audit run of a store; 0 where there was none.

    Raises
    ------
    OutputError
        As `read_missions`.
    """
    with closing(_opened(store)) as db:
        rows = db.rows("SELECT value FROM meta WHERE name = 'run'")
        with db.decoding():
            return int(rows[0][0]) if rows else 0


def read_notes(store: Path) -> tuple[str, ...]:
    """What the last audit run of a store noted of the files it was given: what it could not look into, and whose machine file is missing.

    Raises
    ------
    OutputError
        As `read_missions`.
    """
    with closing(_opened(store)) as db, db.decoding():
        rows = db.rows(_NOTES)
        return tuple(map(str, json.loads(rows[0][0]))) if rows else ()


def fleet_repairs(store: Path) -> list[Repair]:
    """Repairs that were recorded in a store.

    Raises
    ------
    OutputError
        As `read_missions`.
    """
    with closing(_opened(store)) as db, db.decoding():
        return read_repairs(db)


def content_mark(store: Path) -> str:
    """What changes with the missions, results and repairs of a store, and not with runs that bring nothing.

    Raises
    ------
    OutputError
        As `read_missions`.
    """
    digest = hashlib.sha256()
    with closing(_opened(store)) as db, db.snapshot():
        for query in _CONTENT:
            for rows in db.blocks(query, 1 << 12):
                digest.update("".join(map(repr, rows)).encode("utf-8", "backslashreplace"))
        for repair in read_repairs(db):
            digest.update(repr(repair).encode("utf-8", "backslashreplace"))
    return digest.hexdigest()[:16]


def _opened(store: Path) -> Database:
    return Database(store / FILE_NAME if store.is_dir() else store, read_only=True)


def _result(row: sqlite3.Row, faults: tuple[FoundFault, ...], parts: Parts) -> Result:
    values = dict(zip(_COLUMNS, _plausible(row), strict=True))
    start = values["start_ns"]
    values["start_ns"] = start if start is not None and start >= CALENDAR_NS else None
    values["state"] = _STATES[values["state"]]
    values["verdict"] = _VERDICTS[values["verdict"]]
    values["open_loop"], values["left_out"] = bool(values["open_loop"]), bool(values["left_out"])
    if values["no_log"] is None:  # an earlier version says it in the reason alone
        values["no_log"] = values["state"] is MissionState.UNREADABLE and f": {NO_LOG}" in values["reason"]
    values["no_log"] = bool(values["no_log"])
    return Result(**values, faults=faults, parts=parts)


def _files(text: str) -> tuple[str, ...]:
    """Paths of a mission's files; orjson knows no names that are no Unicode, which JSON has as escapes."""
    return tuple(map(str, json.loads(text) if "\\" in text else orjson.loads(text)))


def _plausible(row: sqlite3.Row) -> tuple[Any, ...]:
    """Values of a row; raises a `ValueError` where a real number is so large that sums and squares of it would not be."""
    values = tuple(row)
    if wrong := [v for v in values if v.__class__ is float and not abs(v) <= LONGEST]:
        raise ValueError(f"a value of {wrong[0]:g}")
    return values


def _bounds(value: float | None, low: float | None, high: float | None) -> Bounds | None:
    if value is None or low is None or high is None or not all(map(math.isfinite, (value, low, high))):
        return None
    if max(map(abs, (value, low, high))) > LARGEST:
        raise ValueError(f"a loss ε of {value:g} ({low:g} to {high:g})")
    return Bounds(value, low, high)
