"""Losses of a speed that a model states, beside what the speed per opening shows."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.clearing.contradicted import without_contradicted
from diagnosis.results.assessment import CODE, Assessment, Finding
from diagnosis.results.result import Epsilon, Hypothesis
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, FaultSpec, Side, State
from tests.diagnosis.clearing.missions import in_cells, simulated

LOST, START_S, STOP_S = 0.4, 20.0, 40.0


def stated(size: int, dt: float, tier: Tier) -> Assessment:
    """A model that is sure of a loss of the sensor."""
    start, stop = round(START_S / dt), round(STOP_S / dt)
    states = np.full(size, CODE[State.HEALTHY], dtype=np.int8)
    states[start:stop] = CODE[State.INEFFICIENT]
    finding = Finding(
        start=start,
        stop=stop,
        side=Side.SENSOR,
        mode=FaultMode.INEFFICIENT,
        probability=0.9,
        hypotheses=(Hypothesis("sensor", "inefficient", 0.9),),
        epsilon=Epsilon(LOST, 0.0, 0.8),
        sat=None,
        evidence=(),
        tier=tier,
    )
    return Assessment(tier=tier, states=states, findings=(finding,))


@pytest.mark.parametrize(
    ("faulty", "tier", "kept"), [(True, Tier.MODEL, 1), (False, Tier.MODEL, 0), (False, Tier.DIRECT, 1)]
)
def test_a_loss_is_kept_where_the_speed_per_opening_shows_it(faulty: bool, tier: Tier, kept: int) -> None:
    faults = (FaultSpec("FR", Side.SENSOR, FaultMode.INEFFICIENT, START_S, STOP_S, LOST),) if faulty else ()
    cells = in_cells(simulated(*faults), base=True)
    part = ("FR", "sensor")
    told = without_contradicted({part: stated(cells.timeline.size, cells.timeline.dt, tier)}, cells)[part]
    assert len(told.findings) == kept
    assert told.unexplained_s == pytest.approx(0.0 if kept else STOP_S - START_S)
