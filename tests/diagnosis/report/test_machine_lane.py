"""The lane of the machine as a whole: one bar for each time, throughout where none is stated, and room for the words."""

from __future__ import annotations

from typing import cast

import pytest

from diagnosis.report.machine_lane import machine_lane
from diagnosis.results.document import ReportDocument


def lane(*events: tuple[str, list[tuple[float, float]]]) -> ReportDocument:
    rows = [
        {"id": f"M{k}", "title": title, "text": "", "spans": [{"start_s": a, "stop_s": b} for a, b in spans]}
        for k, (title, spans) in enumerate(events, 1)
    ]
    return cast(ReportDocument, {"events": rows})


def test_no_lane_without_events() -> None:
    assert machine_lane(cast(ReportDocument, {}), 90.0) == ()
    assert machine_lane(lane(("A", [])), 0.0) == ()


def test_an_event_without_times_is_throughout() -> None:
    (one,) = machine_lane(lane(("The gyro contradicts the wheels", [])), 90.0)
    assert (one.bar.left, one.bar.width, one.side) == (0.0, 100.0, "in")
    assert one.bar.title == "The gyro contradicts the wheels, throughout"
    assert one.bar.label == "The gyro contradicts the wheels"


def test_words_stand_where_most_room_is() -> None:
    first, second = machine_lane(lane(("A", [(9.0, 18.0), (81.0, 85.5)])), 90.0)
    assert (first.side, first.left, first.width) == ("right", pytest.approx(20.0), pytest.approx(70.0))
    assert (second.side, second.left, second.width) == ("left", pytest.approx(20.0), pytest.approx(70.0))
    assert second.bar.title == "A, 1:21.0 to 1:25.5"


def test_bars_that_cover_each_other_stand_in_rows() -> None:
    bars = machine_lane(lane(("A", [(0.0, 60.0)]), ("B", [(30.0, 80.0)])), 90.0)
    assert [(b.event, b.bar.row, b.bar.rows) for b in bars] == [("M1", 0, 2), ("M2", 1, 2)]
    assert [b.side for b in bars] == ["in", "in"]
