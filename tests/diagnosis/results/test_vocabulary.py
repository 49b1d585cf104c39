"""Ranks and words of the diagnosis."""

from __future__ import annotations

from diagnosis.results.vocabulary import Kind, Severity, Tier, Verdict, part_words
from replay.faults import Side, State


def test_ranks_follow_the_order_of_the_members() -> None:
    for words in (Severity, Verdict, Tier):
        assert [member.rank for member in words] == list(range(len(words)))  # type: ignore[attr-defined]
    assert Severity.HIGH.rank > Severity.MEDIUM.rank > Severity.LOW.rank > Severity.INFO.rank
    assert Verdict.STOP.rank > Verdict.WATCH.rank > Verdict.READY.rank


def test_every_member_has_words() -> None:
    assert all(v.label and v.symbol in set(State) for v in Verdict)
    assert all(t.words for t in Tier)


def test_parts_are_named_by_kind_and_side() -> None:
    for side in Side:
        assert part_words(Kind.WHEEL, "FR", side).startswith("FR ")
        assert "steering" in part_words(Kind.STEER, "front", side)
    assert part_words(Kind.WHEEL, "FR", "sensor_or_actuator") == "FR speed sensor or drive valve"
    assert part_words("crane", "boom", "hook_side") == "boom hook side"
