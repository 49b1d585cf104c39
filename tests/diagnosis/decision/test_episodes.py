"""Pieces of one fault are one fault; faults with healthy time between them are not."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from diagnosis.decision.episodes import with_episodes
from diagnosis.results.assessment import CODE, Assessment, Finding
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side, State
from tests.diagnosis.decision.findings import N, finding

DT = 0.001


def parts(*findings: Finding, between: State = State.NOT_ASSESSED) -> dict[tuple[str, str], Assessment]:
    states = np.full(N, CODE[State.HEALTHY])
    for a, b in pairwise(findings):
        states[a.stop : b.start] = CODE[between]
    for f in findings:
        states[f.start : f.stop] = CODE[State(f.mode.value)]
    side = Assessment(states=states, findings=findings, tier=Tier.MODEL)
    both = findings[0].side is Side.SENSOR_OR_ACTUATOR
    sides = ("sensor", "actuator") if both else (findings[0].side.value,)
    return {("FR", s): side for s in sides}


def joined(*findings: Finding, between: State = State.NOT_ASSESSED) -> tuple[Finding, ...]:
    found = with_episodes(parts(*findings, between=between), DT)
    assert len({a.findings for a in found.values()}) == 1
    return next(iter(found.values())).findings


def loss(start: int, stop: int, epsilon: float = 0.25, side: Side = Side.ACTUATOR) -> Finding:
    return finding(side, FaultMode.INEFFICIENT, start, stop, epsilon=epsilon)


@pytest.mark.parametrize("side", list(Side))
def test_pieces_of_one_loss_are_one_fault(side: Side) -> None:
    (one,) = joined(*(loss(a, a + 500, side=side) for a in (1000, 3000, 6000)))
    assert (one.start, one.stop) == (1000, 6500)
    assert one.epsilon is not None
    assert one.epsilon.value == pytest.approx(0.25)
    assert "3 stretches (1.0–1.5 s, 3.0–3.5 s, 6.0–6.5 s)" in one.evidence[-1]


def test_healthy_time_between_makes_two_faults() -> None:
    assert len(joined(loss(1000, 1500), loss(3000, 3500), between=State.HEALTHY)) == 2


def test_losses_of_another_size_are_another_fault() -> None:
    assert len(joined(loss(1000, 1500, 0.2), loss(3000, 3500, 0.6))) == 2


def test_other_rows_are_other_faults() -> None:
    stuck = finding(Side.ACTUATOR, FaultMode.STUCK, 3000, 3500)
    assert len(joined(loss(1000, 1500), stuck, loss(6000, 6500))) == 3


def test_a_single_fault_stays_as_it_is() -> None:
    one = loss(1000, 1500)
    assert joined(one)[0] is one


def test_a_sentence_gives_the_probability_of_the_whole() -> None:
    said = "on simulated machines with such signals it was this in 38 of 100 cases."
    (one,) = joined(replace(loss(1000, 1500), probability=0.89, evidence=(said, "Next best: 7 of 100.")))
    assert one.evidence == (said.replace("38", "89"), "Next best: 7 of 100.")
