"""What `fleet.json` says, as the schema ``mfhca-fleet/1``; fields may be added within it, not change their meaning.

- ``schema``, ``version`` (of the tool), ``axis`` of the trends (``hours`` of driving in the audited missions, or ``days``).
- ``audit``: ``run`` (its number in this store), ``made_ns`` (when its newest result was made), each null where not known.
- ``verdict``: ``status`` (the worst machine's: ``stop``, ``watch``, ``not_assessed``, ``ready``), ``tag``, ``title``, ``text``.
- ``counts``: ``machines``, ``missions`` and how they ended by ``states``, ``not_assessed`` (read, but nothing
  could be assessed), ``unknown`` (not judged, perhaps newer than what was, and of no known machine), ``pending`` (not audited yet), ``copies`` (of a log
  that stands under another name too), ``gone`` (the log is no longer there), ``undated`` (its clock does not know the date or is more than a day ahead, or another mission
  of the machine starts at the same moment),
  ``with_faults``, ``driving_s``, ``distance_m``, ``decided`` (share of driving time that was judged), ``faults`` by status,
  ``first_ns`` and ``last_ns`` (start of the first and last dated mission).
- ``machines``, worst first: ``id``, ``name``, ``label``, ``verdict``, ``standing`` (the same in words), ``last_verdict`` and
  ``last_judged_ns`` (of its last judged mission), ``unjudged`` (missions that were not judged and may be later: such a machine is not
  ``ready``), ``cleared`` (whether its last judged mission's report lets it go out, and that of each which may be later; null: not said), ``note``, ``missions`` and ``undated`` (places in the list
  ``missions``, those with a date in its order), ``failed``, ``with_faults``, ``driving_s``, ``decided``, ``min_epsilon``, ``parts``:
  per component and side ``assessed`` (missions), ``assessed_last``, and ``modes`` (missions with each).
- ``faults``: ``machine`` (place in ``machines``), ``component``, ``kind``, ``side``, ``mode``, ``severity`` (the worst since the part was last assessed without it), ``status`` (``new``,
  ``recurring``, ``once``, ``past``), ``missions`` with it of ``assessed``, ``first`` and ``last`` (places), ``last_id``, ``epsilon``,
  ``first_run`` (audit run that brought the first mission with it; null: not known; also of missions).
- ``trends``: ``machine``, ``component``, ``kind``, ``side``, ``limit``, ``points`` as [mission, place on the axis, ε̂, low, high],
  ``now`` (end of the axis), ``outliers`` and ``changes`` (by point; ``drop``, ``rise``, ``bend``), ``first`` point of the last
  stretch, ``direction``, ``line`` of that stretch (``level`` with 95 % bounds at ``now``, ``slope`` per unit of the axis with 95 %
  bounds, ``tau``, ``centre`` and ``dof`` as in `diagnosis.audit.trends.line`) or null, ``approaching`` (rises for certain and
  likely reaches the limit within as long as the stretch has lasted), ``forecast`` from now on with its ``words``.
- ``missions``, by machine and time: ``name``, ``machine`` (place or null), ``state``, ``reason``, ``verdict``, ``title``, ``start_ns``,
  ``duration_s``, ``driving_s``, ``faults`` (of at least low severity, worst first), ``report`` (folder), ``files``, ``copy_of``, ``gone``.
- ``mark``: of the store's content when the document was begun; another mark there means that it is out of date.
- ``baseline``: null, or what changed against another audit; see `diagnosis.audit.fleet.compare`.

Lengths are in seconds and metres, ε and shares plain, times nanoseconds since 1970.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from diagnosis.audit.fleet import words
from diagnosis.audit.fleet.document_rows import bounds_json, mission_json, rounded, trend_json
from diagnosis.audit.fleet.machines import VERDICTS, FleetFault, Machine
from diagnosis.audit.fleet.news import news, since_run
from diagnosis.audit.fleet.read import Mission
from diagnosis.audit.fleet.trends import Axis, PartTrend, trends_of
from diagnosis.audit.store.outcome import READ, STATES
from diagnosis.results.result import SEVERITIES
from replay.version import __version__

SCHEMA = "mfhca-fleet/1"
_STATUSES = ("new", "recurring", "once", "past")


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
    first_runs : Mapping[str, int]
        Run in which each mission was first judged, as far as that is known.
    """

    machines: tuple[Machine, ...]
    trends: tuple[tuple[PartTrend, ...], ...]
    missions: tuple[Mission, ...]
    axis: Axis
    unknown: tuple[Mission, ...] = ()
    run: int = 0
    made_ns: int | None = None
    first_runs: Mapping[str, int] = field(default_factory=dict)


def fleet_of(
    machines: Sequence[Machine], missions: Sequence[Mission], axis: Axis = "hours", unknown: Sequence[Mission] = ()
) -> Fleet:
    """Order machines worst first: by verdict, then by how soon a limit comes near, then by missions with faults."""
    found = [(m, tuple(trends_of(m, axis))) for m in machines]

    def rank(pair: tuple[Machine, tuple[PartTrend, ...]]) -> tuple[Any, ...]:
        m, trends = pair
        soon = min((t.trend.forecast.likely or 0.0 for t in trends if t.approaching), default=np.inf)
        worst = max((SEVERITIES.index(f.severity) for f in m.faults if f.standing), default=-1)
        return VERDICTS.index(m.verdict), -worst, soon, -m.with_faults, m.label

    found.sort(key=rank)
    place = {(m.id, "" if m.id else m.name): k for k, (m, _) in enumerate(found)}

    def order(m: Mission) -> tuple[Any, ...]:
        r = m.result
        if r is None:
            return len(found) + 1, 0, 0, m.name
        k = place.get((r.machine_id, "" if r.machine_id else r.machine_name), len(found))
        return k, r.start_ns is None, r.start_ns or 0, m.name

    ordered = tuple(sorted(missions, key=order))
    return Fleet(tuple(m for m, _ in found), tuple(t for _, t in found), ordered, axis, tuple(unknown))


