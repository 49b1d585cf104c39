from __future__ import annotations

import pytest

from diagnosis.report.fault_times import times_words, when_words
from tests import report_samples as samples

HEALTHY = {"component": "FR", "side": "actuator", "state": "healthy", "start_s": 80.0, "stop_s": 100.0, "reason": ""}


@pytest.mark.parametrize(
    ("start", "stop", "words"),
    [
        (37.995, 80.005, "began at 0:37.995 (07:30:37.995 UTC) and ended at 1:20.005, 20.0 s before the log does"),
        (37.995, 100.0, "began at 0:37.995 (07:30:37.995 UTC) and lasts to the end of the log"),
        (0.0, 100.0, "was there from the beginning and lasts to the end of the log"),
    ],
)
def test_onset_clock_time_and_end(start: float, stop: float, words: str) -> None:
    fault = samples.fault(component="FR", side="actuator", start_s=start, stop_s=stop)
    report = samples.report_with(intervals=[fault], states=[HEALTHY])
    report["log"] |= {"duration_s": 100.0, "start_ns": 1_794_814_200 * 10**9}
    assert when_words(fault, report) == f"{fault['id']} {words}"
    report["states"] = []
    if stop < 99.0:
        assert when_words(fault, report).endswith(
            "before the log ends; its part was not seen healthy for a second since"
        )


def test_of_several_faults_of_a_part_the_most_urgent_and_the_last_are_told() -> None:
    first, last, between = (
        samples.fault(id=name, component="FR", side="actuator", start_s=start, stop_s=stop)
        for name, start, stop in (("F1", 20.0, 30.0), ("F4", 90.0, 100.0), ("F2", 50.0, 60.0))
    )
    report = samples.report_with(intervals=[first, between, last], states=[])
    report["log"] |= {"duration_s": 100.0}
    both = times_words([first, between, last], report)
    assert both.startswith("F1 began at 0:20.000")
    assert both.endswith("and lasts to the end of the log")
    assert "F2" not in both
    assert times_words([last, first], report) == f"first seen at 0:20.000 (F1); {when_words(last, report)}"
    assert times_words([], report) == ""
