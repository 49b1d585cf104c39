"""Why a fault's size is not known, or open to a side."""

from __future__ import annotations

from dataclasses import replace

import pytest

from diagnosis.decision.size_notes import size_note
from diagnosis.results.result import Epsilon
from diagnosis.results.vocabulary import Kind, Tier
from replay.faults import FaultMode, Side
from tests.diagnosis.decision.findings import finding


@pytest.mark.parametrize(
    ("mode", "bounds", "tier", "words"),
    [
        (FaultMode.INEFFICIENT, (0.4, 0.3, 0.5), Tier.DIRECT, ""),
        (FaultMode.STUCK, (1.0, 1.0, 1.0), Tier.MODEL, ""),
        (FaultMode.STUCK, (1.0, 0.1, 1.0), Tier.MODEL, "By its row all is lost"),
        (FaultMode.INEFFICIENT, None, Tier.MODEL, "No ε̂ is stated: the readings do not tell how much is lost."),
        (FaultMode.NOISY, None, Tier.MODEL, "No ε̂ is stated: what varies does not tell"),
        (FaultMode.INEFFICIENT, (0.4, 0.0, 0.8), Tier.MODEL, "The lower bound of ε̂ is open, which speaks of the size alone: "),
        (FaultMode.NOISY, (0.7, 0.1, 1.0), Tier.MODEL, "The upper bound of ε̂ is open, so that all may be lost. Noise hides"),
        (FaultMode.INEFFICIENT, (0.5, 0.0, 1.0), Tier.DIRECT, "Neither bound of ε̂ says anything"),
    ],
)  # fmt: skip
def test_an_open_or_missing_size_has_its_reason(
    mode: FaultMode, bounds: tuple[float, float, float] | None, tier: Tier, words: str
) -> None:
    found = replace(finding(Side.SENSOR, mode), tier=tier)
    note = size_note(found, None if bounds is None else Epsilon(*bounds), Kind.WHEEL)
    assert note.startswith(words)
    assert bool(note) == bool(words)


@pytest.mark.parametrize(
    ("gains", "words"),
    [
        ("0.96 at first and 0.60 at last", "It grows: 4 % are lost at first, 40 % at last;"),
        ("0.66 at first and 0.60 at last", ""),
        ("0.60 at first and 0.96 at last", ""),
        ("0.70", ""),
    ],
)
def test_a_loss_that_grows_says_what_is_lost_at_last(gains: str, words: str) -> None:
    evidence = (f"wheel.FR.v is {gains} of wheel.FR.v_true all through it.",)
    found = replace(finding(Side.SENSOR, FaultMode.INEFFICIENT), tier=Tier.DIRECT, evidence=evidence)
    note = size_note(found, Epsilon(0.22, 0.05, 0.43), Kind.WHEEL)
    assert note.startswith(words)
    assert bool(note) == bool(words)
