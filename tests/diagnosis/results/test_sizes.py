"""Sizes in sentences."""

from __future__ import annotations

import pytest

from diagnosis.results.sizes import amount, kept_to, probable_words, turn


@pytest.mark.parametrize(
    ("least", "most", "unit", "words"),
    [
        (0.312, 0.3151, "m/s", "stayed between 0.312 and 0.3151 {speed_unit}"),
        (0.5, 0.5, "m/s", "stayed at 0.5 {speed_unit}"),
        (0.041, 0.044, "of full opening", "stayed between 4.1 and 4.4{percent}"),
        (0.0, 0.0, "rad", "stayed at 0°"),
    ],
)
def test_a_channel_that_hardly_moved_is_given_by_its_two_ends(least: float, most: float, unit: str, words: str) -> None:
    assert kept_to(least, most, unit) == words


def test_what_turns_does_so_in_degrees_a_second_as_the_page_has_it() -> None:
    assert (turn(0.1), turn(-0.05), turn(0.1, sign="+"), turn(-0.1, sign="+")) == (
        "5.7°/s",
        "−2.9°/s",
        "+5.7°/s",
        "−5.7°/s",
    )
    assert amount(0.5, "rad/s", 2) == "29°/s"


def test_what_is_less_probable_is_so_than_something() -> None:
    assert probable_words(9.0) == "about 8\u202f000 times as probable with this fault as without one"
    assert probable_words(-9.0) == "less probable with this fault than without one"
