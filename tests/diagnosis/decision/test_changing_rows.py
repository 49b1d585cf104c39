"""A chain of findings of many rows is one fault, whose row is as probable as its share of the time; other findings stay."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.decision.changing_rows import with_chains_as_one
from diagnosis.results.assessment import CODE, Assessment, Finding
from replay.faults import FaultMode, Side, State

from .findings import assessed, finding

DT = 0.001
ROWS = (FaultMode.NOISY, FaultMode.INEFFICIENT, FaultMode.NO_SIGNAL, FaultMode.INEFFICIENT, FaultMode.STUCK)


def chain(gap: int = 100, rows: tuple[FaultMode, ...] = ROWS) -> list[Finding]:
    """Pieces of 3 s."""
    places = [1_000 + k * (3_000 + gap) for k in range(len(rows))]
    return [finding(Side.ACTUATOR, m, a, a + 3_000, p=0.9, epsilon=0.4) for m, a in zip(rows, places, strict=True)]


def told(*findings: Finding) -> Assessment:
    return with_chains_as_one({("FR", "actuator"): assessed(*findings)}, DT)["FR", "actuator"]


def test_pieces_of_many_rows_that_touch_are_one_fault_of_no_clear_row() -> None:
    pieces = chain()
    after = told(*pieces)
    (one,) = after.findings
    assert (one.start, one.stop, one.mode) == (pieces[0].start, pieces[-1].stop, FaultMode.INEFFICIENT)
    assert one.probability == pytest.approx(0.36)
    assert sum(h.p for h in one.hypotheses) == pytest.approx(1.0)
    assert one.evidence[0].startswith("5 pieces that touch look like 4 rows in turn")
    assert one.evidence[1] == "What follows is of the longest of them, 1.0–4.0 s."
    assert one.epsilon is not None
    assert one.epsilon.low <= one.epsilon.value <= one.epsilon.high
    assert np.count_nonzero(after.states == CODE[State.INEFFICIENT]) == 5 * 3_000


def test_a_total_row_gives_no_size() -> None:
    (one,) = told(*chain(rows=(FaultMode.STUCK, FaultMode.NOISY, FaultMode.STUCK, FaultMode.NO_SIGNAL))).findings
    assert one.mode is FaultMode.STUCK
    assert one.epsilon is None


@pytest.mark.parametrize(
    "pieces",
    [
        chain(gap=1_000),  # something between
        chain(rows=ROWS[:3]),  # may be as many faults
        chain(rows=(FaultMode.INEFFICIENT,) * 5),
        chain(rows=(FaultMode.INEFFICIENT, FaultMode.INEFFICIENT, FaultMode.INEFFICIENT, FaultMode.NOISY)),
    ],
)
def test_other_findings_stay(pieces: list[Finding]) -> None:
    assert list(told(*pieces).findings) == pieces
