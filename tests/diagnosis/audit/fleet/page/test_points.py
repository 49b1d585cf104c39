"""Long reasons of the fleet page are read point by point."""

from __future__ import annotations

from diagnosis.audit.fleet.page.points import in_points


def test_a_short_reason_stands_whole() -> None:
    assert in_points("stuck; no repair recorded; rising") == ("stuck; no repair recorded; rising", [])


def test_of_a_long_one_the_first_points_stand_and_brackets_are_left_whole() -> None:
    reason = "; ".join(["RR speed sensor no signal", "1 mission (a; b) was not judged", f"not settled {'x' * 250}"])
    assert in_points(reason) == (
        "RR speed sensor no signal; 1 mission (a; b) was not judged",
        [f"Not settled {'x' * 250}"],
    )
