"""Sensors of the body beside wheels that nothing else shows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.body.positions import Positions
from diagnosis.response.assess import Judgement, assess_response
from diagnosis.response.body import BodySpeed, _of_positions, made_of
from diagnosis.response.inputs import cells
from diagnosis.response.models import BLOCK_S
from diagnosis.results.assessment import CODE
from replay.faults import FaultMode, Side, State
from replay.machine.config import Limits
from tests.campaigns import campaign
from tests.diagnosis.response.robot import DT, TRACK, followers_of, geometry, speeds

Array = NDArray[np.float64]

LIMITS = Limits(driving_speed=0.05)
PART = slice(round(60 / DT), round(70 / DT))
WIDTH = round(BLOCK_S / DT)


def ground(measured: dict[str, Array], seed: int = 0, noise: float = 0.02) -> BodySpeed:
    """Speed over ground of a body that its wheels carry; a satellite receiver has no sign."""
    true = np.mean(list(measured.values()), axis=0)
    read = np.abs(true + np.random.default_rng(seed + 77).normal(0.0, noise, true.size))
    return BodySpeed("speed over ground", cells(read, WIDTH), False, 1)


def odometry(measured: dict[str, Array], seed: int = 0, noise: float = 0.03) -> BodySpeed:
    true = np.mean(list(measured.values()), axis=0)
    late = np.r_[np.zeros(8), true[:-8]] + np.random.default_rng(seed + 78).normal(0.0, noise, true.size)
    return BodySpeed("odometry", cells(late, WIDTH), True, 1)


def turning(measured: dict[str, Array], right: str, left: str) -> Array:
    rng = np.random.default_rng(5)
    return (measured[right] - measured[left]) / TRACK + rng.normal(0.0, 0.01, measured[right].size)


def judged(
    measured: dict[str, Array],
    asked: dict[str, Array],
    body: Array,
    yaw: Array | None,
    sensors: tuple[BodySpeed, ...],
    commanded: bool = True,
) -> Judgement:
    data = followers_of(measured, asked, body)
    if not commanded:
        data = {w: replace(d, commands=d.commands * np.nan, asked=d.asked * np.nan) for w, d in data.items()}
    return assess_response(data, geometry(tuple(measured)), yaw, LIMITS, DT, sensors)


def found(j: Judgement) -> list[tuple[str, Side, FaultMode]]:
    return [(w, f.side, f.mode) for w, (sensor, _) in j.parts.items() for f in sensor.findings]


@pytest.mark.parametrize("seed", campaign([21, 22, 23]))
def test_a_single_drive_at_half_its_speed_is_told_by_the_speed_over_ground(seed: int) -> None:
    measured, asked, _ = speeds(seed, ("FR",))
    sensor = ground(measured, seed)
    column = np.column_stack([asked["FR"], np.zeros(asked["FR"].size)])
    assert found(judged(measured, asked, column, None, (sensor,))) == []
    measured["FR"][PART] *= 0.5
    ((wheel, side, mode),) = found(judged(measured, asked, column, None, (sensor,)))
    assert (wheel, side, mode) == ("FR", Side.SENSOR, FaultMode.INEFFICIENT)


@pytest.mark.parametrize("seed", campaign([24, 25, 26]))
def test_without_commands_the_wheel_that_differs_from_the_body_is_blamed(seed: int) -> None:
    measured, asked, body = speeds(seed, ("FR", "FL"))
    yaw, sensor = turning(measured, "FR", "FL"), odometry(measured, seed)
    j = judged(measured, asked, body, yaw, (sensor,), commanded=False)
    assert found(j) == []
    assert float(np.mean(j.parts["FR"][0].states == CODE[State.HEALTHY])) > 0.6
    measured["FL"][PART] *= 0.4
    ((wheel, side, _),) = found(judged(measured, asked, body, yaw, (sensor,), commanded=False))
    assert (wheel, side) == ("FL", Side.SENSOR)


def test_a_body_sensor_that_fails_blames_no_wheel() -> None:
    measured, asked, body = speeds(27, ("FR", "FL"))
    yaw, sensor = turning(measured, "FR", "FL"), odometry(measured)
    part = slice(PART.start // WIDTH, PART.stop // WIDTH)
    sensor.speed[part] *= 0.3
    assert found(judged(measured, asked, body, yaw, (sensor,))) == []
    assert found(judged(measured, asked, body, yaw, (sensor,), commanded=False)) == []


def test_odometry_that_is_made_of_the_wheels_is_left_out() -> None:
    measured, asked, body = speeds(28, ("FR", "FL"))
    measured["FL"][PART] *= 0.5
    made = BodySpeed("odometry", cells(np.mean(list(measured.values()), axis=0), WIDTH), True, 1)
    assert made_of(made, [cells(y, WIDTH) for y in measured.values()])
    j = judged(measured, asked, body, turning(measured, "FR", "FL"), (made,))
    assert any("computed from the wheels" in n for n in j.parts["FR"][0].notes)
    assert not made_of(odometry(speeds(28, ("FR", "FL"))[0]), [cells(y, WIDTH) for y in measured.values()])


@pytest.mark.parametrize(("noise", "reach"), [(0.001, 2), (0.05, 4), (2.0, 0)])
def test_positions_become_a_speed_over_as_long_as_their_noise_asks(noise: float, reach: int) -> None:
    rng = np.random.default_rng(3)
    t = np.arange(0.0, 100.0, 0.1)
    place = 0.8 * t + rng.normal(0.0, noise, t.size) + 1j * rng.normal(0.0, noise, t.size)
    got = _of_positions("satellite positions", Positions(t, place), 400, 0.25)
    if not reach:
        assert got is None
        return
    assert got is not None
    assert got.reach >= reach
    assert float(np.nanmedian(got.speed)) == pytest.approx(0.8, abs=0.05)
