"""Partial faults of wheels are less sure while a steering sensor fails, from whose angle the model takes what they should do."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.clearing.beside import less_sure_beside_wrong_angles
from diagnosis.results.assessment import Assessment, Finding
from diagnosis.results.result import Hypothesis
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side

SURE = 0.92


def fault(
    start: int, stop: int, side: Side = Side.SENSOR, mode: FaultMode = FaultMode.INEFFICIENT, tier: Tier = Tier.MODEL
) -> Finding:
    rows = (Hypothesis(side.value, mode, SURE), Hypothesis("none", "healthy", 1.0 - SURE))
    return Finding(start, stop, side, mode, SURE, rows, None, None, (), tier)


def beside(wheel: Finding, angle: Finding) -> Finding:
    """The wheel's fault, once the angle's is known."""
    states = np.zeros(3000, dtype=np.int8)
    axle = "front", angle.side.sides[0].value
    before = {
        ("RR", wheel.side.value): Assessment(states, findings=(wheel,)),
        axle: Assessment(states, findings=(angle,)),
        ("RL", "sensor"): Assessment(states),
    }
    after = less_sure_beside_wrong_angles(before, ("RR", "RL"), ("front", "rear"))
    assert after[axle] is before[axle]
    (found,) = after["RR", wheel.side.value].findings
    return found


@pytest.mark.parametrize("mode", [FaultMode.INEFFICIENT, FaultMode.OUTSIDE_TABLE])
@pytest.mark.parametrize("side", [Side.SENSOR, Side.SENSOR_OR_ACTUATOR])
def test_a_loss_beside_an_angle_that_is_or_may_be_wrong_is_less_sure(mode: FaultMode, side: Side) -> None:
    found = beside(fault(1000, 1500, mode=mode), fault(0, 3000, side=side, mode=FaultMode.NO_SIGNAL))
    assert found.probability == pytest.approx(0.65)
    assert sum(h.p for h in found.hypotheses) == pytest.approx(1.0)
    assert found.evidence[-1].startswith("Meanwhile a steering sensor fails")


@pytest.mark.parametrize(
    ("wheel", "angle"),
    [
        (fault(1000, 1500, tier=Tier.DIRECT), fault(0, 3000)),
        (fault(1000, 1500, mode=FaultMode.NO_SIGNAL), fault(0, 3000)),
        (fault(1000, 1500, mode=FaultMode.NOISY), fault(0, 3000)),
        (fault(1000, 1500), fault(1300, 3000)),
        (fault(1000, 1500), fault(0, 3000, side=Side.ACTUATOR)),
    ],
    ids=["measured twice", "nothing comes", "it shakes", "at another time", "an angle that is right"],
)
def test_what_the_angle_does_not_explain_is_as_sure_as_before(wheel: Finding, angle: Finding) -> None:
    assert beside(wheel, angle) is wheel
