"""Repairs that were recorded: a fact of the store each, with an object beside the results, so that a lost store keeps them."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypedDict

import orjson

from diagnosis.audit.store.database import Database
from diagnosis.audit.store.objects import REPAIR, Objects, encode
from diagnosis.audit.store.store import RESULTS, Store
from diagnosis.results.validation import validated
from replay.errors import MfhcaError
from replay.faults import Side

SCHEMA = "mfhca-audit-repair/1"
_SIDES = ("", Side.SENSOR.value, Side.ACTUATOR.value)
_COLUMNS = ("machine_id", "machine_name", "component", "side", "repaired_ns", "withdrawn", "noted_ns")
_MOST_NS = 2**63 - 1


class RepairObject(TypedDict):
    """One object ``repair-….json`` of the folder ``results``; see the table ``repair``."""

    schema: str
    machine_id: str
    machine_name: str
    component: str
    side: str
    repaired_ns: int
    withdrawn: int
    noted_ns: int


@dataclass(frozen=True)
class Repair:
    """A part that was repaired.

    Attributes
    ----------
    machine : tuple[str, str]
        Identity of the machine, and where that is empty its name.
    component, side : str
        The part; an empty side means both.
    repaired_ns : int
        From when on the part counts as another one [ns since 1970].
    """

    machine: tuple[str, str]
    component: str
    side: str
    repaired_ns: int


def record_repair(store: Store, repair: Repair, *, withdrawn: bool = False) -> None:
    """Keep a repair, or that it was recorded by mistake; when this returns, it stands on the disk.

    Raises
    ------
    OutputError
        Where it cannot be written; nothing of it counts then.
    """
    document: RepairObject = {
        "schema": SCHEMA,
        "machine_id": repair.machine[0],
        "machine_name": repair.machine[1],
        "component": repair.component,
        "side": repair.side,
        "repaired_ns": repair.repaired_ns,
        "withdrawn": int(withdrawn),
        "noted_ns": time.time_ns(),
    }
    content = encode(dict(document))
    name = f"repair-{hashlib.sha256(content).hexdigest()[:16]}.json"
    Objects(str(store.folder / RESULTS)).put(name, content)
    _write(store, document)


def ingest_repairs(store: Store, objects: Objects) -> list[str]:
    """Take over recorded repairs that the store does not hold; gives what was left out, one sentence each."""
    problems = []
    query = f"SELECT 1 FROM repair WHERE {' AND '.join(f'{c} = ?' for c in _COLUMNS)}"
    for name in objects.names(REPAIR):
        try:
            document: RepairObject = orjson.loads(objects.read(name))
            if document["schema"] != SCHEMA or document["side"] not in _SIDES:
                raise ValueError("schema or side is not known")
            validated(document, RepairObject, "content", "nothing of it was taken")
            if not 0 <= document["repaired_ns"] <= _MOST_NS or not 0 <= document["noted_ns"] <= _MOST_NS:
                raise ValueError("its date is beyond what a store holds")
        except (OSError, ValueError, KeyError, TypeError, AttributeError, MfhcaError) as error:
            text = f"{type(error).__name__}: {error}"[:160].replace("\n", " ")
            problems.append(f"{objects.place}/{name}: is not a repair that this tool recorded ({text}); left out")
            continue
        if not store.database.rows(query, tuple(document[c] for c in _COLUMNS)):  # type: ignore[literal-required]
            _write(store, document)
    return problems


def read_repairs(database: Database) -> list[Repair]:
    """Repairs of a store that were not withdrawn, in the order of their dates; none where the store is of an earlier version.

    Raises
    ------
    OutputError
        Where the store cannot be read.
    """
    if not database.has_table("repair"):
        return []
    rows = database.rows(f"SELECT {', '.join(_COLUMNS)} FROM repair ORDER BY noted_ns, withdrawn")
    last: dict[Repair, bool] = {}
    for machine_id, name, component, side, repaired, withdrawn, _ in rows:
        last[Repair((machine_id, name), component, side, repaired)] = bool(withdrawn)
    return sorted((r for r, gone in last.items() if not gone), key=lambda r: r.repaired_ns)


def repaired_at(repairs: Sequence[Repair], component: str, side: str) -> int | None:
    """When a part was repaired last; what may be of either side is repaired once both sides were.

    Parameters
    ----------
    repairs : Sequence[Repair]
        Of one machine.
    component, side : str
        Of a fault.
    """
    own = [r for r in repairs if r.component == component]
    last = []
    for one in Side(side).sides:
        found = [r.repaired_ns for r in own if r.side in ("", one)]
        if not found:
            return None
        last.append(max(found))
    return min(last)


def _write(store: Store, document: RepairObject) -> None:
    with store.database.transaction() as connection:
        connection.execute(
            f"INSERT OR IGNORE INTO repair ({', '.join(_COLUMNS)}) VALUES ({', '.join('?' * len(_COLUMNS))})",
            tuple(document[c] for c in _COLUMNS),  # type: ignore[literal-required]
        )
