"""Machines whose axles do not move as their models say: told by all axles, and then accused by measurements alone."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.results.assessment import Finding
from diagnosis.results.result import Epsilon, Sat
from diagnosis.results.vocabulary import Tier
from diagnosis.steering.acquittal import acquitted, moves_otherwise, scatter_of
from diagnosis.steering.blocks import SteeringBlocks, blocks_of, without_growth
from diagnosis.steering.plant import SteeringPlant
from diagnosis.steering.redundancy import with_second_angle, with_valve_opening
from diagnosis.steering.side_findings import SideFindings
from diagnosis.steering.valve_map import ValveMap
from replay.faults import FaultMode, Side

DT, SECONDS = 0.01, 60.0
SIZE = round(SECONDS / DT)
ALWAYS = np.ones(SIZE, np.bool_)
MAP = ValveMap(0.3, 0.3, 0.0, 0.0, 0.4, 0.4)
PLANT = SteeringPlant(MAP, DT, 0.0, 1e-9 * np.eye(8), 0.001, 40, (-1.0, 1.0))
Array = np.ndarray


def moved(scatter: float, seed: int = 1) -> tuple[Array, Array]:
    """Opening and angle of an axle whose rate per opening wanders by a share, from second to second."""
    rng = np.random.default_rng(seed)
    u = 0.6 * np.sign(np.sin(2 * np.pi * np.arange(SIZE) * DT / 6.0))
    gain = 1.0 + scatter * np.repeat(rng.normal(size=round(SECONDS)), round(1.0 / DT))
    return u, np.cumsum(0.3 * u * gain) * DT


def blocks(u: Array, angle: Array) -> SteeringBlocks:
    return blocks_of(angle, u, ALWAYS, ALWAYS, DT)


def scatter(share: float) -> float:
    found = scatter_of(blocks(*moved(share)), PLANT)
    assert found is not None
    return found


def test_motions_scatter_as_the_rate_wanders() -> None:
    assert scatter(0.0) < 1e-3
    assert 0.005 < scatter(0.03) < scatter(0.1)


def test_an_axle_that_loses_much_for_half_of_the_mission_is_no_other_structure() -> None:
    u, angle = moved(0.0)
    rate = np.gradient(angle)
    rate[SIZE // 2 :] *= 0.3
    found = scatter_of(blocks(u, np.cumsum(rate)), PLANT)
    assert found is not None
    assert found < 2e-3


def test_one_axle_that_fits_speaks_for_the_models() -> None:
    assert moves_otherwise([0.02, 0.01])
    assert not moves_otherwise([0.02, 0.002])
    assert not moves_otherwise([None, None])


def test_an_axle_that_rests_says_nothing() -> None:
    assert scatter_of(blocks(np.zeros(SIZE), np.zeros(SIZE)), PLANT) is None


def test_steps_of_a_slow_controller_are_no_noise() -> None:
    """Two of three rows are news: the ramp of an angle goes in steps, on both axles."""
    rng = np.random.default_rng(2)
    u, angle = moved(0.0)
    kept = np.floor(np.arange(SIZE) / 1.5).astype(int)
    noisy = [
        np.repeat(angle + rng.normal(0.0, 3e-4, SIZE), 1)[np.minimum(np.round(kept * 1.5).astype(int), SIZE - 1)]
        for _ in range(2)
    ]
    axles = [blocks(u, y) for y in noisy]
    evened = without_growth(axles)
    moving = np.abs(np.gradient(axles[0].mean)) > 1e-3 * DT
    for before, after in zip(axles, evened, strict=True):
        assert np.median(after.power[moving]) <= np.median(before.power[moving])
    one_steady = without_growth([axles[0], blocks(np.zeros(SIZE), rng.normal(0.0, 3e-4, SIZE))])
    assert one_steady[0] is axles[0]


@pytest.mark.parametrize(("apart", "left"), [(0.004, 0.0), (0.05, 0.04)])
def test_two_angles_may_be_set_to_zero_apart_no_further_than_healthy_ones(apart: float, left: float) -> None:
    u, angle = moved(0.0)
    found = with_second_angle(blocks(u, angle + apart), angle + apart, angle, ALWAYS, DT, 0.001)
    assert np.nanmedian(found.mean - found.redundancy.angle) == pytest.approx(left, abs=1e-3)


def finding(
    side: Side, mode: FaultMode, start: int, stop: int, lost: float = 1.0, level: float | None = None
) -> Finding:
    return Finding(
        start=start,
        stop=stop,
        side=side,
        mode=mode,
        probability=0.99,
        hypotheses=(),
        epsilon=Epsilon(lost, lost, lost),
        sat=None if level is None else Sat(level, abs(level), level, level, "of full opening"),
        evidence=(),
        tier=Tier.MODEL,
    )


def kept(side: Side, found: Finding, of: SteeringBlocks, *, believed: bool = True) -> bool:
    inputs: Any = SimpleNamespace(angle_redundant=True)
    sides = SideFindings((found,), ())
    return bool(acquitted(side, sides, inputs, of, believed=believed).findings)


def valve(opening: Array, command: Array) -> SteeringBlocks:
    noise = np.random.default_rng(3).normal(0.0, 0.003, SIZE)
    told, _ = with_valve_opening(blocks(opening, np.cumsum(0.3 * opening) * DT), command, opening + noise, ALWAYS, DT)
    return told


def test_a_valve_whose_opening_follows_is_not_accused() -> None:
    u, _ = moved(0.0)
    lost = finding(Side.ACTUATOR, FaultMode.INEFFICIENT, SIZE // 2, SIZE, 0.4)
    assert not kept(Side.ACTUATOR, lost, valve(u, u))
    weak = np.where(np.arange(SIZE) < SIZE // 2, u, 0.6 * u)
    assert kept(Side.ACTUATOR, lost, valve(weak, u))


def test_a_loss_shows_where_the_valve_is_used_however_seldom() -> None:
    at = np.arange(SIZE) * DT
    u = np.where(at % 10.0 < 1.5, 0.5, 0.0)
    weak = np.where(at < 30.0, u, 0.5 * u)
    assert kept(Side.ACTUATOR, finding(Side.ACTUATOR, FaultMode.INEFFICIENT, SIZE // 2, SIZE, 0.5), valve(weak, u))


def test_an_opening_that_stays_where_its_command_stays_is_not_stuck() -> None:
    at = np.arange(SIZE) * DT
    u = np.where((at > 20.0) & (at < 21.2), -1.0, 0.0)
    late = np.interp(at - 0.06, at, u)
    stuck = finding(Side.ACTUATOR, FaultMode.STUCK, 2005, 2124, 1.0, -1.0)
    assert not kept(Side.ACTUATOR, stuck, valve(late, u))
    really = np.where(at > 20.0, -1.0, 0.0)
    assert kept(Side.ACTUATOR, replace(stuck, stop=SIZE), valve(really, u))


def test_a_sensor_that_fails_all_through_is_no_habit() -> None:
    u, angle = moved(0.0)
    dead = with_second_angle(blocks(u, np.zeros(SIZE)), np.zeros(SIZE), angle, ALWAYS, DT, 0.0015)
    assert kept(Side.SENSOR, finding(Side.SENSOR, FaultMode.NO_SIGNAL, 0, SIZE), dead)
    near = with_second_angle(blocks(u, angle + 0.003), angle + 0.003, angle, ALWAYS, DT, 0.0015)
    assert not kept(Side.SENSOR, finding(Side.SENSOR, FaultMode.INEFFICIENT, 500, 800, 0.3), near)


@pytest.mark.parametrize(("noise", "named"), [(5e-4, True), (0.0, False)])
def test_a_sensor_that_never_rests_and_repeats_one_reading_is_dead_whatever_the_model_says(
    noise: float, named: bool
) -> None:
    u, angle = moved(0.0)
    reading = angle + np.random.default_rng(6).normal(0.0, noise, SIZE)
    reading[4000:5000] = reading[4000]
    if not named:
        reading = np.round(reading, 1)  # such a sensor rests most of the time
    inputs: Any = SimpleNamespace(angle_redundant=False, angle=reading, fresh=ALWAYS)
    stuck = SideFindings((finding(Side.SENSOR, FaultMode.STUCK, 4000, 5000),), ())
    found = acquitted(Side.SENSOR, stuck, inputs, blocks(u, reading), believed=False)
    assert bool(found.findings) is named


def test_an_opening_that_follows_refutes_a_dead_valve() -> None:
    u, _ = moved(0.0)
    inputs: Any = SimpleNamespace(angle_redundant=True)
    dead = SideFindings((finding(Side.ACTUATOR, FaultMode.NO_SIGNAL, 2000, 4000),), ())
    found = acquitted(Side.ACTUATOR, dead, inputs, valve(u, u), believed=False)
    assert not found.findings
    assert not found.unexplained
    assert found.refuted == ((2000, 4000),)


@pytest.mark.parametrize(("noise", "named"), [(0.05, True), (6e-4, False)])
def test_a_sensor_that_shakes_far_more_than_elsewhere_is_noisy_whatever_the_model_says(
    noise: float, named: bool
) -> None:
    u, angle = moved(0.0)
    rng = np.random.default_rng(8)
    reading = angle + rng.normal(0.0, 5e-4, SIZE)
    reading[4000:5000] += rng.normal(0.0, noise, 1000)
    inputs: Any = SimpleNamespace(angle_redundant=False, angle=reading, fresh=ALWAYS)
    noisy = SideFindings((finding(Side.SENSOR, FaultMode.NOISY, 4000, 5000),), ())
    found = acquitted(Side.SENSOR, noisy, inputs, blocks(u, reading), believed=False)
    assert bool(found.findings) is named


@pytest.mark.parametrize(("usual", "named"), [(0.01, True), (0.05, False)])
def test_a_sensor_that_shakes_all_through_is_noisy_beyond_what_it_may_in_health(usual: float, named: bool) -> None:
    u, angle = moved(0.0)
    reading = angle + np.random.default_rng(8).normal(0.0, 0.1, SIZE)
    noise = SimpleNamespace(white=usual**2)
    inputs: Any = SimpleNamespace(angle_redundant=False, angle=reading, fresh=ALWAYS, noise=noise)
    noisy = SideFindings((finding(Side.SENSOR, FaultMode.NOISY, 0, SIZE),), ())
    found = acquitted(Side.SENSOR, noisy, inputs, blocks(u, reading), believed=False)
    assert bool(found.findings) is named


def test_an_opening_at_the_mean_of_a_command_that_switches_to_and_fro_is_not_stuck() -> None:
    """Slower than its command, a valve stands between the two; one that sticks elsewhere does not."""
    at = np.arange(SIZE) * DT
    rng = np.random.default_rng(8)
    u = np.where(at < 20.0, 0.4 * np.sin(0.6 * at), np.where(rng.random(SIZE) < 0.5, 0.1, 0.0))
    for level, named in ((0.05, False), (-0.1, True)):
        opening = np.where(at < 20.0, u, level)
        stuck = finding(Side.ACTUATOR, FaultMode.STUCK, round(20.0 / DT), SIZE, 1.0, level)
        assert kept(Side.ACTUATOR, stuck, valve(opening, u)) is named


@pytest.mark.parametrize(
    ("noise", "believed", "named"), [(0.04, False, False), (0.12, False, True), (0.04, True, True)]
)
def test_a_spool_that_wanders_little_is_not_disturbed_where_axles_move_otherwise(
    noise: float, believed: bool, named: bool
) -> None:
    u, _ = moved(0.0)
    part = np.arange(SIZE) >= SIZE // 2
    opening = u + np.where(part, noise * np.random.default_rng(4).standard_normal(SIZE), 0.0)
    shaken = finding(Side.ACTUATOR, FaultMode.NOISY, SIZE // 2, SIZE, 0.2)
    slowly = np.convolve(opening - u, np.ones(20) / 20, "same") * 20**0.5 + u  # slower than a block
    assert kept(Side.ACTUATOR, shaken, valve(slowly, u), believed=believed) is named
