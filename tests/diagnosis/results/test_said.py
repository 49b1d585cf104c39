"""What is said of the machine as a whole, and when: sentence and spans come from one value."""

from __future__ import annotations

import math

import pytest

from diagnosis.results.event_rows import event_rows
from diagnosis.results.machine_event import less_than_told, not_following, swinging
from diagnosis.results.said import Said, Stated

LENGTH = 90.0


@pytest.mark.parametrize(("digits", "said", "span"), [(0, "40–47 s", (40.0, 47.0)), (1, "40.2–46.8 s", (40.2, 46.8))])
def test_a_stated_time_has_the_numbers_of_its_words(digits: int, said: str, span: tuple[float, float]) -> None:
    when = Stated.of(40.249, 46.751, digits=digits)
    assert str(when) == said
    assert when.span == span
    assert said == f"{when.start}–{when.stop} s"


def test_a_time_without_an_end_goes_on() -> None:
    when = Stated.of(42.6, digits=0)
    assert when.start == "43"
    assert when.span == (43.0, math.inf)


def test_an_event_has_the_times_of_what_is_said() -> None:
    said = Said("All make 0.6 times what they are told at 2–5 s", ((2.0, 5.0),))
    event = said.event(less_than_told)
    assert event.text.startswith(said.text)
    assert event.spans == said.spans


def test_rows_have_their_numbers_and_no_time_beyond_the_log() -> None:
    idle = Said("For 7.0 s all drives stood still.", ((2.0, 5.0), (10.0, 14.0))).event(not_following)
    late = Said("Between 80.0 and 99.0 s", ((80.0, 99.0), (91.0, 93.0))).event(swinging)
    on = Said("and 0.60 times from 43 s on", ((43.0, math.inf),)).event(less_than_told)
    rows = event_rows([idle, late, on, less_than_told("All make 0.6 throughout")], LENGTH)
    assert [row["id"] for row in rows] == ["M1", "M2", "M3", "M4"]
    assert [[(s["start_s"], s["stop_s"]) for s in row["spans"]] for row in rows] == [
        [(2.0, 5.0), (10.0, 14.0)],
        [(80.0, LENGTH)],
        [(43.0, LENGTH)],
        [],
    ]
