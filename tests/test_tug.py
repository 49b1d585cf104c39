"""Whether the tug of `all_clear.py` and its faults do what they say."""

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
SEEDS, LENGTH = (1, 4, 6), 40.0
_A, _B = 8.0, 36.0
_SPAN = slice(9_000, 36_000)


@pytest.fixture(scope="module")
def machine() -> Iterator[ModuleType]:
    sys.path.insert(0, str(BENCHMARKS))
    import tug

    yield tug
    sys.path.remove(str(BENCHMARKS))


def fault(part: str, side: Side, mode: FaultMode, epsilon: float = 1.0, sat: float = 0.0) -> FaultSpec:
    return FaultSpec(part, side, mode, _A, _B, epsilon, sat, 0.0, 0.0, 0.0)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_healthy_tug_follows_its_commands(machine: ModuleType, seed: int) -> None:
    ref, true, read, given, done, _, source = machine.driven(seed, (), LENGTH)
    made = machine.build(seed)[0]
    assert np.abs(ref[:, :4]).max() > 0.3 * made.top
    assert np.abs(true[:, :4] - ref[:, :4]).mean() < 0.02 * made.top
    assert np.abs(true[:, :4] - read[:, :4]).mean() < 0.03 * made.top
    assert np.abs(true[:, 4:] - ref[:, 4:]).mean() < 0.02
    assert np.abs(given - done).mean() < 0.02
    assert 0.7 < source[:, 0].min() <= source[:, 0].max() < 1.1


def test_inverters_hide_an_aircraft_that_hangs_on_the_bar_and_are_at_their_limits_at_times(machine: ModuleType) -> None:
    strained, limited = [], 0.0
    for seed in range(1, 15):
        _, angle, towed = machine.commands(seed, 75.0)
        *_, source = machine.driven(seed, (), 75.0)
        limited = max(limited, float(source[:, 4].max()))
        if towed.max() > 1.0:
            strained.append(float(source[towed > 1.0, 1].max()))
        assert np.abs(angle).max() < 0.5
    assert max(strained) > 0.5
    assert limited == 4.0


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_trim_gives_more_of_what_its_wheel_lacks_either_way(machine: ModuleType, sign: float) -> None:
    import tug_control
    import tug_physics

    made = machine.build(4)[0]._replace(cap=0.15, integral=0.1)
    w = np.zeros(15)
    for _ in range(200):
        tug_control.wheel_law(w, sign * 0.5 * made.top, sign * 0.4 * made.top, False, 0.01, made)
    plain = made.forward * 0.5 * made.top / (made.radius * made.full)
    assert sign * w[tug_physics.ASKED] > plain + 0.01


@pytest.mark.parametrize(
    ("mode", "epsilon", "sat", "share", "own"),
    [
        (FaultMode.NO_SIGNAL, 1.0, 0.0, 0.0, 0.0),
        (FaultMode.STUCK, 1.0, 0.3, 0.0, 0.3),
        (FaultMode.INEFFICIENT, 0.5, 0.0, 0.5, 0.0),
    ],
)
def test_an_inverter_that_fails_follows_what_its_fault_says(
    machine: ModuleType, mode: FaultMode, epsilon: float, sat: float, share: float, own: float
) -> None:
    given, done = (machine.driven(4, (fault("FR", Side.ACTUATOR, mode, epsilon, sat),), LENGTH)[k] for k in (3, 4))
    assert np.abs(done[_SPAN, 0] - share * given[_SPAN, 0] - own).mean() < 0.03
    assert np.array_equal(done[:7_900], machine.driven(4, (), LENGTH)[4][:7_900])


def test_a_speed_sensor_that_fails_reads_what_its_fault_says_and_the_wheel_turns_on(machine: ModuleType) -> None:
    _, true, read, *_ = machine.driven(4, (fault("FL", Side.SENSOR, FaultMode.NO_SIGNAL),), LENGTH)
    assert not read[_SPAN, 1].any()
    assert np.abs(true[_SPAN, 1]).max() > 0.3


def test_a_recorder_has_what_its_level_of_evidence_says(machine: ModuleType) -> None:
    base, spool, direct = (machine.signals(1, (), LENGTH, tier).items for tier in ("base", "spool", "direct"))
    assert not any(name.endswith(("u_applied", "_true")) for name in base)
    assert "wheel.FR.u_applied" in spool
    assert {"wheel.FR.v_true", "steer.rear.phi_true"} <= direct.keys()
    for seed in range(1, 7):
        for one in machine.signals(seed, (), LENGTH, "direct").items.values():
            assert (np.diff(one.stamps) > 0).all(), (seed, one.name)
