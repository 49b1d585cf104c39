"""Lengths in sentences beside the time of the fault that they are of."""

from __future__ import annotations

import pytest

from diagnosis.decision.lengths import with_lengths_told
from diagnosis.results.sentence import About, Sentence, is_about, lasting


@pytest.mark.parametrize(
    ("measured", "seconds", "told"),
    [
        (lasting(14.62, 2), 9.0, "14.62 s in and around it"),
        (lasting(3.0, 0), 2.0, "3 s in and around it"),
        (lasting(2.92, 3), 2.9, "2.920 s"),  # ends are known to some samples
        (lasting(2.92, 3), 8.0, "2.920 s"),  # of one of its stretches
        ("9.00 s", 2.0, "9.00 s"),  # no length of the fault: for 9.00 s before it
    ],
)
def test_a_time_longer_than_the_fault_is_said_to_be_so(measured: str, seconds: float, told: str) -> None:
    assert with_lengths_told([f"v was 0.7 times it for {measured}; the rest."], seconds) == (
        f"v was 0.7 times it for {told}; the rest.",
    )


def test_a_sentence_keeps_what_it_is_about() -> None:
    share = Sentence(About.SHARE, "v followed 0.7 × u ", "(95 %: 0.6 to 0.8)", f" over {lasting(14.62, 3)}.")
    (told,) = with_lengths_told([share], 9.0)
    assert told == "v followed 0.7 × u (95 %: 0.6 to 0.8) over 14.620 s in and around it."
    assert is_about(told, About.SHARE)
