"""A loss that comes and goes within one finding is a loss, and noise stays noise."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.estimation.changing_gain import as_changing_gain
from diagnosis.estimation.simple_causes import Measured
from diagnosis.results.assessment import Finding
from diagnosis.results.result import Epsilon, Hypothesis
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side

Array = NDArray[np.float64]
DT, SIZE = 0.01, 2000
TIME = np.arange(SIZE) * DT
COMMAND = 0.5 * np.sin(1.3 * TIME)
FADES = 1.0 - 0.6 * np.interp(TIME, [2.0, 12.0, 12.5, 20.0], [0.0, 1.0, 0.1, 0.1])


def told(y: Array, x: Array = COMMAND, mode: FaultMode = FaultMode.NOISY) -> Finding:
    """What is left of a finding of noise on a valve that opens to y where it is told x."""
    y = y + 0.003 * np.random.default_rng(3).standard_normal(SIZE)
    measured = Measured(y, x, np.ones(SIZE, np.bool_), DT, ("opening", "command"), "1", 0.003, 0.02)
    row = (Hypothesis(Side.ACTUATOR.value, mode.value, 0.98),)
    finding = Finding(0, SIZE, Side.ACTUATOR, mode, 0.98, row, Epsilon(0.05, 0.0, 0.2), None, (), Tier.DIRECT, 3)
    return as_changing_gain(finding, measured)


def test_a_share_that_falls_and_returns_is_a_loss_with_bounds_over_all_of_it() -> None:
    after = told(FADES * COMMAND)
    assert (after.mode, after.probability) == (FaultMode.INEFFICIENT, 0.8)
    assert after.epsilon is not None
    assert after.epsilon.low < 0.05
    assert after.epsilon.high > 0.55
    assert sum(h.p for h in after.hypotheses) == pytest.approx(1.0)


def test_it_begins_where_a_share_is_lost() -> None:
    after = told(np.where(TIME > 8.0, 0.65, 1.02) * COMMAND)
    assert after.mode is FaultMode.INEFFICIENT
    assert 7.0 <= after.start * DT <= 8.5
    assert after.detected is None  # what was seen before was none of it
    assert after.epsilon is not None
    assert after.epsilon.low < 0.35 < after.epsilon.high


def test_beside_a_command_that_rests_an_offset_may_be_it_as_well() -> None:
    after = told(FADES * 0.4, np.full(SIZE, 0.4))
    assert {h.mode: h.p for h in after.hypotheses} == pytest.approx(
        {"inefficient": 0.5, "outside_table": 0.4, "noisy": 0.1}
    )


@pytest.mark.parametrize(
    "y",
    [
        COMMAND + 0.1 * np.sin(4.0 * TIME),  # no share of its command
        COMMAND * (1.0 + 0.3 * np.sin(0.5 * TIME)),  # more than all of it
        COMMAND * (0.8 + 0.15 * np.sin(5.0 * TIME)),  # that comes and goes quickly
        0.8 * COMMAND,  # a share that stays
    ],
)
def test_what_is_no_share_that_changes_slowly_stays_what_it_was(y: Array) -> None:
    assert told(y).mode is FaultMode.NOISY


def test_other_rows_stay() -> None:
    assert told(FADES * COMMAND, mode=FaultMode.STUCK).mode is FaultMode.STUCK


@pytest.mark.parametrize("seed", range(6))
def test_noise_of_a_second_beside_a_loss_stays_noise(seed: int) -> None:
    """Every second of it is nearly a share of the command; but one share leaves little more."""
    rng, keep = np.random.default_rng(seed), np.exp(-DT / 0.8)
    slow = np.zeros(SIZE)
    for i, z in enumerate(rng.standard_normal(SIZE)[1:], 1):
        slow[i] = keep * slow[i - 1] + np.sqrt(1.0 - keep**2) * z
    after = told(0.6 * COMMAND * (1.0 + 0.12 * slow), COMMAND)
    assert after.mode is FaultMode.NOISY
