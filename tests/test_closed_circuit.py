"""Whether the closed-circuit loader of `all_clear.py` and its faults do what they say."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from replay.faults import FaultMode, FaultSpec, Side

BENCHMARKS = Path(__file__).parent / "benchmarks"
pytestmark = pytest.mark.long  # of the campaigns alone: what every run needs of them is in test_all_clear.py
LENGTH = 40.0
_SPAN = slice(13_000, 36_000)


@pytest.fixture(scope="module")
def machine() -> Iterator[ModuleType]:
    sys.path.insert(0, str(BENCHMARKS))
    import closed_circuit

    yield closed_circuit
    sys.path.remove(str(BENCHMARKS))


def fault(part: str, side: Side, mode: FaultMode, epsilon: float = 1.0, sat: float = 0.0) -> FaultSpec:
    return FaultSpec(part, side, mode, 12.0, 36.0, epsilon, sat, 0.0, 0.0, 0.0)


@pytest.mark.parametrize("seed", [500, 502, 503])
def test_a_healthy_loader_follows_its_commands_and_nothing_hunts(machine: ModuleType, seed: int) -> None:
    ref, true, read, given, done, body = machine.driven(seed, (), LENGTH)
    made = machine.build(seed)[0]
    assert np.abs(ref[:, :4]).max() > 0.3 * made.top
    assert np.abs(true[:, :4] - ref[:, :4]).mean() < 0.06 * made.top
    assert np.abs(true[:, :4] - read[:, :4]).mean() < 0.04 * made.top
    assert np.abs(true[:, 4:] - ref[:, 4:]).mean() < 0.02
    assert np.abs(np.diff(read[::40, :4], 2, axis=0)).mean() < 0.02 * made.top
    assert (np.abs(given[:, :4]) > 0.999).mean() < 0.1
    assert np.abs(given - done).mean() < 0.03
    assert 0.8 < body[:, 5].min() <= body[:, 5].max() < 1.1
    assert body[:, 6].max() < 1.15 * made.most


def test_valves_and_sensors_fail_as_their_faults_say(machine: ModuleType) -> None:
    dead = fault("FR", Side.ACTUATOR, FaultMode.NO_SIGNAL)
    given, done = (machine.driven(502, (dead,), LENGTH)[k] for k in (3, 4))
    assert np.abs(done[_SPAN, 0]).max() < 0.02
    assert np.abs(done[_SPAN, 1:4] - given[_SPAN, 1:4]).mean() < 0.04
    loses = fault("FR", Side.ACTUATOR, FaultMode.INEFFICIENT, 0.5)
    given, done = (machine.driven(502, (loses,), LENGTH)[k] for k in (3, 4))
    assert np.abs(done[_SPAN, 0] - 0.5 * given[_SPAN, 0]).mean() < 0.03
    _, true, read, *_ = machine.driven(502, (fault("FL", Side.SENSOR, FaultMode.INEFFICIENT, 0.3),), LENGTH)
    assert np.abs(read[_SPAN, 1] - 0.7 * true[_SPAN, 1]).mean() < 0.05 * machine.build(502)[0].top
    angle = machine.driven(502, (fault("front", Side.ACTUATOR, FaultMode.NO_SIGNAL),), LENGTH)[1]
    assert np.ptp(angle[_SPAN, 4]) < 0.01 < np.ptp(angle[_SPAN, 5])


def test_a_dead_pump_blocks_its_wheel(machine: ModuleType) -> None:
    _, true, *_ = machine.driven(502, (fault("FR", Side.ACTUATOR, FaultMode.NO_SIGNAL),), LENGTH)
    assert np.abs(true[_SPAN, 0]).mean() < 0.5 * np.abs(true[_SPAN, 1]).mean()
