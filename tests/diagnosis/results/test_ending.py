"""A fault lasts, ended, or was only last seen: for the last two its part must have been healthy behind it."""

from __future__ import annotations

from typing import Any

import pytest

from diagnosis.results.ending import Ending, ending_of, healthy_after
from replay.faults import Side
from tests import report_samples as samples


def span(state: str, start: float, stop: float, side: str = "actuator") -> dict[str, Any]:
    return {"component": "FR", "side": side, "state": state, "start_s": start, "stop_s": stop, "reason": ""}


@pytest.mark.parametrize(
    ("stop", "states", "ending"),
    [
        (59.5, [], Ending.LASTS),
        (40.0, [span("healthy", 40.0, 60.0)], Ending.ENDED),
        (40.0, [span("healthy", 0.0, 30.0), span("not_excited", 40.0, 60.0)], Ending.UNSEEN),
        (40.0, [span("healthy", 40.0, 60.0, "sensor")], Ending.UNSEEN),
        (40.0, [], Ending.UNSEEN),
    ],
)
def test_a_fault_ended_only_where_its_part_was_healthy_behind_it(
    stop: float, states: list[dict[str, Any]], ending: Ending
) -> None:
    fault = samples.fault(component="FR", side="actuator", start_s=20.0, stop_s=stop)
    report = samples.report_with(intervals=[fault], states=states)
    report["log"]["duration_s"] = 60.0
    assert ending_of(fault, report) is ending


def test_a_side_that_was_never_judged_hides_no_end() -> None:
    states = [
        {"component": "FR", "side": "sensor", "state": "healthy", "start_s": 15.0, "stop_s": 60.0, "reason": ""},
        {"component": "FR", "side": "actuator", "state": "not_assessed", "start_s": 0.0, "stop_s": 60.0, "reason": ""},
    ]
    either = Side.SENSOR_OR_ACTUATOR
    assert healthy_after("FR", either, 10.0, states, of_judged=True) == 45.0  # type: ignore[arg-type]
    assert healthy_after("FR", either, 10.0, states) == 0.0  # type: ignore[arg-type]
