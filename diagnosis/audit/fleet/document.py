"""The document of a fleet, `fleet.json`, from its machines and missions; its fields stand in `fleet_types`."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from diagnosis.audit.fleet import words
from diagnosis.audit.fleet.baseline_types import BaselineRow
from diagnosis.audit.fleet.document_rows import bounds_row, mission_row, rounded, six_digits, trend_row
from diagnosis.audit.fleet.fault_types import FleetFaultRow, Status
from diagnosis.audit.fleet.fleet_fault import FleetFault
from diagnosis.audit.fleet.fleet_types import SCHEMA, CountsRow, FleetDocument, MachineRow, PartRow
from diagnosis.audit.fleet.leave import lists_of
from diagnosis.audit.fleet.machines import Machine
from diagnosis.audit.fleet.news import news, since_runs
from diagnosis.audit.fleet.read import Mission
from diagnosis.audit.fleet.runs import sides_of
from diagnosis.audit.fleet.trend_types import Axis
from diagnosis.audit.fleet.trends import PartTrend, fast_losses, trends_of, untold_losses
from diagnosis.audit.store.outcome import ENDS, READ
from diagnosis.results.candidates import UNCLEAR
from diagnosis.results.vocabulary import Leave, Verdict
from replay.version import __version__

_STATUSES: tuple[Status, ...] = ("new", "recurring", "once", "past", "repaired")


@dataclass(frozen=True)
class Fleet:
    """Machines worst first with their trends, and all missions by machine and time.

    Attributes
    ----------
    unknown : tuple[Mission, ...]
        Logs that were not judged, whose machine is not known and that may be later than what was judged.
    run : int
        Number of the audit run; 0: not known.
    made_ns : int or None
        When its newest result was made.
    notes : tuple[str, ...]
        What that run noted of the files it was given.
    first_runs : Mapping[str, int]
        Run in which each mission was first judged, as far as that is known.
    copies : Mapping[str, str]
        Missions that are copies of another machine's, and the name of that one's: they count for no machine.
    """

    machines: tuple[Machine, ...]
    trends: tuple[tuple[PartTrend, ...], ...]
    missions: tuple[Mission, ...]
    axis: Axis
    unknown: tuple[Mission, ...] = ()
    run: int = 0
    made_ns: int | None = None
    notes: tuple[str, ...] = ()
    first_runs: Mapping[str, int] = field(default_factory=dict)
    copies: Mapping[str, str] = field(default_factory=dict)


def fleet_of(
    machines: Sequence[Machine], missions: Sequence[Mission], axis: Axis = "hours", unknown: Sequence[Mission] = ()
) -> Fleet:
    """Order machines worst first: by verdict, then by how soon a limit comes near, then by missions with faults."""
    found = [(m, tuple(trends_of(m, axis))) for m in machines]

    def rank(pair: tuple[Machine, tuple[PartTrend, ...]]) -> tuple[int, int, bool, float, int, str]:
        m, trends = pair
        soon = min((t.trend.forecast.likely or 0.0 for t in trends if t.approaching), default=np.inf)
        worst = max((f.severity.rank for f in m.faults if f.standing), default=-1)
        return -m.verdict.rank, -worst, not _lost(m, trends), soon, -m.with_faults, m.label

    found.sort(key=rank)
    place = {(m.id, "" if m.id else m.name): k for k, (m, _) in enumerate(found)}

    def order(m: Mission) -> tuple[int, bool, int, str]:
        r = m.result
        if r is None:
            return len(found) + 1, False, 0, m.name
        k = place.get((r.machine_id, "" if r.machine_id else r.machine_name), len(found))
        return k, r.start_ns is None, r.start_ns or 0, m.name

    ordered = tuple(sorted(missions, key=order))
    return Fleet(tuple(m for m, _ in found), tuple(t for _, t in found), ordered, axis, tuple(unknown))


def _lost(m: Machine, trends: Sequence[PartTrend]) -> bool:
    """Whether a loss gives a machine no leave whatever its reports say: beyond its limit unsaid, or growing towards a half."""
    return bool(untold_losses(m, trends) or fast_losses(m, trends))


def fleet_document(fleet: Fleet, baseline: BaselineRow | None = None) -> FleetDocument:
    """The document of a fleet; the same fleet gives the same document."""
    owner = {r.result.id: k for k, m in enumerate(fleet.machines) for r in m.runs}
    failed = {f.name: k for k, m in enumerate(fleet.machines) for f in m.failed}
    first: dict[int, str] = {}
    for mission in sorted(fleet.missions, key=lambda m: m.name):
        if mission.result is not None:
            first.setdefault(mission.result.id, mission.name)
    results = {m.name: m.result.id if m.result is not None else -1 for m in fleet.missions}
    at = {mission.name: k for k, mission in enumerate(fleet.missions)}
    judged = {result for m in fleet.machines for result in m.judged_all()}
    fast = [fast_losses(m, own) for m, own in zip(fleet.machines, fleet.trends, strict=True)]
    lost = [_lost(m, own) for m, own in zip(fleet.machines, fleet.trends, strict=True)]
    status, tag, title = words.headline(fleet.machines, len(fleet.unknown), lost)
    counts = _counts(fleet, first)
    unread = sum(m.result is not None and m.result.state not in READ for m in fleet.missions)
    document: FleetDocument = {
        "schema": SCHEMA,
        "version": __version__,
        "axis": fleet.axis,
        "audit": {"run": fleet.run or None, "made_ns": fleet.made_ns, "notes": list(fleet.notes)},
        "verdict": {
            "status": status,
            "tag": tag,
            "title": title,
            "text": words.new_words(*news(fleet.machines, fleet.first_runs, fleet.run))
            + words.sentences(
                fleet.machines,
                fleet.trends,
                (unread, counts["not_assessed"], counts["pending"]),
                fleet.axis,
                len(fleet.unknown),
            )
            + [words.as_sentence(note) for note in fleet.notes],
        },
        "counts": counts,
        "machines": [_machine(m, at) for m in fleet.machines],
        "faults": [
            _fault(k, f, at, first_run)
            for k, m in enumerate(fleet.machines)
            for f, first_run in zip(m.faults, since_runs(m, fleet.first_runs), strict=True)
        ],
        "trends": [
            trend_row(k, t, at, fleet.axis, halving=(t.component, t.side) in fast[k])
            for k, own in enumerate(fleet.trends)
            for t in own
        ],
        "missions": [
            mission_row(
                m,
                failed.get(m.name, owner.get(results[fleet.copies.get(m.name, m.name)])),
                fleet.copies.get(m.name, first.get(results[m.name])),
                fleet.first_runs.get(m.name),
                judged=results[fleet.copies.get(m.name, m.name)] in judged,
            )
            for m in fleet.missions
        ],
        "baseline": baseline,
    }
    for left in lists_of(document):  # what of earlier missions is open counts too
        machine = document["machines"][left.machine]
        machine["leave"], machine["cleared"] = left.leave, left.leave is Leave.MAY
    return document


def _counts(fleet: Fleet, first: Mapping[int, str]) -> CountsRow:
    results = [m.result for m in fleet.missions if m.result is not None]
    states = Counter(r.state for r in results)
    runs = [r for m in fleet.machines for r in m.runs]
    starts = [r.result.start_ns for r in runs if r.result.start_ns is not None]
    judged = [m.judged_s for m in fleet.machines]
    driving = sum(of[0] for of in judged)
    faults = Counter(str(f.status) for m in fleet.machines for f in m.faults)
    return {
        "machines": len(fleet.machines),
        "missions": len(fleet.missions),
        "counted": len(runs),
        "states": {s.value: states[s] for s in ENDS},
        "not_assessed": sum(
            m.result is not None
            and m.result.verdict is Verdict.NOT_ASSESSED
            and m.name == fleet.copies.get(m.name, first[m.result.id])
            for m in fleet.missions
        ),
        "unknown": len(fleet.unknown),
        "pending": len(fleet.missions) - len(results),
        "copies": len(results) - len(first) + len(fleet.copies),
        "gone": sum(m.gone for m in fleet.missions),
        "undated": sum(len(m.undated) for m in fleet.machines),
        "with_faults": sum(bool(r.faults) for r in runs),
        "driving_s": six_digits(sum(r.result.driving_s or 0.0 for r in runs)),
        "distance_m": six_digits(sum(r.result.distance_m or 0.0 for r in runs)),
        "decided": rounded(sum(of[1] for of in judged) / driving) if driving > 0 else None,
        "faults": {s: faults[s] for s in _STATUSES},
        "first_ns": min(starts, default=None),
        "last_ns": max(starts, default=None),
    }


def _machine(m: Machine, at: Mapping[str, int]) -> MachineRow:
    return {
        "id": m.id,
        "name": m.name,
        "label": m.label,
        "verdict": m.verdict,
        "standing": words.standing(m),
        "last_verdict": m.last_verdict,
        "last_judged_ns": m.last_judged.result.start_ns if m.last_judged else None,
        "last_cleared": m.cleared,
        "not_cleared": m.not_cleared,
        "open_points": list(m.limits.open_points),
        "suspicions": [
            {"text": s.text, "mission": at[s.run.name], "again": s.again} for s in m.suspicions if s.run.name in at
        ],
        "outdated": m.outdated,
        "unjudged": m.unjudged,
        "note": m.note,
        "missions": [at[r.name] for r in m.dated],
        "undated": [at[r.name] for r in m.undated],
        "failed": [at[f.name] for f in m.failed],
        "with_faults": m.with_faults,
        "driving_s": six_digits(m.driving_s),
        "decided": rounded(m.decided),
        "min_epsilon": m.limits.min_epsilon,
        "parts": _parts(m),
        "words": m.limits.words.row(),
    }


def _parts(m: Machine) -> list[PartRow]:
    modes: dict[tuple[str, str], Counter[str]] = {key: Counter() for key in m.parts}
    for run in m.runs:
        found = {(f.component, s, UNCLEAR if f.unclear else f.mode) for f in run.faults for s in sides_of(f.side)}
        for component, side, mode in found:
            modes[component, side][mode] += 1
    return [_part(m, *key, modes[key]) for key in m.parts]


def _part(m: Machine, component: str, side: str, modes: Counter[str]) -> PartRow:
    assessed = m.assessed(component, side)
    return {
        "component": component,
        "side": side,
        "kind": m.kind(component),
        "assessed": sum(assessed),
        "assessed_last": assessed[len(m.dated) - 1] if m.dated else None,
        "modes": dict(sorted(modes.items())),
    }


def _fault(k: int, f: FleetFault, at: Mapping[str, int], first_run: int | None) -> FleetFaultRow:
    return {
        "machine": k,
        "component": f.component,
        "kind": f.kind,
        "side": f.side,
        "mode": f.mode,
        "severity": f.severity,
        "status": f.status,
        "missions": f.missions,
        "assessed": f.assessed,
        "first": at[f.first.name],
        "last": at[f.last.name],
        "last_id": f.last_id,
        "since": f.since,
        "first_run": first_run,
        "epsilon": bounds_row(f.epsilon),
        "open": f.open,
        "needed": f.needed,
        "clean": f.clean,
        "repaired_ns": f.repaired_ns,
        "unclear": f.unclear,
    }
