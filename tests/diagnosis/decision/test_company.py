"""A row is believed by what else the mission shows, and whether anything is wrong becomes no less probable by it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import pytest

from diagnosis.decision.company import Told, believed_in_company, features_of, in_company
from diagnosis.decision.intervals import intervals_of
from diagnosis.results.assessment import Finding
from diagnosis.results.machine_words import HYDRAULIC
from diagnosis.results.result import FaultInterval, Hypothesis
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side
from tests.diagnosis.decision.findings import MACHINE, STEP, assessed, finding, machine

LOSS = ("actuator", "inefficient")


def loss(start: int, stop: int, p: float = 0.7, tier: Tier = Tier.MODEL) -> Finding:
    """A valve's loss that may be none, or a stuck valve."""
    rest = (Hypothesis("actuator", "stuck", 0.2 * (1.0 - p)), Hypothesis("none", "healthy", 0.8 * (1.0 - p)))
    found = finding(Side.ACTUATOR, FaultMode.INEFFICIENT, start, stop, epsilon=0.4, p=p)
    return replace(found, hypotheses=(Hypothesis(*LOSS, p), *rest), tier=tier)


def told(*own: Finding, other: Sequence[Finding] = ()) -> tuple[FaultInterval, ...]:
    """Faults of the FR valve, worst first, beside those of another wheel's sensor."""
    parts = machine(FR_actuator=assessed(*own), FL_sensor=assessed(*other))
    return tuple(f for f in intervals_of(parts, MACHINE, HYDRAULIC, 0, STEP) if f.component == "FR")


def p_of(fault: FaultInterval, *row: str) -> float:
    return sum(h.p for h in fault.hypotheses if (h.side, h.mode) == row)


def test_a_row_that_comes_again_and_alone_is_believed_more_up_to_what_is_not_sure() -> None:
    [single] = told(loss(1000, 4000))
    again = told(loss(1000, 4000), loss(6000, 9000), loss(11_000, 14_000))
    assert all(f.probability == pytest.approx(0.89) for f in again)
    assert single.probability < 0.75
    assert "nothing else found on the machine, three times or more" in " ".join(again[0].evidence)
    assert len(again[0].about) == len(again[0].evidence)
    assert sum(h.p for h in again[0].hypotheses) == pytest.approx(1.0)
    assert p_of(again[0], "actuator", "stuck") == pytest.approx(0.2 * 0.11)
    assert again[0].severity == single.severity


def test_beside_another_part_a_row_is_believed_less_and_that_something_is_wrong_as_much() -> None:
    [beside] = told(loss(1000, 4000), other=[finding(Side.SENSOR, FaultMode.NOISY, 500, 9000, epsilon=0.3)])
    assert beside.probability == pytest.approx(believed_in_company(0.7, features_of(*_two())))
    assert p_of(beside, "none", "healthy") == pytest.approx(0.8 * 0.3)
    assert p_of(beside, *LOSS) + p_of(beside, "actuator", "outside_table") == pytest.approx(0.7)
    assert p_of(beside, *LOSS) >= p_of(beside, "actuator", "outside_table")
    assert "beside faults of other parts" in " ".join(beside.evidence)


def _two() -> tuple[Told, list[Told]]:
    own = Told("FR", "actuator inefficient", 3.0)
    return own, [own, Told("FL", "sensor noisy", 8.5)]


def test_what_is_lost_makes_no_other_row_the_more_probable_one() -> None:
    [brief] = told(loss(1000, 1400, p=0.62), other=[finding(Side.SENSOR, FaultMode.NOISY, 500, 9000, epsilon=0.3)])
    assert brief.probability == pytest.approx(0.31)
    assert brief.hypotheses[0].p == pytest.approx(0.31)
    [healthier] = told(loss(1000, 1400, p=0.55), other=[finding(Side.SENSOR, FaultMode.NOISY, 500, 9000, epsilon=0.3)])
    assert healthier.probability == p_of(healthier, "none", "healthy") == pytest.approx(0.36)


@pytest.mark.parametrize("unlike", [{"p": 0.95}, {"tier": Tier.RESPONSE}, {"tier": Tier.SIGNAL}])
def test_what_is_sure_or_of_other_evidence_stays(unlike: dict[str, float | Tier]) -> None:
    again = [loss(start, start + 3000, **{"p": 0.7, **unlike}) for start in (1000, 6000, 11_000)]  # type: ignore[arg-type]
    assert [f.probability for f in told(*again)] == [f.probability for f in again]


def test_what_is_not_worth_an_action_is_no_company_and_stays_itself() -> None:
    doubtful = loss(1000, 4000, p=0.4)
    faults = told(doubtful, loss(6000, 9000))
    assert [f.probability for f in faults if f.severity == "info"] == [0.4]
    assert in_company(()) == ()
