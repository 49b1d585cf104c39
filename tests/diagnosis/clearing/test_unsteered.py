"""An axle that is not steered in the last third of a mission: a fault that begins there shows in nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.results.clearing import Check
from replay.simulation.options import SimulatedMission
from tests.diagnosis.clearing.missions import checks, simulated

MISSION = simulated(seed=8)
END = MISSION.stamps.size
AXLES = ("front", "rear")


def rests_from(share: float, *, drives: bool = True) -> SimulatedMission:
    """The mission in which both axles stay where they are from a share of it on, and the machine drives on, or stands."""
    start = round(share * END)
    columns = dict(MISSION.columns)
    for axle in AXLES:
        angle = columns[f"steer.{axle}.phi"].copy()
        angle[start:] = angle[start]
        columns[f"steer.{axle}.phi"] = angle
    for wheel in ("FL", "FR", "RL", "RR"):
        speed = columns[f"wheel.{wheel}.v"].copy()
        speed[start:] = 0.3 if drives else 0.0
        columns[f"wheel.{wheel}.v"] = speed
    return replace(MISSION, columns=columns)


@pytest.mark.parametrize(
    ("share", "drives", "passed"), [(0.5, True, False), (0.5, False, True), (0.8, True, True), (1.0, True, True)]
)
def test_what_is_steered_until_long_before_the_end_is_not_cleared(share: float, *, drives: bool, passed: bool) -> None:
    mission = MISSION if share == 1.0 else rests_from(share, drives=drives)
    found = checks(mission, base=True)
    for axle in AXLES:
        assert found[axle, "sensor_or_actuator", Check.UNSTEERED].passed is passed


def test_where_no_speed_is_known_it_may_drive() -> None:
    unknown = {f"wheel.{w}.v": np.full(END, np.nan) for w in ("FR", "FL", "RR", "RL")}
    mission = rests_from(0.5, drives=False)
    found = checks(replace(mission, columns={**mission.columns, **unknown}), base=True)
    assert not found["front", "sensor_or_actuator", Check.UNSTEERED].passed


def test_how_long_is_told() -> None:
    check = checks(rests_from(0.5), base=True)["front", "sensor_or_actuator", Check.UNSTEERED]
    assert check.worst == pytest.approx(0.5, abs=0.1)
    assert "the front axle was not steered in the last" in check.text
    assert np.isfinite(check.limit)
