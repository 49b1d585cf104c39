"""Numbers of the paper's machine are named where no machine file gave this machine's own."""

from __future__ import annotations

from dataclasses import replace

from diagnosis.decision.assumed import assumed_words
from replay.machine.config import ASSUMABLE, haulotte


def test_every_number_is_named_with_its_figure() -> None:
    words = "; ".join(assumed_words(haulotte()))
    for text in ("wheelbase 2.1 m", "wheel diameter 0.854 m", "gear ratio 17.7", "top speed 0.36 m/s", "β = 0.001"):
        assert text in words
    assert len(assumed_words(haulotte())) == len(ASSUMABLE)


def test_what_a_file_gives_is_not_assumed() -> None:
    assert assumed_words(replace(haulotte(), assumed=("max_steer",))) == ["largest steering angle 45°"]
    assert not assumed_words(replace(haulotte(), assumed=()))
    assert not assumed_words(replace(haulotte(), geometry=None, assumed=("geometry",)))
