"""What is found of a wheel without a drive is its speed sensor's, unless the wheel is held."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.results.assessment import CODE, Assessment, Finding
from diagnosis.results.free_wheels import ROLLS_P, only_rolls
from diagnosis.results.result import Hypothesis
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side, State

MODE = FaultMode.NO_SIGNAL
STATES = np.full(100, CODE[State.HEALTHY], np.int8)


def found(side: Side, *hypotheses: Hypothesis) -> Finding:
    p = hypotheses[0].p
    return Finding(10, 50, side, MODE, p, hypotheses, None, None, ("It read 0.",), Tier.RESPONSE)


def test_either_side_is_the_sensor_and_the_rest_holds_the_wheel() -> None:
    both = found(
        Side.SENSOR_OR_ACTUATOR, Hypothesis("sensor_or_actuator", MODE, 0.9), Hypothesis("none", "healthy", 0.1)
    )
    (f,) = only_rolls(Assessment(STATES, findings=(both,))).findings
    assert f.side is Side.SENSOR
    assert f.probability == pytest.approx(0.9 * ROLLS_P)
    assert sum(h.p for h in f.hypotheses) == pytest.approx(1.0)
    assert {h.side for h in f.hypotheses} == {"sensor", "none"}
    assert "has no drive" in f.evidence[-1]


def test_a_surer_sensor_loses_nothing() -> None:
    sure = found(
        Side.SENSOR, Hypothesis("sensor", MODE, 0.95), Hypothesis("actuator", MODE, 0.03), Hypothesis("none", "healthy", 0.02)
    )  # fmt: skip
    (f,) = only_rolls(Assessment(STATES, findings=(sure,))).findings
    assert f.probability == pytest.approx(0.95)
    assert all(h.side != "actuator" for h in f.hypotheses)


def test_a_fault_of_its_drive_alone_is_none_and_leaves_it_open() -> None:
    drive = found(Side.ACTUATOR, Hypothesis("actuator", MODE, 0.9), Hypothesis("none", "healthy", 0.1))
    a = only_rolls(Assessment(STATES, findings=(drive,)))
    assert not a.findings
    assert (a.states[10:50] == CODE[State.NOT_ASSESSED]).all()
    assert (a.states[:10] == CODE[State.HEALTHY]).all()


def test_what_is_the_sensors_alone_stays_as_it_is() -> None:
    own = Assessment(STATES, findings=(found(Side.SENSOR, Hypothesis("sensor", MODE, 0.96)),))
    assert only_rolls(own) is own
    empty = replace(own, findings=())
    assert only_rolls(empty) is empty
