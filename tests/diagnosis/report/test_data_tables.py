"""Tables of what was asked before a machine is cleared."""

from __future__ import annotations

from typing import Any

import pytest

from diagnosis.report.data_tables import check_rows, coverage_rows
from diagnosis.report.page import build_page
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
