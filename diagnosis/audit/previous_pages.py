"""The newest report of each machine says what changed since the machine's mission before it, and which earlier faults are open."""

from __future__ import annotations

import time
from collections.abc import Sequence
from functools import cache
from pathlib import Path

from diagnosis.audit.events import Emit
from diagnosis.audit.fleet.read import CALENDAR_NS
from diagnosis.audit.previous_mission import previous_report
from diagnosis.audit.store.folders import own_report
from diagnosis.audit.store.keys import Key
from diagnosis.audit.store.store import FILE_NAME, Store
from diagnosis.pages.labels import utc
from replay.errors import MfhcaError, OutputError

_NEWEST = (
    "SELECT id, report, log_hash, config_hash, version FROM result WHERE machine_id = ? AND verdict IS NOT NULL "
    "AND report IS NOT NULL AND start_ns >= ? AND id IN (SELECT result FROM mission) ORDER BY start_ns DESC, id DESC LIMIT 1"
)
_SEVERE = (
    "SELECT 1 FROM fault f JOIN result r ON r.id = f.result WHERE r.machine_id = ? AND f.severity = 'high' LIMIT 1"
)
_MACHINES = "SELECT DISTINCT r.machine_id FROM mission m JOIN result r ON r.id = m.result WHERE m.name = ? AND r.machine_id <> ''"


def compare_newest(store: Store, names: Sequence[str], max_size_mb: float, emit: Emit) -> None:
    """Write the comparison into the newest report of every machine that has one of the named missions.

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
    open_faults = cache(lambda: _open_faults(store))
    for machine in sorted({row[0] for name in names for row in store.database.rows(_MACHINES, (name,))}):
        for result, report, *key in store.database.rows(_NEWEST, (machine, CALENDAR_NS)):
            with own_report(store.folder, report, Key(*key)) as folder:
                try:
                    if folder is not None:
                        severe = bool(store.database.rows(_SEVERE, (machine,)))
                        _compare(
                            store, int(result), folder, max_size_mb, open_faults().get(machine, []) if severe else []
                        )
                except OutputError:
                    raise
                except (MfhcaError, KeyError, TypeError, ValueError) as error:
                    emit("not_compared", {"report": report, "reason": str(error)})


def _open_faults(store: Store) -> dict[str, list[str]]:
    """Sentences on the faults of each machine that the fleet page holds open and that its last mission did not show."""
    from diagnosis.audit.fleet.words import fault_words, open_words
    from diagnosis.audit.fleet_files import load_fleet

    return {
        m.id: [
            f"{fault_words(f, m.limits.words)}, last found in {f.last.name} ({utc(f.last.result.start_ns)[:10]}), no repair recorded"
            + open_words(f.open, f.clean, f.needed)
            for f in m.faults
            if f.open and f.since
        ]
        for m in load_fleet(Path(store.folder) / FILE_NAME).machines
        if m.id
    }


def _compare(store: Store, result: int, folder: Path, max_size_mb: float, open_faults: Sequence[str]) -> None:
    from diagnosis.output import load_report, rebuild

    found = previous_report(store, result)
    if found is None:
        return
    previous, document = found
    kept = load_report(folder / "report.json").get("previous")
    same = kept is not None and kept["mission"]["start_ns"] == previous.start_ns
    told = [] if kept is None else kept.get("open_faults", [])
    if not same or told != list(open_faults):
        rebuild(
            folder,
            max_size_mb=max_size_mb,
            previous=(Path(previous.report), document),
            open_faults=open_faults,
            asof_ns=time.time_ns(),
        )
