"""A scale that all wheels share: told where something measures the body, and said to be unchecked where nothing does."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from diagnosis.decision.scale import Scale, Scaled, scale_of
from replay.faults import FaultMode, FaultSpec, Side
from replay.machine.config import haulotte
from replay.simulation.options import SimulatedMission
from tests.diagnosis.clearing.missions import LENGTH, in_cells, simulated


def measured(one: SimulatedMission) -> SimulatedMission:
    """A mission with odometry and a gyro that measure the body itself, with their noise and a bias."""
    geometry, rng, n = haulotte().geometry, np.random.default_rng(1), one.stamps.size
    assert geometry is not None
    v = np.median(
        [x for name, x in one.columns.items() if name.startswith("wheel.") and name.endswith(".v_true")], axis=0
    )
    turn = np.tan(one.columns["steer.front.phi"]) - np.tan(one.columns["steer.rear.phi"])
    yaw = v * turn / (geometry.axle_x("front") - geometry.axle_x("rear"))
    body = {"odom.v": v + 0.005 * rng.normal(size=n), "imu.yaw_rate": yaw + 0.01 + 0.005 * rng.normal(size=n)}
    return replace(one, columns={**one.columns, **body})


@cache
def mission(seed: int) -> SimulatedMission:
    return measured(simulated(seed=seed))


def scale(one: SimulatedMission, factor: float, *, body: bool = True) -> Scale:
    """A mission as it is read with a wheel diameter that is wrong by a factor."""
    columns = {n: factor * x if n.startswith("wheel.") and ".v" in n else x for n, x in one.columns.items()}
    if not body:
        columns = {n: x for n, x in columns.items() if not n.startswith(("odom.", "imu."))}
    found = scale_of(in_cells(replace(one, columns=columns), base=False), {"rpm"})
    assert found is not None
    return found


@pytest.mark.parametrize("seed", [5, 6, 7])
def test_a_sound_scale_agrees_with_receiver_and_gyro(seed: int) -> None:
    found = scale(mission(seed), 1.0)
    assert {s.by for s in found.found} >= {"odometry", "the yaw rate"}
    assert (found.wrong, found.sentence) == ((), "")
    assert found.result[0].startswith("by an assumed wheel diameter (")
    assert "agrees with odometry" in found.result[0]


@pytest.mark.parametrize("factor", [0.5, 0.8, 1.25, 2.0])
def test_a_wrong_diameter_is_told_with_the_one_that_fits(factor: float) -> None:
    found = scale(mission(5), factor)
    assert found.diameter is not None
    (said,) = [s for s in found.wrong if s.by == "odometry"]
    assert said.factor == pytest.approx(1 / factor, rel=0.04)
    assert f"{found.diameter * said.factor:.3g} m would fit" in found.sentence
    assert bool(found.gross) == (factor in (0.5, 2.0))
    assert found.result[2] is False


def test_what_nothing_measures_is_said_to_be_unchecked() -> None:
    found = scale(mission(5), 2.0, body=False)
    assert found.found == ()
    assert "not checked" in found.result[0]
    assert found.result[2] is True


def test_a_faulty_wheel_is_no_scale() -> None:
    fault = FaultSpec("FR", Side.SENSOR, FaultMode.INEFFICIENT, 0.0, LENGTH, 0.5)
    assert scale(measured(simulated(fault)), 1.0).wrong == ()


def test_speeds_of_the_rim_name_no_diameter() -> None:
    found = scale_of(in_cells(mission(5), base=False), {"m/s"})
    assert found is not None
    assert found.diameter is None
    assert "the unit or gain" in Scale(None, (Scaled("odometry", 2.0, ""),)).sentence
    assert np.isfinite([s.factor for s in found.found]).all()
