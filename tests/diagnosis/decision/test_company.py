"""A row is believed by what else the mission shows: more where it comes again and alone, and never less than it was stated."""

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
    assert "no other part failed at the same time, three times or more" in " ".join(again[0].evidence)
    assert len(again[0].about) == len(again[0].evidence)
    assert sum(h.p for h in again[0].hypotheses) == pytest.approx(1.0)
    assert p_of(again[0], "actuator", "stuck") == pytest.approx(0.2 * 0.11)
    assert again[0].severity == single.severity


def test_while_another_part_fails_a_row_stays_as_it_was_stated() -> None:
    long = loss(1000, 14_000)
    assert told(long)[0].probability > 0.75
    assert told(long, other=[finding(Side.SENSOR, FaultMode.NOISY, 500, 9000, epsilon=0.3)])[0].probability == 0.7
    late = told(long, other=[finding(Side.SENSOR, FaultMode.NOISY, 16_000, 19_000, epsilon=0.3)])[0]
    assert late.probability == pytest.approx(told(long)[0].probability)


def test_what_it_is_made_of() -> None:
    own, far = Told("FR", "actuator inefficient", 1.0, 4.0), Told("FL", "sensor noisy", 6.0, 8.5)
    assert features_of(own, [own, far]).tolist() == [0.0, 0.0, 0.0, 0.0]
    near = far._replace(start_s=4.5)
    assert features_of(own, [own, near, own, own]).tolist() == [1.0, 1.0, 0.0, 0.0]
    assert features_of(own._replace(stop_s=2.0), [own]).tolist() == [0.0, 0.0, 1.0, 0.0]
    assert believed_in_company(0.7, features_of(own, [own, near])) == 0.7


@pytest.mark.parametrize("unlike", [{"p": 0.95}, {"tier": Tier.RESPONSE}, {"tier": Tier.SIGNAL}])
def test_what_is_sure_or_of_other_evidence_stays(unlike: dict[str, float | Tier]) -> None:
    again = [loss(start, start + 3000, **{"p": 0.7, **unlike}) for start in (1000, 6000, 11_000)]  # type: ignore[arg-type]
    assert [f.probability for f in told(*again)] == [f.probability for f in again]


def test_what_is_not_worth_an_action_is_no_company_and_stays_itself() -> None:
    doubtful = loss(1000, 4000, p=0.4)
    faults = told(doubtful, loss(6000, 9000))
    assert [f.probability for f in faults if f.severity == "info"] == [0.4]
    assert in_company(()) == ()
