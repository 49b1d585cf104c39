"""Ranks and words of the diagnosis."""

from __future__ import annotations

import pytest

from diagnosis.results.machine_words import HYDRAULIC
from diagnosis.results.vocabulary import Kind, Severity, Tier, Verdict
from replay.faults import Side, State


def test_ranks_follow_the_order_of_the_members() -> None:
    for words in (Severity, Verdict, Tier):
        assert [member.rank for member in words] == list(range(len(words)))  # type: ignore[attr-defined]
    assert Severity.HIGH.rank > Severity.MEDIUM.rank > Severity.LOW.rank > Severity.INFO.rank
    assert Verdict.STOP.rank > Verdict.WATCH.rank > Verdict.READY.rank


def test_a_stronger_tier_stands_before_a_weaker_one() -> None:
    strengths = [tier.strength for tier in Tier]
    assert strengths == sorted(strengths, reverse=True)
    assert [tier for tier in Tier if tier.strength == 0] == [Tier.NONE]


def test_every_member_has_words() -> None:
    assert all(v.label and v.symbol in set(State) for v in Verdict)
    assert all(t.words for t in Tier)


def test_parts_are_named_by_kind_and_side() -> None:
    for side in Side:
        assert HYDRAULIC.part_words(Kind.WHEEL, "FR", side).startswith("FR ")
        assert "steering" in HYDRAULIC.part_words(Kind.STEER, "front", side)
    assert HYDRAULIC.part_words(Kind.WHEEL, "FR", "sensor_or_actuator") == "FR speed sensor or drive valve"
    assert HYDRAULIC.part_words("crane", "boom", "hook_side") == "boom hook side"


@pytest.mark.parametrize(
    ("kind", "tier", "words"),
    [
        (Kind.WHEEL, Tier.DIRECT, "second measurement"),
        (Kind.WHEEL, Tier.MODEL, "wheel model"),
        (Kind.STEER, Tier.MODEL, "steering model"),
        (Kind.WHEEL, Tier.SIGNAL, "channel alone"),
        (Kind.WHEEL, Tier.TRACKING, "command tracking"),
        (Kind.WHEEL, Tier.DRIVE, "drive model"),
        (Kind.WHEEL, Tier.NONE, ""),
    ],
)
def test_plain_words_for_the_kind_of_evidence(kind: Kind, tier: Tier, words: str) -> None:
    assert HYDRAULIC.evidence(tier, kind) == words


def test_how_a_fault_was_decided() -> None:
    assert HYDRAULIC.decided(Tier.DIRECT, Kind.STEER, Side.SENSOR) == "measured against a second angle sensor"
    assert (
        HYDRAULIC.decided(Tier.MODEL, Kind.STEER, Side.ACTUATOR) == "by the steering model, not by a second measurement"
    )
    assert HYDRAULIC.decided(Tier.DIRECT, Kind.WHEEL, Side.SENSOR_OR_ACTUATOR) == ""
    with_second = "by the steering model with a second angle sensor"
    assert HYDRAULIC.decided(Tier.SIGNAL, Kind.STEER, Side.SENSOR, twice=True) == with_second
    assert f"by the {HYDRAULIC.evidence(Tier.SIGNAL, Kind.STEER, Side.SENSOR)}" == with_second


@pytest.mark.parametrize("tier", Tier)
@pytest.mark.parametrize("kind", Kind)
def test_every_tier_has_words(kind: Kind, tier: Tier) -> None:
    assert bool(tier.name_of(kind)) == (tier is not Tier.NONE)
    assert bool(tier.decided(kind, Side.SENSOR)) == (tier is not Tier.NONE)
