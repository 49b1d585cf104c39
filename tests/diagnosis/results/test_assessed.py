from __future__ import annotations

from typing import Any

import pytest

from diagnosis.results.assessed import Cut, CutKind, is_judged, is_limited


def verdict(*cuts: Cut) -> Any:
    return {"scope": [cut.text for cut in cuts], "cuts": [cut.row() for cut in cuts]}


@pytest.mark.parametrize(
    ("decided", "driving", "judged"), [(10.0, 12.0, True), (9.9, 9.9, False), (79.0, 100.0, False), (80.0, 100.0, True)]
)
def test_a_part_is_judged_for_the_least_time_and_four_fifths_of_its_driving(
    decided: float, driving: float, judged: bool
) -> None:
    assert is_judged(decided, driving, 10.0) is judged


def test_steering_that_was_not_judged_cuts_nothing_of_the_wheels() -> None:
    steering, wheel = Cut(CutKind.STEERING, ("front", "rear"), "…"), Cut(CutKind.WHEELS, ("FR",), "…")
    assert not is_limited(verdict(steering), "FR")
    assert is_limited(verdict(wheel, Cut(CutKind.LOG, (), "…")), "FL")
    gap = verdict(Cut(CutKind.DATA, ("front_steer",), "…"))
    assert is_limited(gap, "front_steer")
    assert not is_limited(gap, "rear_steer")


def test_a_report_that_does_not_say_of_what_it_is_cut_limits_every_part() -> None:
    earlier = verdict(Cut(CutKind.STEERING, ("front",), "…"))
    del earlier["cuts"]
    assert is_limited(earlier, "FR")
    assert not is_limited({**earlier, "scope": []}, "FR")
