"""Plants of simulated axles are found again: dead band, gains of both directions, lag, play; with faults in the mission."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.steering.blocks import SensorNoise, SteeringBlocks, blocks_of
from diagnosis.steering.identification import identify_plants
from diagnosis.steering.plant import SteeringPlant
from diagnosis.steering.valve_map import ValveMap, rate_at

DT, STOP = 0.002, 0.785
NOISE = SensorNoise(white=2.5e-7, spread=0.01, step=0.0, lsb=0.0)
VALVES = (ValveMap(4.0, 4.6, 0.025, 0.03, 0.25, 0.25), ValveMap(3.4, 3.8, 0.02, 0.018, 0.25, 0.25))


def axle(
    valve: ValveMap,
    *,
    play: float = 0.0,
    seed: int = 0,
    reach: float = 0.5,
    lost: tuple[float, float, float] = (0, 0, 0),
    every: int = 1,
    noise: float = 5e-4,
) -> SteeringBlocks:
    """A minute and a half of an axle that follows a wandering angle; `lost` is a loss of the valve from … to … [s].

    The angle has a new sample at `every` step, with `noise` [rad].
    """
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, 90.0, DT)
    corners = rng.uniform(-reach, reach, 24)
    ref = np.interp(t, np.linspace(0, 90, 72), np.repeat(corners, 3))
    y, u, phi, rate, held = np.zeros(t.size), np.zeros(t.size), 0.0, 0.0, 0.0
    shaken = rng.normal(0.0, noise, t.size)
    for k in range(t.size):
        held = min(max(held, phi - play), phi + play)
        y[k] = held + shaken[k]
        u[k] = ref[k] - y[k]
        opening = u[k] * (1 - lost[0]) if lost[1] <= t[k] < lost[2] else u[k]
        rate += DT / 0.05 * (rate_at(opening, valve) - rate)
        phi += DT * rate
    always = np.ones(t.size, np.bool_)
    return blocks_of(y, u, np.arange(t.size) % every == 0, always, DT)


def found(*axles: SteeringBlocks) -> list[SteeringPlant]:
    plants = identify_plants(axles, [NOISE] * len(axles), STOP, [None] * len(axles))
    assert all(p is not None for p in plants)
    return [p for p in plants if p is not None]


def same(plant: SteeringPlant, valve: ValveMap) -> None:
    assert plant.reliable
    assert plant.valve.slope_up == pytest.approx(valve.slope_up, rel=0.04)
    assert plant.valve.slope_down == pytest.approx(valve.slope_down, rel=0.04)
    assert plant.valve.dead_up == pytest.approx(valve.dead_up, abs=0.001)
    assert plant.valve.dead_down == pytest.approx(valve.dead_down, abs=0.001)
    assert plant.lag == pytest.approx(0.05, abs=0.01)


def test_both_axles_are_found_each_with_its_own_valve() -> None:
    for plant, valve in zip(found(axle(VALVES[0]), axle(VALVES[1], seed=1)), VALVES, strict=True):
        same(plant, valve)
        assert plant.play < 3e-4


@pytest.mark.parametrize("every", [7, 10])
def test_an_angle_that_is_recorded_more_rarely_than_blocks_are_long_is_identified(every: int) -> None:
    blocks = axle(VALVES[0], every=every)
    assert blocks.length == every
    (plant,) = found(blocks)
    assert plant.reliable
    assert plant.valve.slope_up == pytest.approx(VALVES[0].slope_up, rel=0.05)


def test_play_is_found() -> None:
    (plant,) = found(axle(VALVES[0], play=0.0015))
    same(plant, VALVES[0])
    assert plant.play == pytest.approx(0.0015, abs=3e-4)


def test_a_loss_over_half_of_the_mission_does_not_bend_the_valve() -> None:
    for plant, valve in zip(found(axle(VALVES[0], lost=(0.5, 20, 60)), axle(VALVES[1], seed=1)), VALVES, strict=True):
        same(plant, valve)


def test_beyond_the_openings_that_were_seen_the_rate_is_uncertain() -> None:
    (plant,) = found(axle(VALVES[0], reach=0.08))
    inside, outside = plant.spread(np.array([0.04, 0.6]))
    assert inside < 0.01 < outside


def test_an_axle_that_rests_has_no_plant() -> None:
    still = np.random.default_rng(2).normal(0.0, 5e-4, 20_000)
    always = np.ones(still.size, np.bool_)
    assert identify_plants([blocks_of(still, -still, always, always, DT)], [NOISE], STOP, [None]) == [None]


def test_a_noisy_angle_of_one_axle_does_not_hide_how_the_other_turns() -> None:
    loud = 0.2
    noises = [NOISE, replace(NOISE, white=loud**2)]
    plants = identify_plants([axle(VALVES[0]), axle(VALVES[1], noise=loud, every=25)], noises, STOP, [None, None])
    assert plants[0] is not None
    same(plants[0], VALVES[0])
