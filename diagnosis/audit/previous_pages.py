"""The newest report of each machine says what changed since the machine's mission before it, and what the fleet knows beyond it."""

from __future__ import annotations

import time
from collections.abc import Collection, Sequence
from functools import cache
from pathlib import Path
from typing import Any, cast

from diagnosis.audit.events import Emit
from diagnosis.audit.fleet.read import CALENDAR_NS
from diagnosis.audit.fleet_notes import Known, fleet_note, known_machines
from diagnosis.audit.previous_mission import previous_report
from diagnosis.audit.store.folders import own_report
from diagnosis.audit.store.keys import Key
from diagnosis.audit.store.store import Store
from diagnosis.comparison.previous import with_previous
from diagnosis.results.document import ReportDocument
from diagnosis.results.fleet_note_row import FleetNoteRow
from replay.errors import MfhcaError, OutputError

_NEWEST = (
    "SELECT id, report, log_hash, config_hash, version FROM result WHERE machine_id = ? AND verdict IS NOT NULL "
    "AND report IS NOT NULL AND start_ns >= ? AND id IN (SELECT result FROM mission) ORDER BY start_ns DESC, id DESC LIMIT 1"
)
_MACHINES = "SELECT DISTINCT r.machine_id FROM mission m JOIN result r ON r.id = m.result WHERE m.name = ? AND r.machine_id <> ''"


def compare_newest(store: Store, names: Sequence[str], max_size_mb: float, emit: Emit) -> None:
    """Write comparison and note into the newest report of every machine that has one of the named missions.

    Parameters
    ----------
    store : Store
        Where the missions are.
    names : Sequence[str]
        Missions that this run has audited.
    max_size_mb : float
        Size that a page should keep to [MB].
    emit : Emit
        Takes the event of a report that cannot be compared; that costs nothing else.

    Raises
    ------
    OutputError
        Where the output cannot be written.
    """
    renew_newest(
        store, {row[0] for name in names for row in store.database.rows(_MACHINES, (name,))}, max_size_mb, emit
    )


def renew_newest(store: Store, machines: Collection[str], max_size_mb: float, emit: Emit) -> list[str]:
    """The same for machines by their identity; gives the folders of the reports that were written anew.

    Raises
    ------
    OutputError
        As above.
    """
    known, told = cache(lambda: known_machines(store)), list[str]()
    for machine in sorted(machines):
        for result, report, *key in store.database.rows(_NEWEST, (machine, CALENDAR_NS)):
            with own_report(store.folder, report, Key(*key)) as folder:
                try:
                    if folder is not None and _renew(store, int(result), folder, max_size_mb, known().get(machine)):
                        told.append(report)
                except OutputError:
                    raise
                except (MfhcaError, KeyError, TypeError, ValueError) as error:
                    emit("not_compared", {"report": report, "reason": str(error)})
    return told


def _renew(store: Store, result: int, folder: Path, max_size_mb: float, known: Known | None) -> bool:
    """Write comparison and note into one report, and say so, unless it has them."""
    from diagnosis.output import load_report, rebuild

    now, found = time.time_ns(), previous_report(store, result)
    kept = load_report(folder / "report.json")
    open_faults = () if known is None or found is None else known.open_faults  # they stand with the comparison
    note = None if known is None else fleet_note(known, kept, folder, Path(store.folder), now, beside=open_faults)

    def told(report: ReportDocument) -> ReportDocument:
        alone: dict[str, Any] = {k: v for k, v in report.items() if k != "fleet"}
        own = cast(ReportDocument, alone if note is None else {**alone, "fleet": note})
        return own if found is None else with_previous(own, found[1], found[0].report, open_faults, now)

    compared = _compared(kept) if found is None else (found[0].start_ns, list(open_faults))
    if (_compared(kept), _undated(kept.get("fleet"))) == (compared, _undated(note)):
        return False
    rebuild(folder, max_size_mb=max_size_mb, change=told)
    return True


def _compared(report: ReportDocument) -> tuple[int | None, list[str]]:
    """Start of the mission that a report was compared with [ns since 1970], and the open faults that it tells."""
    previous = report.get("previous")
    return (None, []) if previous is None else (previous["mission"]["start_ns"], list(previous.get("open_faults", [])))


def _undated(note: FleetNoteRow | None) -> dict[str, Any] | None:
    """A note without when it was written."""
    return None if note is None else {k: v for k, v in note.items() if k != "asof_ns"}