def fleet_document(fleet: Fleet, baseline: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """The document of a fleet; the same fleet gives the same document."""
    owner = {r.result.id: k for k, m in enumerate(fleet.machines) for r in m.runs}
    failed = {f.name: k for k, m in enumerate(fleet.machines) for f in m.failed}
    first: dict[int, str] = {}
    for mission in sorted(fleet.missions, key=lambda m: m.name):
        if mission.result is not None:
            first.setdefault(mission.result.id, mission.name)
    at = {mission.name: k for k, mission in enumerate(fleet.missions)}
    status, tag, title = words.headline(fleet.machines, len(fleet.unknown))
    counts = _counts(fleet, first)
    unread = sum(m.result is not None and m.result.state not in READ for m in fleet.missions)
    return {
        "schema": SCHEMA,
        "version": __version__,
        "axis": fleet.axis,
        "audit": {"run": fleet.run or None, "made_ns": fleet.made_ns},
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
            ),
        },
        "counts": counts,
        "machines": [_machine(m, at) for m in fleet.machines],
        "faults": [
            _fault(k, f, at, since_run(m, f, fleet.first_runs)) for k, m in enumerate(fleet.machines) for f in m.faults
        ],
        "trends": [trend_json(k, t, at, fleet.axis) for k, own in enumerate(fleet.trends) for t in own],
        "missions": [
            mission_json(
                m,
                failed.get(m.name, owner.get(m.result.id if m.result is not None else -1)),
                first,
                fleet.first_runs.get(m.name),
            )
            for m in fleet.missions
        ],
        "baseline": baseline,
    }


def _counts(fleet: Fleet, first: Mapping[int, str]) -> dict[str, Any]:
    results = [m.result for m in fleet.missions if m.result is not None]
    states = Counter(r.state for r in results)
    runs = [r for m in fleet.machines for r in m.runs]
    starts = [r.result.start_ns for r in runs if r.result.start_ns is not None]
    parts = [p for r in runs for p in r.result.parts]
    driving = sum(p.driving_s for p in parts)
    faults = Counter(str(f.status) for m in fleet.machines for f in m.faults)
    return {
        "machines": len(fleet.machines),
        "missions": len(fleet.missions),
        "states": {s: states[s] for s in STATES},
        "not_assessed": sum(r.verdict == "not_assessed" for r in results),
        "unknown": len(fleet.unknown),
        "pending": len(fleet.missions) - len(results),
        "copies": len(results) - len(first),
        "gone": sum(m.gone for m in fleet.missions),
        "undated": sum(len(m.undated) for m in fleet.machines),
        "with_faults": sum(bool(r.faults) for r in runs),
        "driving_s": rounded(sum(r.result.driving_s or 0.0 for r in runs)),
        "distance_m": rounded(sum(r.result.distance_m or 0.0 for r in runs)),
        "decided": rounded(sum(p.decided_s for p in parts) / driving) if driving > 0 else None,
        "faults": {s: faults[s] for s in _STATUSES},
        "first_ns": min(starts, default=None),
        "last_ns": max(starts, default=None),
    }


def _machine(m: Machine, at: Mapping[str, int]) -> dict[str, Any]:
    return {
        "id": m.id,
        "name": m.name,
        "label": m.label,
        "verdict": m.verdict,
        "standing": words.standing(m),
        "last_verdict": m.last_verdict,
        "last_judged_ns": m.last_judged.result.start_ns if m.last_judged else None,
        "cleared": m.cleared,
        "unjudged": m.unjudged,
        "note": m.note,
        "missions": [at[r.name] for r in m.dated],
        "undated": [at[r.name] for r in m.undated],
        "failed": [at[f.name] for f in m.failed],
        "with_faults": m.with_faults,
        "driving_s": rounded(m.driving_s),
        "decided": rounded(m.decided),
        "min_epsilon": m.limits.min_epsilon,
        "parts": [_part(m, *key) for key in m.parts],
    }


def _part(m: Machine, component: str, side: str) -> dict[str, Any]:
    assessed = [r.assessed(component, side, m.limits) for r in m.runs]
    modes: Counter[str] = Counter()
    for run in m.runs:
        modes.update(
            {f.mode for f in run.faults if f.component == component and f.side in (side, "sensor_or_actuator")}
        )
    return {
        "component": component,
        "side": side,
        "kind": m.kind(component),
        "assessed": sum(assessed),
        "assessed_last": assessed[len(m.dated) - 1] if m.dated else None,
        "modes": dict(sorted(modes.items())),
    }


def _fault(k: int, f: FleetFault, at: Mapping[str, int], first_run: int | None) -> dict[str, Any]:
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
        "epsilon": bounds_json(f.epsilon),
    }
