"""A scale that all wheels share: told where something measures the body, and said to be unchecked where nothing does."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.decision.scale import Scale, Scaled, _turning, scale_of
from diagnosis.decision.turn_scale import ANGLE, GYRO, Meant, meant
from replay.faults import FaultMode, FaultSpec, Side
from replay.machine.config import haulotte
from replay.machine.geometry import Geometry, WheelGeometry
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
    (one,) = [s for s in found.wrong if s.by == "odometry"]
    assert one.factor == pytest.approx(1 / factor, rel=0.04)
    assert f"{found.diameter * one.factor:.3g} m would fit" in found.sentence
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


def said(factor: float, meant: Meant, lengths: str = "the wheelbase") -> Scale:
    return Scale(0.5, (Scaled("odometry", 1.0, ""), Scaled("the yaw rate", factor, lengths, meant)))


def test_what_alone_contradicts_the_turns_is_named_where_the_speeds_agree_with_others() -> None:
    gyro = said(0.6, Meant(("odometry",), GYRO, "the difference of RR and RL"))
    angle = said(1.42, Meant(("odometry",), ANGLE, "the difference of RR and RL"))
    either, track = said(0.6, Meant(("odometry",))), said(0.45, Meant(("odometry",), track=True), "the track")
    assert "the scale of the gyro is wrong (it would be multiplied by 1.67)" in gyro.sentence
    assert "the steering angle reads about 0.70 times what it is" in angle.sentence
    assert "diameter" not in angle.sentence
    assert "nothing in the log tells which" in either.sentence
    assert "or the wheels slip in turns; the commanded yaw rate agrees with the track" in track.sentence
    titles = [s.event.title if s.event is not None else "" for s in (gyro, angle, either, track)]
    assert titles[0] == "The gyro contradicts the {wheels}"
    assert titles[1] == "The steering angle contradicts the gyro"
    assert titles[2] == titles[3] == "The gyro contradicts the turns"
    assert not any(s.gross for s in (gyro, angle, either, track))


def test_without_anything_that_has_the_speeds_scale_the_diameter_comes_first() -> None:
    one = said(0.6, Meant())
    assert one.event is None
    assert "check the wheel diameter" in one.gross


@pytest.mark.parametrize(("part", "turns"), [(GYRO, 1.0), (ANGLE, 0.6)])
def test_the_wheels_of_the_unsteered_axle_tell_gyro_from_angle(part: str, turns: float) -> None:
    rng, n, wheels = np.random.default_rng(2), 1200, ("RR", "RL")
    v = np.repeat(rng.choice([1.0, 2.0, 3.0], n // 40), 40)
    expected = v * np.repeat(rng.choice([-0.3, 0.0, 0.0, 0.2, 0.3], n // 40), 40)
    across = 1.6 * turns * expected / 2.0 + 0.01 * v  # a worn tyre
    means = {"cmd.v": v, "wheel.RR.v": v + across, "wheel.RL.v": v - across}
    means = {k: x + 0.005 * rng.normal(size=n) for k, x in means.items()}
    places = {w: SimpleNamespace(x=-1.0, y=y, axle="fixed") for w, y in zip(wheels, (-0.8, 0.8), strict=True)}
    machine = SimpleNamespace(wheels=wheels, axles=("front",), geometry=SimpleNamespace(wheels=places))
    cells: Any = SimpleNamespace(means=lambda k: means.get(k, np.full(n, np.nan)), machine=machine, dt=0.1)
    told = meant(cells, v, expected, np.abs(expected) > 0.2, 0.6, ())
    assert told == Meant(("the commanded speed",), part, "the difference of RR and RL")


@pytest.mark.parametrize("gain", [1.0, 0.7])
def test_turns_on_the_spot_are_no_rests_of_the_gyro(gain: float) -> None:
    rng, dt = np.random.default_rng(3), 0.1
    v = np.repeat(rng.choice([0.0, 0.3, 0.5], 40), 20)
    turn = np.where(v == 0.0, 0.6, np.repeat(rng.choice([0.0, 0.5, -0.5], 40), 20))
    noise = rng.normal(0.0, 0.002, (2, v.size))
    speeds = {"wheel.R.v": v + 0.17 * turn + noise[0], "wheel.L.v": v - 0.17 * turn + noise[1]}
    columns = {**speeds, "imu.yaw_rate": gain * turn, "cmd.v": v, "cmd.omega": turn}
    places = {w: WheelGeometry(0.0, y, 0.0, "fixed") for w, y in (("R", -0.17), ("L", 0.17))}
    machine = SimpleNamespace(geometry=Geometry(places, 0.1), wheels=("R", "L"), axles=())
    cells: Any = SimpleNamespace(machine=machine, means=columns.__getitem__, dt=dt, size=v.size)
    (found,) = _turning(cells, np.column_stack(list(speeds.values())), 1.0, ())
    assert found.factor == pytest.approx(gain, rel=0.02)


@pytest.mark.parametrize("gain", [1.0, 0.6])
def test_the_outer_axles_of_six_wheels_turn_the_machine_beside_fixed_ones_in_the_middle(gain: float) -> None:
    rng, dt, n = np.random.default_rng(5), 0.1, 1200
    angle = np.repeat(rng.choice([0.0, 0.2, -0.25, 0.3], n // 40), 40)
    v, length = np.full(n, 1.5), 3.2
    yaw = gain * v * 2.0 * np.tan(angle) / length
    columns = {"steer.front.phi": angle, "steer.rear.phi": -angle, "imu.yaw_rate": yaw}
    xs = {"front": 1.6, "fixed": 0.0, "rear": -1.6}
    places = {f"{a}{s}": WheelGeometry(x, s, 0.0, a) for a, x in xs.items() for s in (-0.8, 0.8)}
    machine = SimpleNamespace(geometry=Geometry(places, 0.4), wheels=tuple(places), axles=("front", "rear"))
    cells: Any = SimpleNamespace(
        machine=machine, means=lambda k: columns.get(k, np.full(n, np.nan)), dt=dt, size=n, wheels=None
    )
    (found,) = _turning(cells, np.column_stack([v] * 6), 1.0, ())
    assert found.factor == pytest.approx(gain, rel=0.02)
    assert found.lengths == "the wheelbase"
