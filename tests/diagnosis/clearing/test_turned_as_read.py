"""A gyro that shows one share of an angle from the start to the end is its second measurement for what changes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.clearing.turned_as_read import read_as_before, turned_as_read
from replay.machine.config import haulotte
from replay.simulation.options import SimulatedMission
from tests.diagnosis.clearing.missions import in_cells, simulated

_DRIVEN = simulated(seed=8)


def _with_a_gyro(mission: SimulatedMission) -> SimulatedMission:
    """The mission with a yaw rate as rigid wheels have it at these angles."""
    columns, geometry = mission.columns, haulotte().geometry
    assert geometry is not None
    wheels = geometry.wheels.values()
    speed = np.mean([columns[f"wheel.{w}.v"] for w in haulotte().wheels], axis=0)
    front, rear = (np.tan(columns[f"steer.{axle}.phi"]) for axle in ("front", "rear"))
    length = max(w.x for w in wheels) - min(w.x for w in wheels)
    return replace(mission, columns={**columns, "imu.yaw_rate": speed * (front - rear) / length})


MISSION = _with_a_gyro(_DRIVEN)


def turned(mission: SimulatedMission, *, base: bool = False, steered: tuple[int, int] = (0, 10**6)) -> list[bool]:
    """Whether the machine turns as its axles read, which are steered in such windows."""
    cells = in_cells(mission, base=base)
    windows = np.arange(cells.frame.starts.size)
    found = turned_as_read(cells, np.column_stack([(windows >= steered[0]) & (windows < steered[1])] * 2))
    return [change is not None for change in found]


def with_angle(axle: str, share: NDArray[np.float64]) -> list[bool]:
    """Whether the machine turns as each axle reads, where one of them reads such a share of its angle."""
    name = f"steer.{axle}.phi"
    columns = {**MISSION.columns, name: MISSION.columns[name] * share}
    return turned(replace(MISSION, columns=columns))


def test_healthy_angles_turn_the_machine_by_one_share() -> None:
    assert turned(MISSION) == [True, True]


def test_without_a_gyro_nothing_is_known() -> None:
    assert turned(_DRIVEN, base=True) == [False, False]


@pytest.mark.parametrize("axle", ["front", "rear"])
@pytest.mark.parametrize("end", [0.6, 1.5])
def test_an_angle_that_comes_to_read_another_share_does_not(axle: str, end: float) -> None:
    ramp = np.linspace(1.0, end, MISSION.stamps.size)
    assert not all(with_angle(axle, ramp))


def test_a_share_that_stays_is_none_that_changes() -> None:
    assert with_angle("front", np.full(MISSION.stamps.size, 0.9)) == [True, True]


def test_turns_in_one_part_of_the_mission_tell_nothing_of_the_rest() -> None:
    gone = np.where(np.linspace(0.0, 1.0, MISSION.stamps.size) < 0.5, MISSION.columns["imu.yaw_rate"], np.nan)
    assert turned(replace(MISSION, columns={**MISSION.columns, "imu.yaw_rate": gone})) == [False, False]


@pytest.mark.parametrize(
    ("change", "rates", "excused"),
    [(0.02, (0.15, None), True), (0.07, (0.15, 0.1), False), (0.05, (0.01, 0.0), False), (None, (0.3, 0.3), False)],
)
def test_rates_that_change_by_far_more_than_the_gyro_shows_are_not_the_sensors(
    change: float | None, rates: tuple[float | None, ...], *, excused: bool
) -> None:
    assert read_as_before(change, rates) is excused
