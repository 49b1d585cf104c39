"""Lengths in sentences beside the time of the fault that they are of."""

from __future__ import annotations

import pytest

from diagnosis.decision.lengths import with_lengths_told
from diagnosis.results.sentence import About, Sentence, is_about


@pytest.mark.parametrize(
    ("text", "seconds", "told"),
    [
        (
            "v was 0.7 times it, over 14.62 s; the rest.",
            9.0,
            "v was 0.7 times it, over 14.62 s in and around it; the rest.",
        ),
        (
            "v delivered nothing for 3 s while u came.",
            2.0,
            "v delivered nothing for 3 s in and around it while u came.",
        ),
        ("v followed 0.7 × u over 2.920 s.", 2.9, "v followed 0.7 × u over 2.920 s."),  # ends are known to some samples
        ("v followed 0.7 × u over 2.920 s.", 8.0, "v followed 0.7 × u over 2.920 s."),  # of one of its stretches
        ("Nothing was recorded for 9.00 s before it: it may have begun then.", 2.0, None),
        ("Before that it grew for 9.00 s.", 2.0, None),
        ("for 9.0 s of driving it was elsewhere.", 2.0, None),
    ],
)
def test_a_time_longer_than_the_fault_is_said_to_be_so(text: str, seconds: float, told: str | None) -> None:
    assert with_lengths_told([text], seconds) == (told or text,)


def test_a_sentence_keeps_what_it_is_about() -> None:
    share = Sentence(About.SHARE, "v followed 0.7 × u ", "(95 %: 0.6 to 0.8)", " over 14.620 s.")
    (told,) = with_lengths_told([share], 9.0)
    assert told == "v followed 0.7 × u (95 %: 0.6 to 0.8) over 14.620 s in and around it."
    assert is_about(told, About.SHARE)
