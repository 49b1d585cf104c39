"""What a model says of either side is not stated again where a second measurement shows which side it is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.decision.stated_once import without_restated
from diagnosis.results.assessment import CODE, Assessment, Finding
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side, State

from .findings import assessed, finding

DT = 0.001
MEASURED = finding(Side.ACTUATOR, FaultMode.NOISY, 1000, 9000)
AGAIN = replace(finding(Side.SENSOR_OR_ACTUATOR, FaultMode.OUTSIDE_TABLE, 2000, 8000, epsilon=None), tier=Tier.MODEL)


def told(measured: Finding, again: Finding) -> dict[tuple[str, str], Assessment]:
    parts = {("FR", "actuator"): assessed(measured, again), ("FR", "sensor"): assessed(again)}
    return without_restated(parts, DT)


def test_it_goes_and_the_other_side_is_not_assessed_there() -> None:
    after = told(MEASURED, AGAIN)
    assert after["FR", "actuator"].findings == (MEASURED,)
    sensor = after["FR", "sensor"]
    assert sensor.findings == ()
    assert np.all(sensor.states[2000:8000] == CODE[State.NOT_ASSESSED])
    assert sensor.unexplained_s == pytest.approx(6.0)


@pytest.mark.parametrize(
    ("measured", "again"),
    [
        (MEASURED, replace(AGAIN, side=Side.SENSOR)),  # says that it is the other side
        (MEASURED, replace(AGAIN, start=8000, stop=14_000)),  # at another time
        (finding(Side.ACTUATOR, FaultMode.NOISY, 1000, 9000, p=0.7), AGAIN),  # not sure
        (replace(MEASURED, tier=Tier.MODEL), AGAIN),  # by a model as well
    ],
)
def test_other_faults_stay(measured: Finding, again: Finding) -> None:
    after = told(measured, again)
    assert again in after["FR", "sensor"].findings


def test_another_wheel_is_another_part() -> None:
    parts = {("FR", "actuator"): assessed(MEASURED), ("FL", "sensor"): assessed(AGAIN)}
    assert without_restated(parts, DT)["FL", "sensor"].findings == (AGAIN,)
