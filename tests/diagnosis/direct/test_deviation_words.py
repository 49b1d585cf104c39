"""A residual below the threshold of single readings says what was crossed instead."""

from __future__ import annotations

from diagnosis.direct.sentences import _deviation_words
from replay.machine.quantities import OPENING


def test_what_was_crossed_is_said_where_it_is_not_the_size_of_the_residual() -> None:
    assert "the probability of all readings together" in _deviation_words(0.0439, 0.047, OPENING)
    assert "probability" not in _deviation_words(1.01, 0.0064, OPENING)
