"""A residual that passes its threshold long before the stated onset is said, and what a healthy part is left beside overwhelming readings."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.decision.earlier_residuals import with_earlier_residuals
from diagnosis.decision.intervals import intervals_of
from diagnosis.results.assessment import Assessment
from diagnosis.results.machine_words import HYDRAULIC
from diagnosis.results.sentence import About, Sentence
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side
from tests.diagnosis.decision.findings import MACHINE, STEP, assessed, finding

DT, N = 0.005, 4000


def told(begins: int, *, tier: Tier = Tier.DIRECT, gap: int = 0) -> tuple[str, ...]:
    """What is said of a finding from 10 s on whose residual is large from a step on, but for a gap."""
    residual = np.zeros(N)
    residual[begins:2400] = 0.1
    if gap:
        residual[1600 : 1600 + gap] = 0.0
    columns = {"residual": residual, "threshold": np.full(N, 0.03)}
    found = finding(Side.ACTUATOR, FaultMode.NOISY, 2000, 2400)
    side = Assessment(np.zeros(N, np.int8), findings=(found,), tier=tier, columns=columns)
    ((one,),) = (a.findings for a in with_earlier_residuals({("FR", "actuator"): side}, DT).values())
    return one.evidence[1:]


def test_an_earlier_residual_is_said_with_its_time() -> None:
    assert told(1500) == (
        "Its residual is beyond its threshold from 7.50 s on, 2.50 s before the onset stated: it may have begun as early as that.",
    )
    assert "10.00" not in "".join(told(2000))
    assert "500 ms before" in told(1900)[0]


@pytest.mark.parametrize("begins", [1960, 2000, 2050])
def test_an_onset_that_agrees_needs_no_word(begins: int) -> None:
    assert told(begins) == ()


def test_pieces_that_are_apart_are_another_thing() -> None:
    assert "7.50 s on" in told(1500, gap=50)[0]
    assert "8.75 s on" in told(1500, gap=150)[0]
    assert told(1500, tier=Tier.MODEL) == ()


def test_what_is_left_for_a_healthy_part_is_explained() -> None:
    gain = Sentence(
        About.TIMES, "wheel.FR.u_applied is more than a million times as probable with this fault as without one."
    )
    doubtful = replace(finding(Side.ACTUATOR, FaultMode.NOISY, p=0.6), evidence=(gain, "Less probable."))
    sure = replace(doubtful, probability=0.95, hypotheses=(replace(doubtful.hypotheses[0], p=0.95),))
    for one, said in ((doubtful, True), (sure, False)):
        (f,) = intervals_of({("FR", "actuator"): assessed(one)}, MACHINE, HYDRAULIC, 0, STEP)
        text = "what else is said here of such findings leaves 40.0 % for a healthy part."
        assert any(text in e for e in f.evidence) is said
        assert len(f.about) == len(f.evidence)
