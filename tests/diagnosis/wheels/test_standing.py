"""A dead speed sensor reads what one of a standing wheel reads, where sensors hold their last reading and then read 0."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.results.assessment import Finding
from diagnosis.results.result import Hypothesis
from diagnosis.results.sentence import About, Sentence
from diagnosis.results.vocabulary import Tier
from diagnosis.wheels.findings import WheelFindings
from diagnosis.wheels.standing import or_standing
from replay.faults import FaultMode, Side

Array = NDArray[np.float64]
DT, SIZE = 0.02, 3000
ROWS = (Hypothesis("sensor", "no_signal", 0.96), Hypothesis("none", "healthy", 0.04))
JUMPS = Sentence(About.ONSET, "A sensor can do this, a wheel cannot.")


def driven(stops: int = 4) -> Array:
    """A speed of about 1 m/s, with stops at which it is held at 0.14 m/s before it reads 0."""
    y = 1.0 + 0.1 * np.sin(np.arange(SIZE) * DT)
    for k in range(stops):
        start = 100 + 250 * k
        y[start : start + 40] = np.linspace(1.0, 0.14, 40)
        y[start + 40 : start + 80] = 0.0
        y[start + 80 : start + 120] = np.linspace(0.14, 1.0, 40)
    return y


def told(y: Array, part: tuple[int, int], *, measured: bool = False, mode: FaultMode = FaultMode.NO_SIGNAL) -> Finding:
    finding = Finding(*part, Side.SENSOR, mode, 0.96, ROWS, None, None, ("More probable.", JUMPS), Tier.MODEL)
    flags = {side: np.zeros(SIZE, np.bool_) for side in (Side.SENSOR, Side.ACTUATOR)}
    found = {0: WheelFindings([finding], flags, flags)}
    (after,) = or_standing(found, {0: y, 1: driven()}, {0: measured, 1: measured}, DT)[0].findings
    return after


def standing(y: Array) -> Array:
    """A wheel that comes to rest as at a stop, and goes on all at once."""
    y = y.copy()
    y[1960:2000] = np.linspace(1.0, 0.14, 40)
    y[2000:2500] = 0.0
    y[2500:2504] = (0.9, 1.8, 2.6, 3.0)
    return y


def dead(y: Array) -> Array:
    """A sensor that gives nothing for a while, at speed."""
    y = y.copy()
    y[2000:2500] = 0.0
    return y


def test_readings_that_end_as_at_a_stop_leave_the_side_open() -> None:
    after = told(standing(driven()), (2000, 2500))
    assert after.side is Side.SENSOR_OR_ACTUATOR
    assert sum(h.p for h in after.hypotheses) == pytest.approx(1.0)
    assert after.probability == pytest.approx(0.8 * 0.85 * 0.96)
    assert JUMPS not in after.evidence
    assert "a {wheel} that stands" in after.evidence[0]


def test_readings_that_end_at_speed_are_a_sensors() -> None:
    assert told(dead(driven()), (2000, 2500)).side is Side.SENSOR


def test_few_stops_tell_no_habit_and_a_measured_valve_needs_none() -> None:
    y = standing(driven(0))
    finding = Finding(2000, 2500, Side.SENSOR, FaultMode.NO_SIGNAL, 0.96, ROWS, None, None, (), Tier.MODEL)
    flags = {side: np.zeros(SIZE, np.bool_) for side in (Side.SENSOR, Side.ACTUATOR)}
    found = {0: WheelFindings([finding], flags, flags)}
    assert or_standing(found, {0: y, 1: driven(0)}, {0: False, 1: False}, DT)[0].findings == [finding]
    assert told(standing(driven()), (2000, 2500), measured=True).side is Side.SENSOR


def test_a_sensor_that_is_held_elsewhere_is_another_matter() -> None:
    assert told(standing(driven()), (2000, 2500), mode=FaultMode.STUCK).side is Side.SENSOR
