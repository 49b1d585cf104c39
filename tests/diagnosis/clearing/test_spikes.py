"""Single readings of a speed that leap and come back are its sensor's noise, however few; what the wheel does, or a recorder, is none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.clearing.checks import checks_of
from diagnosis.clearing.spikes import fault_of_spikes
from diagnosis.clearing.standing_out import what_stands_out
from diagnosis.results.assessment import Finding
from diagnosis.results.machine_words import HYDRAULIC
from replay.faults import FaultMode, Side
from replay.simulation.options import SimulatedMission
from tests.diagnosis.clearing.missions import LENGTH, in_cells, simulated

MISSION = simulated(seed=5)


def _leaping(share: float, height: float = 1.0, *, names: tuple[str, ...] = ("wheel.FL.v",)) -> SimulatedMission:
    """With a share of the readings of a third of the mission off by a height, up or down."""
    rng, size = np.random.default_rng(2), MISSION.stamps.size
    leaps = np.where(rng.random(size) < share, height * rng.choice([-1.0, 1.0], size), 0.0)
    leaps[: size // 3] = leaps[2 * size // 3 :] = 0.0
    return replace(MISSION, columns={**MISSION.columns, **{n: MISSION.columns[n] + leaps for n in names}})


def _found(mission: SimulatedMission, *, base: bool = True) -> Finding | None:
    return fault_of_spikes("FL", in_cells(mission, base=base))


@pytest.mark.parametrize("share", [0.01, 0.03])
def test_leaps_of_few_readings_are_one_noise_of_the_sensor(share: float) -> None:
    cells = in_cells(_leaping(share), base=True)
    fault = what_stands_out(checks_of(cells, HYDRAULIC), cells, HYDRAULIC)["FL"]
    assert (fault.side, fault.mode) == (Side.SENSOR, FaultMode.NOISY)
    assert fault.start * cells.timeline.dt == pytest.approx(LENGTH / 3, abs=2.0)
    assert fault.stop * cells.timeline.dt == pytest.approx(2 * LENGTH / 3, abs=2.0)
    assert fault.evidence[0].startswith("Spikes: ")


def test_a_second_speed_that_does_not_leap_says_so_and_one_that_does_denies_it() -> None:
    fault = _found(_leaping(0.02), base=False)
    assert fault is not None
    assert fault.evidence[-1] == "wheel.FL.v_true does not leap with them."
    assert _found(_leaping(0.02, names=("wheel.FL.v", "wheel.FL.v_true")), base=False) is None


def test_a_healthy_speed_a_few_leaps_and_a_coarse_reading_are_no_spikes() -> None:
    assert _found(MISSION) is None
    assert _found(_leaping(0.0008)) is None
    assert _found(_leaping(0.5)) is None


@pytest.mark.parametrize(("noise", "leaps", "told"), [(0.1, 0.0, False), (0.02, 0.0, False), (0.02, 0.03, True)])
def test_a_wheel_that_mostly_stands_is_held_to_its_noise_while_it_turns(noise: float, leaps: float, told: bool) -> None:
    rng, size = np.random.default_rng(3), MISSION.stamps.size
    turns = np.arange(size) > 0.7 * size
    speed = 0.6 + noise * rng.normal(size=size) + np.where(rng.random(size) < leaps, 1.0, 0.0)
    mission = replace(MISSION, columns={**MISSION.columns, "wheel.FL.v": np.where(turns, speed, 0.0)})
    assert (_found(mission) is not None) == told


@pytest.mark.parametrize(("leaps", "told"), [(0.0, False), (0.02, True)])
def test_a_reading_that_is_one_tick_off_those_beside_it_is_how_it_is_counted(leaps: float, told: bool) -> None:
    """Times between teeth in ticks: a step of the speed grows with its square, and is a tenth of the top speed there."""
    rng, size, tick = np.random.default_rng(4), MISSION.stamps.size, 0.3
    top = in_cells(MISSION, base=True).machine.max_speed
    true = top * (0.6 + 0.3 * np.sin(np.arange(size) * 0.01))
    counted = np.rint(1.0 / (tick / top * true)) + np.where(rng.random(size) < 0.01, 1.0, 0.0)
    speed = top / (tick * counted) + np.where(rng.random(size) < leaps, 2.0 * top, 0.0)
    assert (_found(replace(MISSION, columns={**MISSION.columns, "wheel.FL.v": speed})) is not None) == told
