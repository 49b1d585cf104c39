"""An axle that does nothing of what it is told makes gyro and wheels contradict each other: while it lasts, and no longer."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.clearing.made_by_axles import without_made_by_axles
from diagnosis.clearing.untold_faults import finding_of
from diagnosis.results.assessment import Assessment
from diagnosis.results.machine_event import MachineEvent, gyro_or_slip, not_following
from replay.faults import FaultMode

DT, SIZE = 0.1, 1000


def _left(event: MachineEvent, *, mode: FaultMode = FaultMode.NO_SIGNAL, axle: str = "rear") -> bool:
    fault = finding_of((300, 500), mode, None, ())
    told = {(axle, "sensor"): Assessment(np.zeros(SIZE, np.int8), findings=(fault,))}
    return without_made_by_axles((event,), told, ("front", "rear"), DT) == (event,)


def _between(start: float, stop: float) -> MachineEvent:
    text = "The gyro reads 0.55 × what the wheels make, unless the ground let them slip."
    return gyro_or_slip(text).at([(start, stop)])


def test_what_an_axle_that_does_not_answer_makes_is_no_event_of_its_own() -> None:
    assert not _left(_between(35.0, 51.0))


@pytest.mark.parametrize("event", [_between(10.0, 51.0), _between(60.0, 80.0), gyro_or_slip("The gyro reads 0.55 × …")])
def test_what_begins_before_comes_later_or_is_so_throughout_is_told(event: MachineEvent) -> None:
    assert _left(event)


def test_no_partial_fault_no_wheel_and_no_other_event_is_meant() -> None:
    assert _left(_between(35.0, 45.0), mode=FaultMode.INEFFICIENT)
    assert _left(_between(35.0, 45.0), axle="RR")
    assert _left(not_following("Nothing moved.").at([(35.0, 45.0)]))
