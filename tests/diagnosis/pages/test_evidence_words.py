from __future__ import annotations

import pytest

from diagnosis.pages.evidence_words import how_decided, tier_name
from diagnosis.results.vocabulary import Kind, Tier
from replay.faults import Side


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
    assert tier_name(kind, tier) == words


def test_how_a_fault_was_decided() -> None:
    assert how_decided(Kind.STEER, Side.SENSOR, Tier.DIRECT) == "measured against a second angle sensor"
    assert how_decided(Kind.STEER, Side.ACTUATOR, Tier.MODEL) == "by the steering model, without a second measurement"
    assert how_decided(Kind.WHEEL, Side.SENSOR_OR_ACTUATOR, Tier.DIRECT) == ""


@pytest.mark.parametrize("tier", Tier)
@pytest.mark.parametrize("kind", Kind)
def test_every_tier_has_words(kind: Kind, tier: Tier) -> None:
    assert bool(tier_name(kind, tier)) == (tier is not Tier.NONE)
    assert bool(how_decided(kind, Side.SENSOR, tier)) == (tier is not Tier.NONE)
