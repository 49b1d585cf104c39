"""A file that was left out is told from a log that is damaged, by what its sentence is and not by its words."""

from __future__ import annotations

import copy
import pickle
from typing import Any

import pytest

from diagnosis.results.left_out import by_its_clock, is_left_out, lacks_files_alone, only_left_out
from replay.log.left_out import FileLeftOut

APART = FileLeftOut("b.csv was left out: its clock could not be compared with a.csv", clock=True)
EMPTY = FileLeftOut("side 2.csv was left out: side 2.csv is empty (0 bytes)")
ROW = "t.csv: a row of 5002 bytes before byte 9006 was left out"


def test_what_a_sentence_says_it_is_counts() -> None:
    assert [is_left_out(text) for text in (APART, EMPTY, ROW, str(APART))] == [True, True, False, False]
    assert [by_its_clock(text) for text in (APART, EMPTY, ROW)] == [True, False, False]


@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy, lambda text: pickle.loads(pickle.dumps(text))])
def test_a_copy_says_so_as_well(copied: Any) -> None:
    assert by_its_clock(copied(APART))
    assert is_left_out(copied(EMPTY))
    assert not by_its_clock(copied(EMPTY))


def test_one_damage_makes_a_damaged_log() -> None:
    assert only_left_out([APART])
    assert not only_left_out([APART, "a.mcap ends without a footer"])
    assert not only_left_out([])


def test_a_report_says_whether_its_log_lacks_files_alone() -> None:
    def told(*files: dict[str, Any]) -> bool:
        return lacks_files_alone({"log": {"files": list(files)}})  # type: ignore[typeddict-item]

    whole = {"damage": []}
    assert told(whole, {"damage": [str(APART)], "left_out": [str(APART)]})
    assert not told({"damage": [ROW]}, {"damage": [str(APART)], "left_out": [str(APART)]})
    assert not told({"damage": [str(APART), ROW], "left_out": [str(APART)]})
    assert not told({"damage": [str(APART)]})  # a result of an earlier version does not say
    assert not told(whole)
