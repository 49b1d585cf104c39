"""A wheel whose valve does not answer may read whatever the ground makes of it: its sensor's faults are less sure."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.clearing.beside import less_sure_beside_dead_valves
from diagnosis.results.assessment import Assessment, Finding
from diagnosis.results.machine_words import HYDRAULIC
from diagnosis.results.result import Sat
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side
from tests.diagnosis.clearing.test_beside_angles import SURE, fault


def beside(sensor: Finding, valve: Finding) -> Finding:
    """The sensor's fault, once the valve's is known."""
    states = np.zeros(3000, dtype=np.int8)
    before = {
        ("RR", "sensor"): Assessment(states, findings=(sensor,)),
        ("RR", "actuator"): Assessment(states, findings=(valve,)),
        ("RL", "sensor"): Assessment(states, findings=(sensor,)),
    }
    after = less_sure_beside_dead_valves(before, ("RR", "RL"), HYDRAULIC)
    assert after["RR", "actuator"] is before["RR", "actuator"]
    assert after["RL", "sensor"] is before["RL", "sensor"]
    (found,) = after["RR", "sensor"].findings
    return found


DEAD = fault(0, 3000, Side.ACTUATOR, FaultMode.NO_SIGNAL)


@pytest.mark.parametrize("mode", [FaultMode.NO_SIGNAL, FaultMode.NOISY, FaultMode.INEFFICIENT])
def test_beside_a_dead_valve_a_sensor_is_less_sure(mode: FaultMode) -> None:
    found = beside(fault(1000, 1500, mode=mode), DEAD)
    assert found.probability == pytest.approx(0.65)
    assert "valve" in found.evidence[-1]


@pytest.mark.parametrize(
    ("sensor", "valve"),
    [
        (fault(1000, 1500, tier=Tier.DIRECT), DEAD),
        (fault(1000, 1500), fault(1400, 3000, Side.ACTUATOR, FaultMode.STUCK)),
        (fault(1000, 1500), fault(0, 3000, Side.ACTUATOR, FaultMode.INEFFICIENT)),
    ],
)
def test_a_second_sensor_another_time_or_a_loss_leave_it(sensor: Finding, valve: Finding) -> None:
    assert beside(sensor, valve).probability == SURE


@pytest.mark.parametrize(("rms", "p"), [(0.0, SURE), (0.006, 0.65)])
def test_a_reading_that_stays_to_the_last_digit_is_as_sure_as_ever(rms: float, p: float) -> None:
    dead = replace(fault(1000, 1500, mode=FaultMode.NO_SIGNAL), sat=Sat(0.0, rms, -rms, rms, "m/s"))
    assert beside(dead, DEAD).probability == pytest.approx(p)


@pytest.mark.parametrize(
    ("found", "p"),
    [
        (fault(1000, 1500, Side.ACTUATOR), 0.55),
        (fault(1000, 1500, Side.SENSOR_OR_ACTUATOR), 0.55),
        (fault(1000, 1500, Side.ACTUATOR, tier=Tier.DIRECT), SURE),
        (fault(1000, 1500, Side.ACTUATOR, FaultMode.STUCK), SURE),
        (fault(1000, 1500, Side.SENSOR), SURE),
    ],
)
def test_what_a_dead_valve_makes_of_another_wheel_is_not_worth_a_check(found: Finding, p: float) -> None:
    states = np.zeros(3000, dtype=np.int8)
    before = {
        ("RR", "actuator"): Assessment(states, findings=(DEAD,)),
        ("FR", "sensor"): Assessment(states, findings=(found,)),
        ("FR", "actuator"): Assessment(states, findings=(found,)),
    }
    after = less_sure_beside_dead_valves(before, ("RR", "FR"), HYDRAULIC)
    assert after["RR", "actuator"] is before["RR", "actuator"]
    assert after["FR", "actuator"].findings[0].probability == pytest.approx(p, abs=0.02)
