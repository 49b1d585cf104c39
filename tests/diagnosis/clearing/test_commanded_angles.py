"""An angle that is off its command while its valve rests is not the one that the loop reads."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.clearing.commanded_angles import OFF, off_command
from diagnosis.results.clearing import Check
from replay.simulation.options import SimulatedMission
from tests.diagnosis.clearing.missions import checks, in_cells, simulated

MISSION = simulated(seed=8)


def with_angle(size: float) -> SimulatedMission:
    """The mission whose front angle, as it is recorded and read by nobody, drifts off by as much [rad] from its first third on."""
    angle = MISSION.columns["steer.front.phi"]
    third = angle.size // 3
    drift = np.clip(np.arange(-third, angle.size - third) / third, 0.0, 1.0)
    return replace(MISSION, columns={**MISSION.columns, "steer.front.phi": angle + size * drift})


@pytest.mark.parametrize(("size", "passed"), [(0.0, True), (0.02, True), (0.2, False), (-0.12, False)])
def test_a_recorded_angle_that_drifts_off_its_command_clears_no_axle(size: float, *, passed: bool) -> None:
    found = checks(with_angle(size), base=True)
    assert found["front", "sensor_or_actuator", Check.COMMANDED_ANGLE].passed is passed
    assert found["rear", "sensor_or_actuator", Check.COMMANDED_ANGLE].passed


def test_what_it_is_off_by_is_told() -> None:
    check = checks(with_angle(0.2), base=True)["front", "sensor_or_actuator", Check.COMMANDED_ANGLE]
    assert check.worst == pytest.approx(0.2, abs=0.02)
    assert "front axle is" in check.text
    assert "off its command while its valve is told to rest" in check.text


def test_a_loop_that_is_switched_off_at_rest_holds_nothing() -> None:
    parked = {
        f"wheel.{w}.{leaf}": np.zeros(MISSION.stamps.size) for w in ("FL", "FR", "RL", "RR") for leaf in ("v", "v_ref")
    }
    mission = with_angle(0.2)
    assert np.nanmax(off_command(in_cells(mission, base=True), 0)) > OFF
    cells = in_cells(replace(mission, columns={**mission.columns, **parked}), base=True)
    assert not np.isfinite(off_command(cells, 0)).any()


def test_without_a_command_of_the_angle_it_is_not_asked() -> None:
    columns = {n: x for n, x in MISSION.columns.items() if n != "steer.front.phi_ref"}
    found = checks(replace(MISSION, columns=columns), base=True)
    assert not [c for c in found if c[0] == "front" and c[2] is Check.COMMANDED_ANGLE]
