"""A valve that seems stuck while its wheel follows its command a constant apart: it is not stuck."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.results.assessment import Finding
from diagnosis.results.result import Hypothesis
from diagnosis.results.vocabulary import Tier
from diagnosis.wheels.findings import WheelFindings
from diagnosis.wheels.goes_along import off_by_a_constant
from replay.faults import FaultMode, Side

DT, SIZE, SPAN, NOISE = 0.01, 1200, 1.0, 0.005
ASKED = 0.3 + 0.1 * np.sin(np.arange(SIZE) * DT)
RUNS_AWAY = 0.3 + 0.05 * np.arange(SIZE) * DT  # what a loop asks of a wheel that does not follow
RNG = np.random.default_rng(4)


def finding(side: Side = Side.ACTUATOR, mode: FaultMode = FaultMode.STUCK) -> Finding:
    return Finding(
        start=0,
        stop=SIZE,
        side=side,
        mode=mode,
        probability=0.9,
        hypotheses=(Hypothesis(side.value, mode.value, 0.9), Hypothesis("none", "healthy", 0.1)),
        epsilon=None,
        sat=None,
        evidence=("It is seen.",),
        tier=Tier.MODEL,
    )


def judged(y: np.ndarray, expected: np.ndarray, f: Finding) -> Finding:
    noisy = y + RNG.normal(0.0, NOISE, SIZE)
    return off_by_a_constant(WheelFindings([f], {}, {}), noisy, expected, DT, SPAN, NOISE).findings[0]


@pytest.mark.parametrize("apart", [0.2, -0.15])
def test_a_wheel_that_follows_a_constant_apart_has_no_stuck_valve(apart: float) -> None:
    found = judged(ASKED + apart, ASKED, finding())
    assert (found.side, found.mode) == (Side.SENSOR_OR_ACTUATOR, FaultMode.OUTSIDE_TABLE)
    assert found.probability == pytest.approx(0.846)
    assert sum(h.p for h in found.hypotheses) == pytest.approx(1.0)
    assert "a constant apart" in found.evidence[0]


@pytest.mark.parametrize(
    ("y", "expected"),
    [
        (np.full(SIZE, 0.2), ASKED),  # stands at one speed
        (np.full(SIZE, 0.2), RUNS_AWAY),
        (0.7 * ASKED + 0.1, ASKED),  # dragged along by the others
        (ASKED + 0.2, np.full(SIZE, 0.3)),  # moves by itself
        (np.full(SIZE, 0.2), np.full(SIZE, np.nan)),
    ],
    ids=["asked to move", "its command runs away", "dragged", "moves by itself", "unknown"],
)
def test_what_does_not_follow_stays_stuck(y: np.ndarray, expected: np.ndarray) -> None:
    f = finding()
    assert judged(y, expected, f) is f


def test_other_rows_and_brief_ones_stay() -> None:
    for f in (finding(Side.SENSOR), finding(mode=FaultMode.NOISY)):
        assert judged(ASKED + 0.2, ASKED, f) is f
    brief = finding()
    brief = type(brief)(**{**brief.__dict__, "stop": round(2.5 / DT)})
    assert judged(ASKED + 0.2, ASKED, brief) is brief
