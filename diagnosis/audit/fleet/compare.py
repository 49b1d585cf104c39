"""An audit against an earlier one: what is new, resolved and changed, and what is no longer assessed.

Faults are matched by machine, component, side and row; a fault "of sensor or actuator" matches either. In each audit
counts what stands there: what was found in one of the last three missions that assessed the part. A fault that does not
stand any more is ``resolved`` only where a mission assessed the part after the last one with the fault; else it is
``not_seen_again``: nothing shows that it was repaired.
"""

from __future__ import annotations

from diagnosis.audit.fleet.baseline_types import BaselineRow, CoverageChangeRow
from diagnosis.audit.fleet.document import Fleet
from diagnosis.audit.fleet.document_rows import bounds_row
from diagnosis.audit.fleet.fault_types import FaultChange, FaultChangeRow, FaultStandingRow
from diagnosis.audit.fleet.fleet_fault import FleetFault
from diagnosis.audit.fleet.machines import Machine
from diagnosis.audit.fleet.parts import PartKey
from diagnosis.pages.labels import utc_moment
from replay.faults import Side

OUTCOMES: tuple[FaultChange, ...] = ("new", "worse", "better", "not_seen_again", "resolved", "unchanged")
_LEAST_EPSILON = 0.05
_MORE_OFTEN = 2.0

Identity = tuple[str, str]


def compare_fleets(older: Fleet, newer: Fleet) -> BaselineRow:
    """Compare two fleets; see the module.

    Parameters
    ----------
    older, newer : Fleet
        The earlier and the later audit.
    """
    before, now = _by_identity(older), _by_identity(newer)
    faults: list[FaultChangeRow] = []
    coverage: list[CoverageChangeRow] = []
    for key in dict.fromkeys([*now, *before]):
        a, b = before.get(key), now.get(key)
        faults += _faults(a, b)
        if a is not None and b is not None:
            coverage += _coverage(a, b)
    rank = {name: k for k, name in enumerate(OUTCOMES)}
    faults.sort(key=lambda f: (rank[f["outcome"]], -f["severity"].rank))
    names = [{m.name for m in fleet.missions} for fleet in (older, newer)]
    lost = sorted(names[0] - names[1]) if names[0] & names[1] else []  # of another period all are others
    missing = [before[k].label for k in before if k not in now]
    new = names[1] - names[0]
    return {
        "worse": bool(lost or missing) or any(f["outcome"] in ("new", "worse") for f in faults),
        "counts": {name: sum(f["outcome"] == name for f in faults) for name in OUTCOMES},
        "missions": {
            "older": len(names[0]),
            "newer": len(names[1]),
            "new": len(new),
            "new_counted": sum(r.name in new for m in newer.machines for r in m.runs),
            "missing": lost,
        },
        "machines": {
            "new": [now[k].label for k in now if k not in before],
            "missing": missing,
            "changed": [
                {"machine": now[k].label, "older": before[k].verdict, "newer": now[k].verdict}
                for k in now
                if k in before and before[k].verdict != now[k].verdict
            ],
        },
        "faults": faults,
        "coverage": sorted(coverage, key=lambda c: c["change"], reverse=True),
    }


def _by_identity(fleet: Fleet) -> dict[Identity, Machine]:
    return {(m.id, "" if m.id else m.name): m for m in fleet.machines}


def _faults(a: Machine | None, b: Machine | None) -> list[FaultChangeRow]:
    """What became of the faults of one machine."""
    left = [f for f in a.faults if f.standing] if a else []
    out = []
    for found in [f for f in b.faults if f.standing] if b else []:
        same = next((f for f in left if _same(f, found) and f.side == found.side), None)
        same = same or next((f for f in left if _same(f, found)), None)
        if same is None:
            out.append(_change(b or a, "new", None, found, _unseen(a, found)))
            continue
        left.remove(same)
        changes, up = _differences(same, found)
        outcome: FaultChange = "unchanged" if not changes or not up else "worse" if up > 0 else "better"
        out.append(_change(b or a, outcome, same, found, "", changes))
    out += [_change(b or a, *_gone(f, b)) for f in left]
    return out


def _same(f: FleetFault, g: FleetFault) -> bool:
    return (f.component, f.mode) == (g.component, g.mode) and (
        f.side == g.side or Side.SENSOR_OR_ACTUATOR in (f.side, g.side)
    )


