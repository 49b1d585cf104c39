"""Which of two speeds that differ by a share is off, by the opening of the drive."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.direct.identification import IdentifiedPair
from diagnosis.direct.second_scaled import without_second_speeds_scale
from diagnosis.estimation.lag import low_passed
from diagnosis.results.assessment import CODE, Assessment, Finding, Lack
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side, State

Array = NDArray[np.float64]
DT, SIZE, START, STOP = 0.01, 6000, 2000, 4000
T = np.arange(SIZE) * DT
OPENING = 0.5 * np.sign(np.sin(T / 4.0)) + 0.2 * np.sin(T / 1.3)
INSIDE = (np.arange(SIZE) >= START) & (np.arange(SIZE) < STOP)


def _speed(opening: Array) -> Array:
    """Of a drive with a dead band of .05."""
    late = low_passed(opening, 0.2, DT)
    return 1.5 * np.sign(late) * np.maximum(np.abs(late) - 0.05, 0.0)


def _told(y: Array, x: Array, opening: Array = OPENING) -> Assessment:
    """What is left of a finding that the one is a share of the other."""
    noise = 0.004 * np.random.default_rng(4).standard_normal((2, SIZE))
    pair = SimpleNamespace(y=y + noise[0], x=x + noise[1], dt=DT, y_name="wheel.RL.v", x_name="wheel.RL.v_true")
    states = np.full(SIZE, CODE[State.HEALTHY])
    states[START:STOP] = CODE[State.OUTSIDE_TABLE]
    finding = Finding(START, STOP, Side.SENSOR, FaultMode.OUTSIDE_TABLE, 0.96, (), None, None, (), Tier.DIRECT)
    a = Assessment(states, findings=(finding,), tier=Tier.DIRECT)
    one = cast(IdentifiedPair, SimpleNamespace(pair=pair))
    return without_second_speeds_scale({"RL": one}, {"RL": a}, {"RL": opening})["RL"]


@pytest.mark.parametrize("share", [0.0, 0.6, 1.5])
def test_a_second_speed_of_another_share_is_no_fault_of_the_sensor(share: float) -> None:
    true = _speed(OPENING)
    left = _told(true, np.where(INSIDE, share * true, true))
    assert left.findings == ()
    assert (left.states[START:STOP] == CODE[State.NOT_ASSESSED]).all()
    assert left.lacks[State.NOT_ASSESSED] is Lack.SECOND_OFF
    assert "from 20.0 to 40.0 s the second speed, wheel.RL.v_true" in left.reasons[State.NOT_ASSESSED]


@pytest.mark.parametrize("share", [0.6, 1.67])
@pytest.mark.parametrize("loop", [False, True])
def test_a_sensor_that_reads_a_share_stays_a_fault_whether_its_loop_believes_it(share: float, *, loop: bool) -> None:
    opening = np.where(INSIDE & loop, OPENING / share, OPENING)
    true = _speed(opening)
    assert len(_told(np.where(INSIDE, share * true, true), true, opening).findings) == 1


def test_an_opening_that_says_nothing_of_the_speed_decides_nothing() -> None:
    true = np.random.default_rng(1).permutation(_speed(OPENING))
    assert len(_told(true, np.where(INSIDE, 0.6 * true, true)).findings) == 1
