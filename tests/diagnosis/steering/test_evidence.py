"""What the plots of a steering axle hold its angle against: within the threshold while healthy, beyond it in a fault."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from replay.faults import FaultMode, Side
from tests.campaigns import campaign
from tests.diagnosis.steering.test_assess import front, judged, mission_of


def beyond(columns: dict[str, NDArray[np.floating]], rows: slice) -> float:
    """Share of what is known in rows whose residual is beyond its threshold."""
    residual, threshold = columns["residual"][rows], columns["threshold"][rows]
    known = np.isfinite(residual) & np.isfinite(threshold)
    return float(np.mean(np.abs(residual[known]) > threshold[known])) if known.any() else np.nan


def test_a_healthy_axle_stays_within_its_thresholds() -> None:
    result, timeline = judged(mission_of())
    for (axle, side), a in result.assessments.items():
        assert beyond(a.columns, slice(None)) < 0.01, (axle, side)
        np.testing.assert_allclose(
            (a.columns["residual"] + a.columns["expected"])[timeline.size // 2],
            timeline.signals[f"steer.{axle}.phi"][timeline.size // 2],
            atol=1e-6,
        )


@pytest.mark.parametrize(
    "fault",
    campaign(
        [
            front(Side.ACTUATOR, FaultMode.STUCK, sat=0.05),
            front(Side.ACTUATOR, FaultMode.NO_SIGNAL),
            front(Side.SENSOR, FaultMode.INEFFICIENT, epsilon=0.5),
        ],
        2,
    ),
    ids=lambda f: f"{f.side.value} {f.mode.value}",
)
def test_a_fault_is_beyond_its_threshold(fault: object) -> None:
    result, timeline = judged(mission_of(fault))  # type: ignore[arg-type]
    side = fault.side.value  # type: ignore[attr-defined]
    inside = slice(round(17.5 / timeline.dt), round(26.5 / timeline.dt))
    assert beyond(result.assessments["front", side].columns, inside) > 0.5
    assert beyond(result.assessments["rear", side].columns, inside) < 0.02


def test_behind_a_dead_sensor_nothing_is_expected_of_the_valve() -> None:
    result, timeline = judged(mission_of(front(Side.SENSOR, FaultMode.NO_SIGNAL)))
    inside = slice(round(17.5 / timeline.dt), round(26.5 / timeline.dt))
    assert np.isnan(result.assessments["front", "actuator"].columns["expected"][inside]).all()
