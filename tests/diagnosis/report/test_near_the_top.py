"""What the first screen says of measured drives, of the law behind the replay, and of the part to leave alone."""

from __future__ import annotations

from typing import Any

import pytest

from diagnosis.report.near_the_top import law_doubt, other_side_words, positions_fact
from diagnosis.results.document import ReportDocument
from tests.report_samples import five_faults


def changed(**keys: Any) -> ReportDocument:
    report, _ = five_faults()
    return {**report, **keys}  # type: ignore[typeddict-item]


def test_measured_valves_are_named_and_those_that_are_not() -> None:
    signals = [{**s, "name": "wheel.FR.u_applied"} for s in five_faults()[0]["signals"][:1]]
    _, said = positions_fact(changed(signals=signals)) or ("", "")
    assert said.startswith("FR drive valve; not measured: FL, RR and RL drive valve")
    assert (positions_fact(changed(signals=[])) or ("", ""))[1].startswith("none: ")


def test_a_law_that_does_not_explain_the_commands_is_warned_of() -> None:
    reading = {
        "name": "control law",
        "value": "sign_abs",
        "detail": "fit; explains 10.3 % of the recorded command; no reading explains it well: x",
    }
    assert "explains 10.3 % of the recorded command" in law_doubt(changed(readings=[reading]))
    assert law_doubt(changed(readings=[{**reading, "detail": "fit; explains 99.9 % of the recorded command"}])) == ""


@pytest.mark.parametrize(
    ("reason", "told"),
    [(None, True), ("Explained by F9, the rear steering valve: x", True), ("The speed of RL is off", False)],
)
def test_the_other_part_of_a_faulty_wheel_is_left_alone_only_where_nothing_is_against_it(
    reason: str | None, *, told: bool
) -> None:
    report, _ = five_faults()
    f = {**report["intervals"][0], "component": "RL", "kind": "wheel", "side": "actuator"}
    f["hypotheses"] = [{"side": "actuator", "mode": "inefficient", "p": 0.96}]
    row = {
        "component": "RL",
        "tier": "model",
        "seconds": {"healthy": 100.0},
        "driving_s": 100.0,
        "decided_driving_s": 100.0,
    }
    coverage = [{**row, "side": side} for side in ("sensor", "actuator")]
    points = [{"reason": reason, "act": "", "parts": [{"component": "RL", "side": "sensor"}], "fault": "", "why": ""}]
    verdict = {**report["verdict"], "to_clear": points if reason else []}
    got = changed(intervals=[f], coverage=coverage, verdict=verdict)
    assert ("RL speed sensor" in other_side_words([f], got)) is told  # type: ignore[list-item]
    blamed = changed(intervals=[f, {**f, "side": "sensor"}], coverage=coverage, verdict={**verdict, "to_clear": []})
    assert other_side_words([f], blamed) == ""  # type: ignore[list-item]
