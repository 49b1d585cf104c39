"""A file that was left out is told from a log that is damaged."""

from __future__ import annotations

import pytest

from diagnosis.results.left_out import is_left_out, only_left_out

APART = "b.csv was left out: its clock could not be compared with a.csv: they have no signal in common"


@pytest.mark.parametrize(
    ("text", "apart"),
    [
        (APART, True),
        ("side 2.csv was left out: side 2.csv is empty (0 bytes)", True),
        ("b.csv was left out, because nothing could be judged together with it (no wheel)", True),
        ("chunk at byte 120 was left out: its head is damaged", False),
        ("the chunk at byte 120 was left out: its checksum differs", False),
        ("t.csv: a row of 5002 bytes before byte 9006 was left out", False),
        ("a.mcap ends without a footer", False),
    ],
)
def test_sentences(text: str, apart: bool) -> None:
    assert is_left_out(text) is apart


def test_one_damage_makes_a_damaged_log() -> None:
    assert only_left_out([APART])
    assert not only_left_out([APART, "a.mcap ends without a footer"])
    assert not only_left_out([])
