"""Tables of what was asked before a machine is cleared."""

from __future__ import annotations

from typing import Any

import pytest

from diagnosis.report.data_tables import check_rows, coverage_rows, loop_tables
from diagnosis.report.page import build_page
from diagnosis.results.machine_words import HYDRAULIC
from tests import report_samples as samples

CHECK: dict[str, Any] = {
    "component": "FR", "side": "sensor_or_actuator", "check": "response", "asked": "speed per opening", "worst": 0.1, "limit": 0.4,
    "start_s": None, "stop_s": None, "shows": 0.2, "passed": True, "text": "",
}  # fmt: skip


@pytest.mark.parametrize(
    ("component", "severity", "more"),
    [("FR", "low", ", but for the time of F1"), ("FL", "low", ""), ("FR", "info", "")],
)
def test_a_check_that_leaves_a_stated_fault_out_says_so(component: str, severity: str, more: str) -> None:
    fault = samples.fault(component=component, side="sensor", severity=severity)
    report = samples.report_with(intervals=[{**fault, "id": "F1"}], clearing=[CHECK])
    (row,) = check_rows(report)
    assert (row["ok"], row["when"]) == (True, f"over the mission{more}")


def test_checks_that_show_less_than_is_asked_are_told() -> None:
    report, columns = samples.no_faults()
    for shows, told in ((0.2, False), (0.45, True)):
        page = build_page({**report, "clearing": [{**CHECK, "shows": shows}]}, columns)  # type: ignore[typeddict-item]
        assert ("A check that shows only more than" in page) is told


@pytest.mark.parametrize(("severity", "told"), [("info", True), ("low", False)])
def test_faulty_time_of_remarks_is_told_apart_as_the_timeline_counts_none(severity: str, told: bool) -> None:
    report, _ = samples.one_wheel()
    (fault, *_) = report["intervals"]
    report["intervals"] = [fault | {"severity": severity}]
    (row,) = [r for r in coverage_rows(report) if r["faulty"] > 0.0][:1]
    assert any("of its faulty time are remarks" in why for why in row["why"]) is told


def test_figures_of_a_column_have_as_many_digits() -> None:
    def row(error: float, effort: float) -> dict[str, object]:
        return {key: {"mission": x, "driving": x} for key, x in (("tracking_error", error), ("control_effort", effort))}

    paper = [{"controller": "Yang", "tracking_error": 0.032, "control_effort": 0.13, "parameters": 16}]
    metrics = {
        "wheels": {"FR": row(0.0274, 0.0982), "FL": row(0.024, 0.1)},
        "average": row(-0.5, 1.234),
        "paper": paper,
    }
    shown = loop_tables(metrics, HYDRAULIC)  # type: ignore[arg-type]
    assert [cells[::2] for _, cells in shown["rows"]] == [["0.0274", "9.82"], ["0.0240", "10.0"], ["−0.500", "123"]]
    assert shown["paper"] == [("Yang", ["0.032", "13.0", "16"])]
