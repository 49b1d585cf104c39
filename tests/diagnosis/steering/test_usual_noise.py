"""A sensor that is noisy for all of a mission, or half of it: the fault does not become its own noise."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.steering.blocks import SensorNoise, blocks_of, sensor_noise
from diagnosis.steering.inputs import AxleInputs
from diagnosis.steering.usual_noise import with_usual_noises
from replay.machine.config import Noise

DT, SIZE, STOP, OWN = 0.01, 6000, 0.5, 0.0005
TURNS = 0.3 * np.sin(2 * np.pi * np.arange(SIZE) * DT / 12.0)


def axle(name: str, std: Any, dt: float = DT, size: int = SIZE) -> AxleInputs:
    """An axle whose angle has noise of so much, at every sample [rad]."""
    angle = TURNS[:size] + np.random.default_rng(len(name)).normal(0.0, 1.0, size) * std
    always = np.ones(size, np.bool_)
    blocks = blocks_of(angle, np.zeros(size), always, always, dt)
    timeline: Any = SimpleNamespace(dt=dt)
    found = sensor_noise(blocks, angle, Noise(), STOP)
    return AxleInputs(name, timeline, frozenset({"phi", "u"}), np.zeros(size), blocks, found)


def usual(*axles: AxleInputs, stated: dict[str, Noise] | None = None) -> list[SensorNoise]:
    machine: Any = SimpleNamespace(max_steer=STOP, noise=stated or {})
    return [a.noise for a in with_usual_noises(axles, machine)]


def test_healthy_sensors_keep_what_is_found() -> None:
    axles = axle("front", OWN), axle("rear", 3 * OWN)
    assert usual(*axles) == [a.noise for a in axles]


@pytest.mark.parametrize(("others", "most"), [(OWN, 0.01 * STOP), (0.0025, 0.02 * STOP), (0.006, 0.03 * STOP)])
def test_noise_of_a_whole_mission_is_a_few_times_that_of_others_at_most(others: float, most: float) -> None:
    _, rear = usual(axle("front", others), axle("rear", 0.1))
    assert rear.std == pytest.approx(most, rel=0.1)


def test_a_lone_sensor_is_held_to_its_range() -> None:
    assert usual(axle("front", 0.1))[0].std == pytest.approx(0.03 * STOP)


@pytest.mark.parametrize("noisy", [slice(SIZE // 2, None), slice(0, 2 * SIZE // 3)])
def test_of_two_kinds_of_windows_the_one_like_the_others_is_its_own(noisy: slice) -> None:
    std = np.full(SIZE, OWN)
    std[noisy] = 0.004  # within what a sensor may have
    for axles in ((axle("front", OWN), axle("rear", std)), (axle("rear", std),)):
        assert usual(*axles)[-1].std == pytest.approx(OWN, rel=0.1)


def test_two_kinds_that_others_have_as_the_louder_one() -> None:
    std = np.where(np.arange(SIZE) < 0.6 * SIZE, 1e-5, 0.004)
    assert usual(axle("front", 0.004), axle("rear", std))[-1].std == pytest.approx(0.004, rel=0.1)


def test_what_the_machine_file_states_stays() -> None:
    noisy = axle("rear", 0.1)
    assert usual(axle("front", OWN), noisy, stated={"steer.rear.phi": Noise(std=0.1)})[1] == noisy.noise


def test_readings_that_are_as_far_apart_as_the_axle_turns_may_be_its_motion() -> None:
    rare = axle("rear", 0.008, dt=0.2)  # 0.16 rad/s at most are 0.03 rad between readings
    assert usual(axle("front", OWN), rare)[1] == rare.noise


def test_few_windows_of_a_kind_tell_no_noise() -> None:
    """Three of fourteen windows are quiet."""
    std = np.where(np.arange(350) < 75, 1e-5, 0.004)
    brief = axle("rear", std, size=350)
    assert usual(brief) == [brief.noise]
