"""A gyro that turns as the second angles say names the first ones; one that turns as the first, or as neither, names none."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from diagnosis.clearing.checks import checks_of
from diagnosis.clearing.second_angles import scaled_angles, turned_by
from diagnosis.decision.scale import scale_of
from diagnosis.results.assessment import Finding
from diagnosis.results.machine_words import HYDRAULIC
from replay.faults import FaultMode, Side
from replay.simulation.options import SimulatedMission
from tests.diagnosis.clearing.missions import in_cells, simulated
from tests.diagnosis.decision.test_scale import measured


@cache
def _mission() -> SimulatedMission:
    """With second angles of both axles that read what is so, and what measures the body."""
    mission = measured(simulated(seed=6))
    second = {f"steer.{a}.phi_true": mission.columns[f"steer.{a}.phi"] for a in ("front", "rear")}
    return replace(mission, columns={**mission.columns, **second})


def _found(first: float, second: float, gyro: float, axles: tuple[str, ...] = ("front", "rear")) -> dict[str, Finding]:
    columns = dict(_mission().columns)
    for axle in axles:
        columns[f"steer.{axle}.phi"] = first * columns[f"steer.{axle}.phi"]
        columns[f"steer.{axle}.phi_true"] = second * columns[f"steer.{axle}.phi_true"]
    columns["imu.yaw_rate"] = gyro * columns["imu.yaw_rate"]
    cells = in_cells(replace(_mission(), columns=columns), base=False)
    return scaled_angles(checks_of(cells, HYDRAULIC), cells)


@pytest.mark.parametrize("share", [0.5, 0.65])
def test_the_first_angles_of_all_axles_are_named(share: float) -> None:
    found = _found(share, 1.0, 1.0)
    assert set(found) == {"front", "rear"}
    for fault in found.values():
        assert (fault.side, fault.mode) == (Side.SENSOR, FaultMode.INEFFICIENT)
        assert fault.epsilon is not None
        assert fault.epsilon.value == pytest.approx(1.0 - share, abs=0.03)
        assert "two witnesses against one" in fault.evidence[-1]


def test_a_reading_of_too_much_is_in_no_table() -> None:
    assert {f.mode for f in _found(1.6, 1.0, 1.0).values()} == {FaultMode.OUTSIDE_TABLE}


@pytest.mark.parametrize(
    ("first", "second", "gyro"), [(1.0, 1.0, 1.0), (1.0, 0.6, 1.0), (1.0, 1.0, 0.6), (0.65, 1.0, 0.65)]
)
def test_sound_first_angles_and_a_gyro_that_agrees_with_them_name_none(
    first: float, second: float, gyro: float
) -> None:
    assert _found(first, second, gyro) == {}


def test_the_verdict_names_the_angle_and_no_length_of_the_file() -> None:
    columns = {n: 0.65 * x if n.endswith(".phi") else x for n, x in _mission().columns.items()}
    cells = in_cells(replace(_mission(), columns=columns), base=False)
    assert turned_by(cells) is not None
    found = scale_of(cells, {"rpm"})
    assert found is not None
    assert "the second measurement of the angles (steer.*.phi_true) turns it as the gyro has it" in found.sentence
    assert not np.any([word in found.sentence for word in ("wheelbase", "nothing in the log tells which")])
