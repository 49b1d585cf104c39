"""What the last audit run brought: the run in which each mission was first judged, kept from document to document.

The store does not hold it. The document of the run before says which missions it showed as judged; those that it did not
are of the run that writes the new one. Without such a document nothing is called new.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import orjson

from diagnosis.audit.fleet.fleet_fault import FleetFault
from diagnosis.audit.fleet.fleet_types import FleetDocument
from diagnosis.audit.fleet.machines import Machine
from diagnosis.audit.fleet.read import Mission
from diagnosis.results.vocabulary import Severity

_MOST_BYTES = 500_000_000


def first_runs(path: Path, missions: Iterable[Mission], run: int) -> dict[str, int]:
    """Run in which each judged mission was first judged; those of which that is not known are left out.

    Parameters
    ----------
    path : Path
        ``fleet.json`` of this audit's last run or of an earlier page of this one; may be absent.
    missions : Iterable[Mission]
        From `diagnosis.audit.fleet.read.read_missions`.
    run : int
        Number of this run.
    """
    judged = {m.name: m.result.start_ns for m in missions if m.result is not None and m.result.judged}
    if run < 1:
        return {}
    known = _known(path, run)
    if known is None:
        return dict.fromkeys(judged, run) if run == 1 else {}
    out = {}
    for name, start in judged.items():
        was = known.get(name)
        if was is None or was[0] != start:
            out[name] = run
        elif isinstance(was[1], int) and 0 < was[1] <= run:
            out[name] = was[1]
    return out


def _known(path: Path, run: int) -> dict[str, tuple[int | None, int | None]] | None:
    """Start and first run of the missions that an earlier document shows as judged; None where there is none."""
    try:
        if path.stat().st_size > _MOST_BYTES:
            return None
        document: FleetDocument = orjson.loads(path.read_bytes())
        if (document["audit"]["run"] or 0) > run:
            return None
        return {
            m["name"]: (m.get("start_ns"), m.get("first_run")) for m in document["missions"] if m["verdict"] is not None
        }
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return None


def since_runs(m: Machine, runs: Mapping[str, int]) -> list[int | None]:
    """Run that first brought a mission with each of a machine's faults; None where that is not known."""
    first: dict[tuple[str, str, str], int] = {}
    for r in m.runs:
        run = runs.get(r.name, 0)
        for g in r.faults:
            key = g.component, g.side, g.mode
            first[key] = min(run, first.get(key, run))
    return [first.get((f.component, f.side, f.mode), 0) or None for f in m.faults]


def _back(m: Machine, f: FleetFault, runs: Mapping[str, int]) -> int | None:
    """Run that first brought a mission with a fault after its repair; None where it was not repaired, or that is not known."""
    if f.repaired_ns is None:
        return None
    key = f.component, f.side, f.mode
    found = [
        runs.get(r.name, 0)
        for r in m.runs
        if (r.result.start_ns or 0) > f.repaired_ns and any((g.component, g.side, g.mode) == key for g in r.faults)
    ]
    return min(found, default=0) or None


def news(
    machines: Sequence[Machine], runs: Mapping[str, int], run: int
) -> tuple[int, list[tuple[Machine, FleetFault]]]:
    """Missions that the last run brought, and the faults that stand in them alone, or since a repair in them alone, severe ones first.

    Nothing where all missions are of that run, or nothing is known of earlier ones.
    """
    new = sum(runs.get(r.name) == run for m in machines for r in m.runs)
    if not new or new == sum(len(m.runs) for m in machines):
        return 0, []
    found = [
        (m, f)
        for m in machines
        for f, first in zip(m.faults, since_runs(m, runs), strict=True)
        if f.standing and (first == run or _back(m, f, runs) == run)
    ]
    return new, sorted(found, key=lambda p: -max(p[1].severity.rank, Severity.LOW.rank))
