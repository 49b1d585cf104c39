from __future__ import annotations

import sqlite3
from collections.abc import Callable
from pathlib import Path
from typing import Any

from diagnosis.audit.store import summary
from diagnosis.audit.store.summary import summarise


def test_rows_of_a_report(make_report: Callable[..., dict[str, Any]]) -> None:
    rows = summarise(make_report())
    assert rows["result"] == {
        "machine_id": "H-07",
        "machine_name": "Haulotte",
        "verdict": "watch",
        "title": "1 fault to watch",
        "start_ns": 1_760_000_000_000_000_000,
        "duration_s": 100.0,
        "driving_s": 80.0,
        "decided_s": 60.0,
        "distance_m": 12.5,
        "open_loop": 0,
        "left_out": 0,
    }
    (fault,) = rows["faults"]
    assert (fault["epsilon"], fault["sat"], fault["sat_unit"], fault["mode"]) == (0.2, None, None, "inefficient")
    part = {(c["component"], c["side"]): c for c in rows["components"]}
    assert len(part) == 4
    assert part["FR", "actuator"]["worst"] == "inefficient"
    assert part["FR", "actuator"]["faulty_s"] == 20.0
    assert (part["FR", "actuator"]["epsilon"], part["FR", "actuator"]["epsilon_s"]) == (0.2, 55.0)
    assert (part["FL", "actuator"]["worst"], part["FL", "actuator"]["epsilon"]) == ("", None)


def test_worst_is_the_most_severe_and_counts_for_both_sides_where_they_cannot_be_told_apart(
    make_report: Callable[..., dict[str, Any]],
) -> None:
    report = make_report()
    worse = {**report["intervals"][0], "id": "F2", "side": "sensor_or_actuator", "mode": "stuck", "severity": "high"}
    report["intervals"].append({**worse, "start_s": 40.0, "stop_s": 41.0})
    part = {(c["component"], c["side"]): c["worst"] for c in summarise(report)["components"]}
    assert part["FR", "actuator"] == part["FR", "sensor"] == "stuck"


def test_parts_without_an_estimate_have_none(make_report: Callable[..., dict[str, Any]]) -> None:
    report = make_report() | {"loss": []}
    assert all(c["epsilon"] is None and c["epsilon_s"] is None for c in summarise(report)["components"])


def test_rows_have_the_columns_of_the_tables(make_report: Callable[..., dict[str, Any]]) -> None:
    connection = sqlite3.connect(":memory:")
    connection.executescript(Path(summary.__file__).with_name("schema.sql").read_text(encoding="utf-8"))
    columns = {
        table: {row[1] for row in connection.execute(f"PRAGMA table_info({table})")} - {"result"}
        for table in ("result", "fault", "component")
    }
    connection.close()
    rows = summarise(make_report())
    assert set(rows["faults"][0]) == columns["fault"]
    assert set(rows["components"][0]) == columns["component"]
    assert set(rows["result"]) < columns["result"]
