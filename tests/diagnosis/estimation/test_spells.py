"""Spells of a loss that a valve with hysteresis hides in one long noise are losses; a disturbance stays one."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.estimation.simple_causes import Measured
from diagnosis.estimation.spells import in_spells
from diagnosis.results.assessment import Finding
from diagnosis.results.result import Epsilon, Hypothesis
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side

Array = NDArray[np.float64]
DT, SIZE = 0.01, 4000
TIME = np.arange(SIZE) * DT
COMMAND = 0.4 * np.sin(1.3 * TIME) + 0.2 * np.sin(0.41 * TIME)
HYSTERESIS = 0.004 * np.sign(np.gradient(COMMAND))
SPELLS = ((5.0, 8.0), (20.0, 23.0))
INSIDE = np.any([(a <= TIME) & (b > TIME) for a, b in SPELLS], axis=0)


def told(y: Array, start: float = 0.0, stop: float = 30.0, mode: FaultMode = FaultMode.NOISY) -> list[Finding]:
    """What is left of a finding from start to stop [s] on a valve that opens to y."""
    y = y + 0.001 * np.random.default_rng(3).standard_normal(SIZE)
    measured = Measured(y, COMMAND, np.ones(SIZE, np.bool_), DT, ("opening", "command"), "1", 0.001, 0.02)
    row = (Hypothesis(Side.ACTUATOR.value, mode.value, 0.98),)
    span = round(start / DT), round(stop / DT)
    return in_spells(
        Finding(*span, Side.ACTUATOR, mode, 0.98, row, Epsilon(0.1, 0.0, 0.2), None, (), Tier.DIRECT, 510), measured
    )


@pytest.mark.parametrize("left", [0.5, 0.75])
def test_each_spell_is_a_loss_of_its_own(left: float) -> None:
    found = told(np.where(INSIDE, left, 1.0) * (COMMAND + HYSTERESIS))
    assert [f.mode for f in found] == [FaultMode.INEFFICIENT] * 2
    assert np.array([(f.start * DT, f.stop * DT) for f in found]) == pytest.approx(np.array(SPELLS), abs=0.3)
    assert [f.detected for f in found] == [510, None]
    for f in found:
        assert f.epsilon is not None
        assert f.epsilon.low <= 1.0 - left <= f.epsilon.high
        assert sum(h.p for h in f.hypotheses) == pytest.approx(1.0)


def test_a_spell_that_ends_the_finding_begins_where_it_does() -> None:
    (found,) = told(np.where((TIME > 20.0) & (TIME < 30.0), 0.7, 1.0) * (COMMAND + HYSTERESIS), 15.0, 30.0)
    assert (found.start * DT, found.stop * DT) == pytest.approx((20.0, 30.0), abs=0.3)


@pytest.mark.parametrize(
    "y",
    [
        COMMAND + HYSTERESIS + 0.05 * INSIDE * np.sin(7.0 * TIME),  # no share
        np.where(INSIDE, 0.6, 1.0) * COMMAND + HYSTERESIS + 0.05 * INSIDE * np.sin(7.0 * TIME),  # and shaken
        np.where(INSIDE, 0.0, 1.0) * COMMAND + HYSTERESIS,  # nothing is left
        COMMAND
        + HYSTERESIS
        + 0.03 * np.sin(2.0 * TIME)
        + 0.1 * INSIDE * np.sin(5.0 * TIME),  # it varies between as well
        0.6 * COMMAND + HYSTERESIS,  # it follows nowhere
        np.where(INSIDE, 0.5, 1.0) * COMMAND
        + HYSTERESIS
        + (TIME > 12.0) * (TIME < 14.0) * (0.1 * np.sin(9.0 * TIME) - 0.4 * COMMAND),
    ],
)
def test_what_else_varies_is_left(y: Array) -> None:
    (found,) = told(y)
    assert (found.mode, found.start, found.stop) == (FaultMode.NOISY, 0, 3000)


def test_other_rows_are_left() -> None:
    (found,) = told(np.where(INSIDE, 0.5, 1.0) * COMMAND, mode=FaultMode.STUCK)
    assert found.mode is FaultMode.STUCK
