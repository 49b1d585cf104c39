"""A report as rows of the store: what trends and the fleet page need of a mission."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from diagnosis.results.result import SEVERITIES
from replay.faults import FAULT_STATES, State

_EPSILON = ("value", "low", "high")


def summarise(report: Mapping[str, Any]) -> dict[str, Any]:
    """Rows of tables ``result``, ``fault`` and ``component`` for a report.

    Parameters
    ----------
    report : Mapping[str, Any]
        Document of ``report.json``.

    Returns
    -------
    dict[str, Any]
        ``result``: columns that come from the report; ``faults`` and ``components``: one mapping per row. The keys are
        the columns' names, the values plain JSON.
    """
    log, machine, verdict = report["log"], report["machine"], report["verdict"]
    coverage = report["coverage"]
    decided = [row["decided_driving_s"] for row in coverage]
    return {
        "result": {
            "machine_id": machine["id"],
            "machine_name": machine["name"],
            "verdict": verdict["status"],
            "title": verdict["title"],
            "start_ns": log["start_ns"],
            "duration_s": log["duration_s"],
            "driving_s": log["driving_s"],
            "decided_s": sum(decided) / len(decided) if decided else None,
            "distance_m": log["distance_m"],
            "open_loop": int(bool(log.get("open_loop", False))),
        },
        "faults": [_fault(row) for row in report["intervals"]],
        "components": [_component(row, report["intervals"], report.get("loss") or ()) for row in coverage],
    }


def _fault(row: Mapping[str, Any]) -> dict[str, Any]:
    sat = row.get("sat") or {}
    return {
        **{k: row[k] for k in ("id", "component", "kind", "side", "mode", "severity")},
        **{k: row[k] for k in ("start_s", "stop_s", "start_ns")},
        **_bounds(row.get("epsilon")),
        "sat": sat.get("mean"),
        "sat_unit": sat.get("unit"),
        "probability": row["probability"],
    }


def _component(
    row: Mapping[str, Any], intervals: Sequence[Mapping[str, Any]], loss: Sequence[Mapping[str, Any]]
) -> dict[str, Any]:
    component, side, seconds = row["component"], row["side"], row["seconds"]
    mine = [i for i in intervals if i["component"] == component and i["side"] in (side, "sensor_or_actuator")]
    worst = max(mine, key=lambda i: (SEVERITIES.index(i["severity"]), i["stop_s"] - i["start_s"]), default=None)
    found = next((e for e in loss if (e["component"], e["side"]) == (component, side)), None)
    return {
        "component": component,
        "side": side,
        "driving_s": row["driving_s"],
        "decided_s": row["decided_driving_s"],
        "healthy_s": seconds.get(State.HEALTHY.value, 0.0),
        "faulty_s": sum(seconds.get(s.value, 0.0) for s in FAULT_STATES),
        "worst": worst["mode"] if worst else "",
        **_bounds(found and found["epsilon"]),
        "epsilon_s": found["seconds"] if found else None,
    }


def _bounds(epsilon: Mapping[str, Any] | None) -> dict[str, Any]:
    values = [(epsilon or {}).get(k) for k in _EPSILON]
    return dict(zip(("epsilon", "epsilon_low", "epsilon_high"), values, strict=True))
