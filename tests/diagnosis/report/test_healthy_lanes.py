"""What an open lane without a fault says."""

from __future__ import annotations

from diagnosis.report.healthy_lanes import LaneDetail, healthy_lanes
from tests import report_samples as samples


def test_checks_of_both_sides_stand_in_both_lanes() -> None:
    check = {
        "component": "FR", "side": "sensor_or_actuator", "check": "response", "asked": "speed per opening", "worst": 0.1, "limit": 0.4,
        "start_s": None, "stop_s": None, "shows": None, "passed": True, "text": "",
    }  # fmt: skip
    unseen = {**check, "component": "FL", "side": "sensor", "worst": None}
    found = healthy_lanes({**samples.no_faults()[0], "clearing": [check, unseen]})  # type: ignore[typeddict-item]
    words = LaneDetail((("speed per opening", "10 %, limit 33 %; over the whole mission"),), ())
    assert found["FR", "sensor"] == found["FR", "actuator"] == words
    assert found["FL", "sensor"].checks == (("speed per opening", "the mission does not show it"),)
    beyond = {**check, "worst": 7.78, "start_s": 5.0, "stop_s": 8.0, "passed": False}
    found = healthy_lanes({**samples.no_faults()[0], "clearing": [beyond]})  # type: ignore[typeddict-item]
    assert found["FR", "sensor"].checks == (
        ("speed per opening", "over 99 %, limit 33 %, beyond it; largest at 0:05.0"),
    )