def _gone(f: FleetFault, b: Machine | None) -> tuple[FaultChange, FleetFault, None, str]:
    """A fault that stands no more: resolved, or only not seen again."""
    if b is None or not b.runs:
        return "not_seen_again", f, None, "this audit has no judged mission of the machine"
    known = next((g for g in b.faults if _same(f, g) and not g.standing), None)
    last = f.last.result.start_ns
    later = [r for r in b.dated if last is not None and (r.result.start_ns or 0) > last]
    if known is not None and known.repaired_ns is not None and known.status == "repaired":
        return "resolved", f, None, f"repaired on {utc_moment(known.repaired_ns)}"
    if known is not None:  # found in this audit too, and refuted since
        return "resolved", f, None, f"not in the last {known.clean} missions that judged it"
    again = any(r.result.start_ns == last and r.name == f.last.name for r in b.dated)
    assessed = sum(r.assessed(f.component, f.side, b.limits) for r in later)
    if assessed:
        return "resolved", f, None, f"not in {assessed} later mission{'s' if assessed > 1 else ''} that judged it"
    if again:
        return "not_seen_again", f, None, "the same mission is judged differently, and no mission is later"
    if later:
        return "not_seen_again", f, None, "no longer judged long enough"
    return "not_seen_again", f, None, "no mission is later"


def _unseen(a: Machine | None, f: FleetFault) -> str:
    if a is None or not a.runs:
        return "the earlier audit has no judged mission of the machine"
    if not any(r.assessed(f.component, f.side, a.limits) for r in a.runs):
        return "the part was not judged long enough in the earlier audit: the fault may be older"
    return ""


def _differences(f: FleetFault, g: FleetFault) -> tuple[list[str], int]:
    """Names of what changed, and whether it is worse (1) or better (−1); the severity decides, then ε̂, then how often."""
    ups = {"severity": _sign(f.severity.rank, g.severity.rank), "epsilon": 0, "frequency": 0}
    x, y = f.epsilon, g.epsilon
    if x and y and abs(x.value - y.value) >= _LEAST_EPSILON:
        apart = not x.low <= y.value <= x.high and not y.low <= x.value <= y.high
        ups["epsilon"] = _sign(x.value, y.value) if apart else 0
    was, is_ = f.missions / f.assessed, g.missions / g.assessed
    if max(f.missions, g.missions) > 1 and max(was, is_) > _MORE_OFTEN * min(was, is_):
        ups["frequency"] = _sign(was, is_)
    changes = [name for name, up in ups.items() if up]
    return changes, next((up for up in ups.values() if up), 0)


def _sign(a: float, b: float) -> int:
    return (b > a) - (b < a)


def _change(
    m: Machine | None,
    outcome: FaultChange,
    a: FleetFault | None,
    b: FleetFault | None,
    note: str,
    changes: list[str] | None = None,
) -> FaultChangeRow:
    f = b or a
    assert f is not None
    assert m is not None
    return {
        "outcome": outcome,
        "machine": m.label,
        "component": f.component,
        "kind": f.kind,
        "side": f.side,
        "mode": f.mode,
        "unclear": f.unclear,
        "severity": f.severity,
        "older": _standing(a),
        "newer": _standing(b),
        "changes": changes or [],
        "note": note,
    }


def _standing(f: FleetFault | None) -> FaultStandingRow | None:
    if f is None:
        return None
    return {
        "side": f.side,
        "severity": f.severity,
        "status": f.status,
        "missions": f.missions,
        "assessed": f.assessed,
        "epsilon": bounds_row(f.epsilon),
        "last": f.last.name,
        "report": f.last.result.report,
        "id": f.last_id,
    }


def _coverage(a: Machine, b: Machine) -> list[CoverageChangeRow]:
    """Parts that were assessed in the last mission of one audit alone."""
    had, has = (m.dated[-1].assessed_parts(m.limits) if m.dated else set[PartKey]() for m in (a, b))
    if not a.dated or not b.dated:
        return []
    return [
        {
            "machine": b.label,
            "component": c,
            "kind": b.kind(c),
            "side": s,
            "change": "lost" if (c, s) in had else "gained",
        }
        for c, s in sorted(had ^ has)
    ]
