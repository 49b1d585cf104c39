from __future__ import annotations

import pytest

from diagnosis.results.assessed import is_judged, is_limited


@pytest.mark.parametrize(
    ("decided", "driving", "judged"), [(10.0, 12.0, True), (9.9, 9.9, False), (79.0, 100.0, False), (80.0, 100.0, True)]
)
def test_a_part_is_judged_for_the_least_time_and_four_fifths_of_its_driving(
    decided: float, driving: float, judged: bool
) -> None:
    assert is_judged(decided, driving, 10.0) is judged


def test_steering_that_was_not_judged_cuts_nothing_of_the_wheels() -> None:
    assert not is_limited(["the front and rear steering was not judged"], "FR")
    assert is_limited(["the wheel FR was not judged", "only 20.0 s of 60.0 s of the log were judged"], "FL")
    gap = ["for 6.0 s of 60.0 s, without data, the front steering was not judged"]
    assert is_limited(gap, "front")
    assert not is_limited(gap, "rear")
