"""Stages and the lines that they become."""

from __future__ import annotations

from dataclasses import replace

from replay.progress import Progress, Stage


def test_a_stage_in_words() -> None:
    judging = Progress(Stage.JUDGING_WHEEL, "FR")
    assert str(judging) == "judging wheel FR"
    assert str(replace(judging, mission="drive.mcap")) == "drive.mcap: judging wheel FR"
    assert str(Progress(Stage.DECIDING)) == "deciding"


def test_words_are_of_one_stage_alone() -> None:
    assert len({stage.words for stage in Stage}) == len(Stage.__members__)
