"""A channel that is late elsewhere in a mission, and off by what that delay makes of one move, is late there too."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.estimation.one_delay import late_s, with_one_delay
from diagnosis.estimation.simple_causes import Measured
from diagnosis.results.assessment import Finding
from diagnosis.results.result import Hypothesis
from diagnosis.results.sentence import About, Sentence
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side

DT, LATE = 0.01, 0.5
LATER = Sentence(About.LATE, "It comes ", "500", " ms after u: a delay.")


def moves() -> NDArray[np.float64]:
    """A command that moves all the time, rests from 20 to 24 s, and moves at once."""
    t = np.arange(0.0, 40.0, DT)
    x = 0.4 * np.sin(0.9 * t)
    x[2000:2400] = 0.3
    x[2400:2500] = -0.2
    return x


def measured(y: NDArray[np.float64], x: NDArray[np.float64]) -> Measured:
    return Measured(y, x, np.ones(x.size, np.bool_), DT, ("u_applied", "u"), "1", 0.003, 0.02)


def finding(start: int, stop: int, mode: FaultMode, *evidence: str) -> Finding:
    p = (Hypothesis("actuator", mode.value, 0.92), Hypothesis("actuator", "noisy", 0.08))
    return Finding(start, stop, Side.ACTUATOR, mode, 0.92, p, None, None, evidence, Tier.DIRECT)


@pytest.mark.parametrize("sticks", [False, True])
def test_a_rest_before_a_late_answer_is_no_stuck_valve(sticks: bool) -> None:
    x = moves()
    y = np.r_[np.full(round(LATE / DT), x[0]), x[: -round(LATE / DT)]]
    stop = 2600 if sticks else 2450
    if sticks:
        y[2000:2600] = y[2000]
    found = [
        finding(200, 1500, FaultMode.OUTSIDE_TABLE, LATER),
        finding(2100, stop, FaultMode.STUCK),
        finding(3000, 3900, FaultMode.OUTSIDE_TABLE, LATER),
    ]
    told = with_one_delay(found, measured(y, x))
    assert told[1].mode is (FaultMode.STUCK if sticks else FaultMode.OUTSIDE_TABLE)
    if not sticks:
        assert late_s(told[1]) == LATE
        assert told[1].probability == pytest.approx(0.95)
        assert sum(h.p for h in told[1].hypotheses) == pytest.approx(1.0)


def test_one_brief_delay_explains_nothing_of_a_longer_fault() -> None:
    x = moves()
    y = np.r_[np.full(round(LATE / DT), x[0]), x[: -round(LATE / DT)]]
    brief = [finding(200, 260, FaultMode.OUTSIDE_TABLE, LATER), finding(2100, 2450, FaultMode.STUCK)]
    assert with_one_delay(brief, measured(y, x)) == brief
    other = [replace(f, mode=FaultMode.STUCK, evidence=()) for f in brief]
    assert with_one_delay(other, measured(y, x)) == other
