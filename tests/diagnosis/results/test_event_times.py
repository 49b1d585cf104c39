"""When something happened to the machine as a whole, by its sentence or by what its finder knows."""

from __future__ import annotations

import pytest

from diagnosis.results.event_times import event_rows, times_said
from diagnosis.results.machine_event import less_than_told, not_following, swinging

LENGTH = 90.0


@pytest.mark.parametrize(
    ("text", "times"),
    [
        ("make 0.70 times what they are told at 40–47 s, and 1.00 times else", ((40.0, 47.0),)),
        ("0.98 times as fast up to 40 s, and 0.60 times from 43 s on", ((43.0, LENGTH),)),
        ("less speed of the same openings from about 40 s on, as fast", ((40.0, LENGTH),)),
        ("From 12.0 to 14.5 s the gyro (imu.yaw_rate) reads nothing", ((12.0, 14.5),)),
        ("Between 3.0 and 9.5 s several wheels swing", ((3.0, 9.5),)),
        ("From the start to 12.3 s the gyro shows that the machine turned", ((0.0, 12.3),)),
        ("From 12.3 s to the end of the log the gyro shows", ((12.3, LENGTH),)),
        ("From 12.3 s to 20.0 s the gyro shows", ((12.3, 20.0),)),
        ("No wheel moved at 3.0–5.0 s, 8.0–9.0 s although", ((3.0, 5.0), (8.0, 9.0))),
        ("made 0.6 times what they are told throughout", ()),
        ("From the start to the end of the log the gyro shows", ()),
        ("about 0.3 m/s at 89.0–99.0 s", ((89.0, LENGTH),)),
    ],
)
def test_times_of_a_sentence(text: str, times: tuple[tuple[float, float], ...]) -> None:
    assert times_said(text, LENGTH) == times


def test_rows_have_their_numbers_and_the_times_of_their_finder_first() -> None:
    idle = not_following("For 7.0 s all drives stood still (longest 10.0–14.0 s).").at([(2, 5), (10, 14)])
    rows = event_rows([idle, swinging("Between 1.0 and 2.0 s"), less_than_told("All make 0.6 throughout")], LENGTH)
    assert [row["id"] for row in rows] == ["M1", "M2", "M3"]
    assert rows[0]["spans"] == [{"start_s": 2.0, "stop_s": 5.0}, {"start_s": 10.0, "stop_s": 14.0}]
    assert rows[1]["spans"] == [{"start_s": 1.0, "stop_s": 2.0}]
    assert rows[2]["spans"] == []
