"""Take result objects into a store: from other computers, or to make a lost store again."""

from __future__ import annotations

import re
import sqlite3
from dataclasses import dataclass

import orjson

from diagnosis.audit.discovery.safe_names import is_safe
from diagnosis.audit.store.keys import Key
from diagnosis.audit.store.objects import Objects
from diagnosis.audit.store.outcome import ENDS
from diagnosis.audit.store.records import SCHEMA, ResultObject, write_document
from diagnosis.audit.store.repairs import ingest_repairs
from diagnosis.audit.store.store import RESULTS, Store
from diagnosis.results.validation import validated
from diagnosis.results.vocabulary import Severity, Verdict
from replay.errors import MfhcaError
from replay.faults import Side

MAX_OBJECT = 64 << 20
_AT_ONCE = 200
_MISFITS = (
    sqlite3.IntegrityError, sqlite3.ProgrammingError, sqlite3.DataError, sqlite3.InterfaceError,
    KeyError, TypeError, ValueError, AttributeError, OverflowError,
)  # fmt: skip
_LINK = re.compile(r"-m[0-9a-f]{8}\.json$")
_MISSIONS = "missions/"
_VERDICTS, _SEVERITIES = {v.value for v in Verdict}, {s.value for s in Severity}
_SIDES = {s.value for s in Side}


@dataclass(frozen=True)
class Ingested:
    """What was taken over.

    Attributes
    ----------
    attempts, links : int
        Attempts that the store did not hold, and missions that share another's result.
    problems : tuple[str, ...]
        Objects that were left out, one sentence each.
    """

    attempts: int
    links: int
    problems: tuple[str, ...] = ()


def ingest(store: Store, place: str | None = None) -> Ingested:
    """Take over the attempts that a store does not hold yet, in the order in which they were made.

    Parameters
    ----------
    store : Store
        Opened for writing.
    place : str or None
        Folder or URL of the objects; None: the folder beside the store.

    Raises
    ------
    OutputError
        Where the folder cannot be listed or the store not be written.
    """
    objects = Objects(place if place is not None else str(store.folder / RESULTS))
    known = store.object_names()
    placed = {m.name for m in store.missions() if m.result is not None}
    problems: list[str] = []
    found: list[tuple[int, str, ResultObject]] = []
    for name in objects.names():
        if name in known:
            continue
        try:
            document = _checked(name, objects.read(name))
        except (OSError, ValueError, KeyError, TypeError, AttributeError, MfhcaError) as error:
            problems.append(f"{objects.place}/{name}: is not a result object of this tool ({_short(error)}); left out")
            continue
        if document.get("attempt") is not None or document["mission"]["name"] not in placed:
            found.append((document["made_ns"], name, document))
    found.sort(key=lambda f: f[:2])
    taken = {True: 0, False: 0}
    for at in range(0, len(found), _AT_ONCE):
        with store.database.transaction() as connection:
            for _, name, document in found[at : at + _AT_ONCE]:
                connection.execute("SAVEPOINT one")
                try:
                    write_document(connection, document, store.run)
                    taken[document.get("attempt") is not None] += 1
                except _MISFITS as error:
                    connection.execute("ROLLBACK TO one")
                    problems.append(f"{objects.place}/{name}: does not fit the store ({_short(error)}); left out")
                connection.execute("RELEASE one")
    problems += ingest_repairs(store, objects)
    return Ingested(taken[True], taken[False], tuple(problems))


def _checked(name: str, content: bytes) -> ResultObject:
    """Document of an object; raises where it is none, or would lead out of the audit's folder."""
    if len(content) > MAX_OBJECT:
        raise ValueError(f"{len(content)} bytes")
    document = orjson.loads(content)
    if document["schema"] != SCHEMA:
        raise ValueError(f"schema {str(document['schema'])[:40]!r}, {SCHEMA!r} expected")
    key, mission, attempt = Key(**document["key"]), document["mission"], document.get("attempt")
    if not name.startswith(f"{key.stem}-") or (attempt is None) != bool(_LINK.search(name)):
        raise ValueError("its name is not that of its key")
    if attempt is not None and name != f"{key.stem}-{attempt['number']}.json":
        raise ValueError("its name is not that of its attempt")
    if attempt is not None and attempt["state"] not in ENDS:
        raise ValueError(f"state {str(attempt['state'])[:40]!r}")
    if not is_safe(mission["name"]):
        raise ValueError("the mission's name is not safe")
    report = document.get("report")
    if report is not None and not (report.startswith(_MISSIONS) and is_safe(report.removeprefix(_MISSIONS))):
        raise ValueError("the report is not in the folder missions")
    summary = document.get("summary") or {}
    verdict = (summary.get("result") or {}).get("verdict")
    if verdict is not None and verdict not in _VERDICTS:
        raise ValueError(f"verdict {str(verdict)[:40]!r}")
    if any(fault["severity"] not in _SEVERITIES for fault in summary.get("faults") or ()):
        raise ValueError("a fault's severity is not known")
    if any(row["side"] not in _SIDES for name in ("faults", "components") for row in summary.get(name) or ()):
        raise ValueError("the side of a fault or component is not known")
    if not isinstance(document["made_ns"], int) or not isinstance(mission["files"], list) or not mission["files"]:
        raise ValueError("files or time of making are missing")
    return validated(document, ResultObject, "content", "nothing of it was taken")


def _short(error: Exception) -> str:
    text = str(error) if isinstance(error, MfhcaError) else f"{type(error).__name__}: {error}"
    return text[:160].replace("\n", " ")
