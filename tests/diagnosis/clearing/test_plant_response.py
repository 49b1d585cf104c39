"""Speed per opening against the machine file's [plant]: a loss of all wheels shows, one that no file speaks of is not asked for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.clearing.checks import cells_of, checks_of
from diagnosis.clearing.plant_response import LIMIT, PART, _for_a_part
from diagnosis.results.clearing import Check, Checked
from diagnosis.results.machine_words import HYDRAULIC
from replay.arrays.envelope import bucket_of
from replay.control.loop import replay_loop
from replay.faults import FaultMode, FaultSpec, Side
from replay.machine.config import Machine, Plant, WheelPlant, haulotte
from replay.signals.timeline import align
from tests.diagnosis.clearing.missions import LENGTH, signals_of, simulated

GAIN = 1.0  # of the file, to find what the simulated wheels have


def by_file(gain: float | None, *faults: FaultSpec, base: bool = False, held: bool = False) -> list[Checked]:
    """The checks beside a file whose wheels all have this gain [m/s]; `held`: one has more, one less, and the ground holds them."""
    machine: Machine = haulotte()
    plant = {} if gain is None else {w: WheelPlant(gain, 0.1) for w in machine.wheels}
    if gain is not None and held:
        shares = dict(zip(machine.wheels, (1.3, 0.7, 1.0, 1.0), strict=True))
        plant = {w: WheelPlant(gain * shares[w], 2.0, grip=30.0) for w in machine.wheels}
    machine = replace(machine, plant=Plant(wheels=plant))
    timeline = align(signals_of(simulated(*faults), base=base))
    cells = cells_of(timeline, replay_loop(timeline, machine, bucket_of(timeline.size)), machine)
    return [c for c in checks_of(cells, HYDRAULIC) if c.check is Check.PLANT_RESPONSE]


@pytest.fixture(scope="module")
def own_gain() -> float:
    """Gain of the simulated wheels: a file that says half of it is off by a factor of two."""
    found = by_file(GAIN)
    assert len(found) == 4
    worst = sorted(c.worst for c in found if c.worst is not None)
    return next(
        g for g in (GAIN * 2.718281828 ** (s * worst[1]) for s in (-1.0, 1.0)) if all(c.passed for c in by_file(g))
    )


@pytest.mark.parametrize("base", [True, False])
def test_what_all_wheels_lose_shows_beside_the_file(own_gain: float, *, base: bool) -> None:
    assert all(c.passed for c in by_file(own_gain, base=base))
    lost = [FaultSpec(w, Side.SENSOR, FaultMode.INEFFICIENT, 0.0, LENGTH, 0.3) for w in haulotte().wheels]
    found = by_file(own_gain, *lost, base=base)
    assert [c.passed for c in found] == [False] * 4
    assert all("off that of [plant] in the machine file by a factor of 1." in c.text for c in found)


def test_wheels_that_the_ground_holds_are_asked_together(own_gain: float) -> None:
    """How a fit shares among them what all of them give is chance; behind the ground they are quicker than their valves."""
    sound = by_file(own_gain, held=True)
    assert all(c.passed for c in sound)
    assert len({c.worst for c in sound}) == 1
    lost = [FaultSpec(w, Side.SENSOR, FaultMode.INEFFICIENT, 0.0, LENGTH, 0.3) for w in haulotte().wheels]
    assert [c.passed for c in by_file(own_gain, *lost, held=True)] == [False] * 4


def test_what_all_wheels_come_to_lose_shows_for_its_part(own_gain: float) -> None:
    """Half of the mission is half of what is usual."""
    lost = [FaultSpec(w, Side.SENSOR, FaultMode.INEFFICIENT, 0.55 * LENGTH, LENGTH, 0.4) for w in haulotte().wheels]
    found = by_file(own_gain, *lost)
    assert [c.passed for c in found] == [False] * 4
    one = by_file(own_gain, lost[0])
    assert sum(c.passed for c in one) >= 3  # what one wheel does is its own


def test_two_wheels_that_lose_for_ten_seconds_show_where_the_file_fits() -> None:
    every = np.random.default_rng(1).normal(0.0, 0.02, (140, 4))
    every[40:64, 2:] += np.log(0.7)
    found = _for_a_part(list(every.T), 0.5, 3)
    assert found is not None
    assert found.limit == LIMIT
    assert found.off == pytest.approx(-np.log(0.7), abs=0.05)
    every[:, 2:] += np.random.default_rng(2).normal(0.0, 0.3, (140, 1))
    rough = _for_a_part(list(every.T), 0.5, 3)
    assert rough is not None
    assert rough.limit == PART
    assert _for_a_part(list(every.T[:2]), 0.5, 3) is _for_a_part([every[:9, 0]] * 4, 0.5, 3) is None


def test_without_a_file_nothing_is_asked() -> None:
    assert by_file(None) == []


def test_two_driven_wheels_that_lose_together_for_a_while_are_off_their_plants() -> None:
    rng = np.random.default_rng(3)
    every = 0.02 * rng.standard_normal((160, 2))
    every[60:90] -= 0.3
    found = _for_a_part(list(every.T), 0.5, 2)
    assert found is not None
    assert found.limit == LIMIT
    assert 0.25 < found.off < 0.35
