"""Whether the paver of `all_clear.py` and its faults do what they say."""

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
SEEDS, LENGTH = (1, 4, 5), 40.0
_A, _B = 8.0, 36.0
_SPAN = slice(9_000, 36_000)


@pytest.fixture(scope="module")
def machine() -> Iterator[ModuleType]:
    sys.path.insert(0, str(BENCHMARKS))
    import paver

    yield paver
    sys.path.remove(str(BENCHMARKS))


def fault(part: str, side: Side, mode: FaultMode, epsilon: float = 1.0, sat: float = 0.0) -> FaultSpec:
    return FaultSpec(part, side, mode, _A, _B, epsilon, sat, 0.0, 0.0, 0.0)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_healthy_paver_follows_its_commands_while_its_oil_warms(machine: ModuleType, seed: int) -> None:
    ref, true, read, given, done, _, source, under = machine.driven(seed, (), LENGTH)
    made = machine.build(seed)[0]
    assert np.abs(ref[:, :4]).max() > 0.3 * made.top
    assert np.abs(true[:, :4] - ref[:, :4]).mean() < 0.06 * made.top
    assert np.abs(true[:, :4] - read[:, :4]).mean() < 0.03 * made.top
    assert np.abs(true[:, :4] - under).mean() < 0.03 * made.top
    assert np.abs(true[:, 4:] - ref[:, 4:]).mean() < 0.02
    assert np.abs(given[:, :4] - done[:, :4]).mean() < 0.02
    assert source[-1, 1] - source[0, 1] > 15.0


def test_a_wheel_that_nothing_feeds_is_locked_and_one_that_is_fed_is_not(machine: ModuleType) -> None:
    ref, true, *_, source, _ = machine.driven(1, (), LENGTH)
    stands = np.flatnonzero((np.abs(ref[:, :4]).max(axis=1) == 0.0) & (np.abs(true[:, :4]).max(axis=1) < 1e-6))
    assert np.median(source[stands, 4]) > 0.95
    assert np.median(source[np.abs(true[:, 0]) > 0.2, 4]) < 0.5


@pytest.mark.parametrize(
    ("mode", "epsilon", "sat", "share", "own"),
    [
        (FaultMode.NO_SIGNAL, 1.0, 0.0, 0.0, 0.0),
        (FaultMode.STUCK, 1.0, 0.3, 0.0, 0.3),
        (FaultMode.INEFFICIENT, 0.5, 0.0, 0.5, 0.0),
    ],
)
def test_a_valve_that_fails_opens_as_its_fault_says(
    machine: ModuleType, mode: FaultMode, epsilon: float, sat: float, share: float, own: float
) -> None:
    given, done = (machine.driven(4, (fault("FR", Side.ACTUATOR, mode, epsilon, sat),), LENGTH)[k] for k in (3, 4))
    assert np.abs(done[_SPAN, 0] - share * given[_SPAN, 0] - own).mean() < 0.03
    assert np.array_equal(done[:7_900], machine.driven(4, (), LENGTH)[4][:7_900])


def test_a_speed_sensor_that_fails_reads_what_its_fault_says_and_the_wheel_turns_on(machine: ModuleType) -> None:
    _, true, read, *_ = machine.driven(4, (fault("FL", Side.SENSOR, FaultMode.NO_SIGNAL),), LENGTH)
    assert not read[_SPAN, 1].any()
    assert np.abs(true[_SPAN, 1]).max() > 0.1


def test_a_radar_that_looks_at_the_ground_sees_a_locked_wheel_dragged(machine: ModuleType) -> None:
    dead = (fault("FR", Side.ACTUATOR, FaultMode.NO_SIGNAL),)
    tread, ground = (
        machine.signals(4, dead, LENGTH, "direct", ground=g).items["wheel.FR.v_true"] for g in (False, True)
    )
    late = [
        one.values[slice(*np.searchsorted(one.stamps, machine._START_NS + np.array([15, 34]) * 10**9))]
        for one in (tread, ground)
    ]
    assert np.abs(late[0]).mean() < 0.02 < np.abs(late[1]).mean()


def test_a_recorder_has_what_its_level_of_evidence_says(machine: ModuleType) -> None:
    base, spool, direct = (machine.signals(1, (), LENGTH, tier).items for tier in ("base", "spool", "direct"))
    assert not any(name.endswith(("u_applied", "_true")) for name in base)
    assert "wheel.FR.u_applied" in spool
    assert {"wheel.FR.v_true", "steer.rear.phi_true"} <= direct.keys()
    ground, wheel = direct["wheel.FR.v_true"].stamps, direct["wheel.FR.v"].stamps
    assert np.median(np.diff(ground)) > 2 * np.median(np.diff(wheel))  # by radar, at 20 Hz
    for seed in range(1, 7):
        for one in machine.signals(seed, (), LENGTH, "direct").items.values():
            assert (np.diff(one.stamps) > 0).all(), (seed, one.name)
