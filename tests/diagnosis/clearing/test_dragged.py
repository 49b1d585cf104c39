"""While a wheel turns against its command, what only a model says of another wheel's valve is not worth a check."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from diagnosis.clearing.cells import Cells
from diagnosis.clearing.dragged import less_sure_beside_backwards
from diagnosis.results.assessment import Assessment, Finding
from diagnosis.results.machine_words import HYDRAULIC
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side
from tests.diagnosis.clearing.test_beside_angles import SURE, fault

COUNT, WIDTH = 300, 10


def told(found: Finding, *, against: float = -0.1, until: int = COUNT, wheel: int = 1) -> float:
    """Probability of a fault of FR while a wheel's speed is so large against a command of 0.3 up to a cell."""
    speed, asked = np.full((COUNT, 2), 0.3), np.full((COUNT, 2), 0.3)
    speed[:until, wheel] = against
    machine = SimpleNamespace(wheels=("FR", "RR"), max_speed=0.4)
    cells = SimpleNamespace(machine=machine, reference=asked, wheels=lambda leaf: speed, width=WIDTH)
    states = np.zeros(COUNT * WIDTH, dtype=np.int8)
    part = "FR", found.side.value
    after = less_sure_beside_backwards({part: Assessment(states, findings=(found,))}, cast(Cells, cells), HYDRAULIC)
    return after[part].findings[0].probability


@pytest.mark.parametrize("mode", [FaultMode.STUCK, FaultMode.INEFFICIENT])
def test_it_is_not_worth_a_check(mode: FaultMode) -> None:
    assert told(fault(1000, 1500, Side.ACTUATOR, mode)) < 0.6


@pytest.mark.parametrize(
    ("found", "other"),
    [
        (fault(1000, 1500, Side.ACTUATOR, tier=Tier.DIRECT), {}),
        (fault(1000, 1500, Side.SENSOR), {}),
        (fault(1000, 1500, Side.ACTUATOR), {"against": 0.1}),
        (fault(1000, 1500, Side.ACTUATOR), {"against": -0.004}),
        (fault(1000, 1500, Side.ACTUATOR), {"until": 120}),
        (fault(1000, 1500, Side.ACTUATOR), {"wheel": 0}),
    ],
)
def test_what_is_measured_another_time_or_its_own_turning_leaves_it(found: Finding, other: dict[str, float]) -> None:
    assert told(found, **other) == SURE  # type: ignore[arg-type]
