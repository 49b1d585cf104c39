"""The rate of an axle by the speed of driving is found of all axles alike, and no fault is taken for it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from diagnosis.steering.blocks import SensorNoise, SteeringBlocks, blocks_of
from diagnosis.steering.pace import identified
from diagnosis.steering.valve_map import ValveMap, rate_at
from replay.machine.config import haulotte

DT = 0.005
NOISE = SensorNoise(white=2.5e-7, spread=0.01, step=0.0, lsb=0.0)
VALVE = ValveMap(0.6, 0.6, 0.05, 0.05, 0.4, 0.4)
MACHINE = haulotte()
TIME = np.arange(0.0, 90.0, DT)
SPEED = MACHINE.max_speed * np.interp(TIME, np.linspace(0, 90, 20), [0, 0, 0.5, 0.8, 0.2, 0, 0, 1.0, 0.6, 0.1] * 2)


def axle(seed: int, scrub: float = 0.0, lost: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> SteeringBlocks:
    """An axle that follows a wandering angle, slower by `scrub` while the machine stands; `lost` of its valve, from … to … [s]."""
    rng = np.random.default_rng(seed)
    ref = np.interp(TIME, np.linspace(0, 90, 72), np.repeat(rng.uniform(-0.4, 0.4, 24), 3))
    y, u, phi, rate = np.zeros(TIME.size), np.zeros(TIME.size), 0.0, 0.0
    noise = rng.normal(0.0, 5e-4, TIME.size)
    for k, t in enumerate(TIME):
        y[k] = phi + noise[k]
        u[k] = np.clip(3.0 * (ref[k] - y[k]), -0.8, 0.8)
        opening = u[k] * (1.0 - lost[0]) if lost[1] <= t < lost[2] else u[k]
        slower = 1.0 - scrub * np.exp(-SPEED[k] / (0.12 * MACHINE.max_speed))
        rate += DT / 0.05 * (slower * rate_at(opening, VALVE) - rate)
        phi += DT * rate
    always = np.ones(TIME.size, np.bool_)
    return blocks_of(y, u, always, always, DT)


def paced(axles: list[SteeringBlocks]) -> list[SteeringBlocks]:
    noises, nothing = [NOISE] * len(axles), [None] * len(axles)
    return identified(axles, noises, lambda steps: SPEED[steps], MACHINE, nothing)[0]


def test_scrub_is_found_of_both_axles_alike() -> None:
    front, rear = paced([axle(1, 0.35), axle(2, 0.35)])
    assert_allclose(front.pace, rear.pace)
    standing = front.pace[np.searchsorted(TIME, 2.0) // front.length]
    driving = front.pace[np.searchsorted(TIME, 14.0) // front.length]
    assert standing / driving == pytest.approx(0.65, abs=0.08)


def test_an_axle_that_turns_at_any_speed_alike_has_no_pace() -> None:
    for before, after in zip(axles := [axle(1), axle(2)], paced(axles), strict=True):
        assert after is before


def test_a_fault_of_one_axle_is_no_pace() -> None:
    axles = [axle(1, lost=(0.4, 0.0, 15.0)), axle(2)]  # lost while the machine mostly stands
    assert [a is b for a, b in zip(paced(axles), axles, strict=True)] == [True, True]


def test_an_axle_that_slows_as_the_machine_drives_is_not_explained_so() -> None:
    axles = [replace(a, u=-a.u, mean=-a.mean) for a in (axle(1, -0.35), axle(2, -0.35))]
    assert all(np.ptp(a.pace) < 0.05 for a in paced(axles))
