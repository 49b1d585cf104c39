"""A report as rows of the store: what trends and the fleet page need of a mission.

The keys of the rows are the columns' names in ``schema.sql``, the values plain JSON.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NotRequired, TypedDict

from diagnosis.results.candidates import candidates_of
from diagnosis.results.document import CoverageRow, IntervalRow, LossRow, ReportDocument
from diagnosis.results.left_out import lacks_files_alone
from diagnosis.results.size_rows import EpsilonRow
from diagnosis.results.vocabulary import Severity
from replay.faults import FAULT_STATES, Side, State


class ResultFacts(TypedDict, total=False):
    """Columns of the table ``result`` that come from a report; without one, what is known all the same."""

    machine_id: str
    machine_name: str
    verdict: str
    title: str
    start_ns: int
    duration_s: float
    driving_s: float
    decided_s: float | None
    distance_m: float | None
    open_loop: int
    left_out: int


class BoundsColumns(TypedDict):
    """ε̂ with its 95 % bounds in three columns."""

    epsilon: float | None
    epsilon_low: float | None
    epsilon_high: float | None


class FaultColumns(BoundsColumns):
    """Row of the table ``fault``."""

    id: str
    component: str
    kind: str
    side: str
    mode: str
    severity: str
    start_s: float
    stop_s: float
    start_ns: int
    sat: float | None
    sat_unit: str | None
    probability: float
    unclear: NotRequired[int]  # objects of older versions have none


class ComponentColumns(BoundsColumns):
    """Row of the table ``component``."""

    component: str
    side: str
    driving_s: float
    decided_s: float
    healthy_s: float
    faulty_s: float
    worst: str
    epsilon_s: float | None
    epsilon_relative: int


class MissionSummary(TypedDict):
    """What the store keeps of a report."""

    result: ResultFacts
    faults: list[FaultColumns]
    components: list[ComponentColumns]


def summarise(report: ReportDocument) -> MissionSummary:
    """Rows of tables ``result``, ``fault`` and ``component`` for a report."""
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
            "open_loop": int(log["open_loop"]),
            "left_out": int(lacks_files_alone(report)),
        },
        "faults": [_fault(row) for row in report["intervals"]],
        "components": [_component(row, report["intervals"], report["loss"]) for row in coverage],
    }


def _fault(row: IntervalRow) -> FaultColumns:
    sat = row["sat"]
    return {
        "id": row["id"],
        "component": row["component"],
        "kind": row["kind"],
        "side": row["side"],
        "mode": row["mode"],
        "severity": row["severity"],
        "start_s": row["start_s"],
        "stop_s": row["stop_s"],
        "start_ns": row["start_ns"],
        **_bounds(row["epsilon"]),
        "sat": None if sat is None else sat["mean"],
        "sat_unit": None if sat is None else sat["unit"],
        "probability": row["probability"],
        "unclear": int(bool(candidates_of(row))),
    }


def _component(row: CoverageRow, intervals: Sequence[IntervalRow], loss: Sequence[LossRow]) -> ComponentColumns:
    component, side, seconds = row["component"], row["side"], row["seconds"]
    mine = [i for i in intervals if i["component"] == component and i["side"] in (side, Side.SENSOR_OR_ACTUATOR)]
    worst = max(mine, key=lambda i: (Severity(i["severity"]).rank, i["stop_s"] - i["start_s"]), default=None)
    found = next((e for e in loss if (e["component"], e["side"]) == (component, side)), None)
    return {
        "component": component,
        "side": side,
        "driving_s": row["driving_s"],
        "decided_s": row["decided_driving_s"],
        "healthy_s": seconds.get(State.HEALTHY.value, 0.0),
        "faulty_s": sum(seconds.get(s.value, 0.0) for s in FAULT_STATES),
        "worst": worst["mode"] if worst else "",
        **_bounds(None if found is None else found["epsilon"]),
        "epsilon_s": found["seconds"] if found else None,
        "epsilon_relative": int(found["relative"]) if found else 0,
    }


def _bounds(epsilon: EpsilonRow | None) -> BoundsColumns:
    if epsilon is None:
        return {"epsilon": None, "epsilon_low": None, "epsilon_high": None}
    return {"epsilon": epsilon["value"], "epsilon_low": epsilon["low"], "epsilon_high": epsilon["high"]}
