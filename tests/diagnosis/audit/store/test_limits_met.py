"""At which limit a mission was stopped is a field, whatever the sentence says; results of earlier versions have the sentence alone."""

from __future__ import annotations

import sqlite3
from dataclasses import replace

import pytest

from diagnosis.audit.isolation.limits import Limits
from diagnosis.audit.isolation.why import over_memory, over_time
from diagnosis.audit.store.outcome import LimitMet, MissionState, Outcome, limit_in_words
from diagnosis.audit.store.records import attempt_record
from diagnosis.audit.store.stored import limit_of_row


def row(**columns: object) -> sqlite3.Row:
    connection = sqlite3.connect(":memory:")
    connection.row_factory = sqlite3.Row
    names = ", ".join(f"? AS {name}" for name in columns)
    found: sqlite3.Row = connection.execute(f"SELECT {names}", tuple(columns.values())).fetchone()
    return found


def test_an_outcome_keeps_its_limit_when_its_reason_is_worded_anew() -> None:
    met = Outcome(MissionState.TIMEOUT, LimitMet("dauerte zu lange", "--timeout", 30.0))
    assert met.limit == ("--timeout", 30.0)
    assert replace(met, reason=met.reason.replace("dauerte", "war")).limit == ("--timeout", 30.0)
    record = attempt_record(met)
    assert (record["limit_option"], record["limit_value"], record["no_log"]) == ("--timeout", 30.0, False)
    assert Outcome(MissionState.CRASHED, "took longer than 3 s; allow more with --timeout").limit is None


@pytest.mark.parametrize(
    ("state", "reason"),
    [
        (MissionState.TIMEOUT, over_time(Limits(wall_s=30.0))),
        (MissionState.OUT_OF_MEMORY, over_memory(Limits(memory_mb=500.0), "in reading")),
    ],
)
def test_the_words_of_earlier_versions_say_the_same(state: MissionState, reason: str) -> None:
    assert limit_in_words(state, str(reason)) == Outcome(state, reason).limit


def test_a_row_of_an_earlier_version_is_read_by_its_sentence() -> None:
    old = {"state": "timeout", "reason": "took longer than 30 s; allow more with --timeout"}
    assert limit_of_row(row(**old)) == ("--timeout", 30.0)
    assert limit_of_row(row(**old, limit_option=None, limit_value=None, no_log=None)) == ("--timeout", 30.0)
    assert limit_of_row(row(**old, limit_option=None, limit_value=None, no_log=0)) is None
    assert limit_of_row(row(state="timeout", reason="", limit_option="--cpu", limit_value=9.0, no_log=0)) == (
        "--cpu",
        9.0,
    )
