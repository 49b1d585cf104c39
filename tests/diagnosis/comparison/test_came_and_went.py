"""A fault that went away within its mission is not resolved by a mission without it."""

from __future__ import annotations

from typing import Any

import pytest

from tests.diagnosis.comparison.test_compare import compared, fault, later, only, report


def spans(*healthy: tuple[str, float, float]) -> list[dict[str, Any]]:
    return [
        {"component": "FR", "side": side, "state": "healthy", "start_s": start, "stop_s": stop, "reason": ""}
        for side, start, stop in healthy
    ]


@pytest.mark.parametrize(
    ("states", "status"),
    [
        (spans(("sensor", 0.0, 10.0)), "resolved"),
        (spans(("sensor", 0.0, 10.0), ("sensor", 15.0, 15.5)), "resolved"),
        (spans(("sensor", 15.0, 60.0)), "not_seen_again"),
    ],
)
def test_a_fault_that_came_and_went_is_not_resolved(states: list[dict[str, Any]], status: str) -> None:
    older = report(fault("FR", "sensor", "stuck")) | {"states": states}
    gone = only(compared(older, later()))
    assert gone.status == status
    assert bool(gone.note) == (status == "not_seen_again")


def test_what_is_only_told_is_resolved() -> None:
    older = report(fault("FR", "sensor", "noisy", severity="info")) | {"states": spans(("sensor", 15.0, 60.0))}
    assert only(compared(older, later())).status == "resolved"


def test_of_a_fault_of_either_side_both_must_have_been_healthy_again() -> None:
    older = report(fault("FR", "sensor_or_actuator", "stuck"))
    one, both = spans(("sensor", 15.0, 60.0)), spans(("sensor", 15.0, 60.0), ("actuator", 15.0, 60.0))
    assert only(compared(older | {"states": one}, later())).status == "resolved"
    assert only(compared(older | {"states": both}, later())).status == "not_seen_again"
