"""Whether the geared closed-circuit carrier of `all_clear.py` and its faults do what they say."""

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
SEEDS, LENGTH = (501, 503, 506), 40.0
_A, _B = 8.0, 36.0
_SPAN = slice(9_000, 36_000)


@pytest.fixture(scope="module")
def machine() -> Iterator[ModuleType]:
    sys.path.insert(0, str(BENCHMARKS))
    import geared_circuit

    yield geared_circuit
    sys.path.remove(str(BENCHMARKS))


@pytest.fixture(scope="module")
def physics(machine: ModuleType) -> ModuleType:
    import geared_circuit_physics

    return geared_circuit_physics


def fault(part: str, side: Side, mode: FaultMode, epsilon: float = 1.0, sat: float = 0.0) -> FaultSpec:
    return FaultSpec(part, side, mode, _A, _B, epsilon, sat, 0.0, 0.0, 0.0)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_healthy_carrier_follows_its_commands_and_nothing_hunts(machine: ModuleType, seed: int) -> None:
    ref, true, read, given, done, _, source = machine.driven(seed, (), LENGTH)
    top = machine.build(seed)[0].top
    assert np.abs(ref[:, :4]).max() > 0.3 * top
    assert np.abs(true[:, :4] - ref[:, :4]).mean() < 0.06 * top
    assert np.abs(true[:, :4] - read[:, :4]).mean() < 0.03 * top
    assert np.abs(true[:, 4:] - ref[:, 4:]).mean() < 0.02
    assert (np.abs(given[:, :4]) > 0.99).mean() < 0.05
    assert np.abs(given - done).mean() < 0.02
    assert source[:, 0].min() > 0.5


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
    given, done = (machine.driven(501, (fault("FR", Side.ACTUATOR, mode, epsilon, sat),), LENGTH)[k] for k in (3, 4))
    assert np.abs(done[_SPAN, 0] - share * given[_SPAN, 0] - own).mean() < 0.02
    assert np.abs(done[_SPAN, 1:4] - given[_SPAN, 1:4]).mean() < 0.03
    assert np.array_equal(done[:7_900], machine.driven(501, (), LENGTH)[4][:7_900])


def test_a_speed_sensor_that_fails_reads_what_its_fault_says_and_the_wheel_turns_on(machine: ModuleType) -> None:
    _, true, read, *_ = machine.driven(501, (fault("FL", Side.SENSOR, FaultMode.NO_SIGNAL),), LENGTH)
    assert not read[_SPAN, 1].any()
    assert np.abs(true[_SPAN, 1]).max() > 0.3
    _, _, read, *_ = machine.driven(501, (fault("FL", Side.SENSOR, FaultMode.STUCK, 1.0, np.nan),), LENGTH)
    assert np.ptp(read[_SPAN, 1]) == 0.0
    _, true, read, *_ = machine.driven(501, (fault("FL", Side.SENSOR, FaultMode.INEFFICIENT, 0.3),), LENGTH)
    assert np.abs(read[_SPAN, 1] - 0.7 * true[_SPAN, 1]).mean() < 0.03 * machine.build(501)[0].top


def test_a_dead_steering_valve_leaves_its_axle_where_it_is(machine: ModuleType) -> None:
    dead = machine.driven(501, (fault("front", Side.ACTUATOR, FaultMode.NO_SIGNAL),), LENGTH)[1]
    assert np.ptp(dead[_SPAN, 4]) < 0.01
    assert np.ptp(dead[_SPAN, 5]) > 0.05


def test_a_circuit_turns_its_motor_at_what_the_pump_gives_and_holds_it_where_that_is_nothing(
    machine: ModuleType, physics: ModuleType
) -> None:
    made, parts = machine.build(501)
    supply = np.array([1.0, made.cold, 1.0])
    w = np.zeros(12)
    w[physics.TURN] = 1.0  # turned by the ground
    torque = [physics.circuit(w, parts[0], supply, made)[0] for _ in range(2000)][-1]
    assert torque < -0.3 * made.small * made.relief
    w = np.zeros(12)
    w[physics.SPOOL] = 0.5
    for _ in range(8000):
        torque, _ = physics.circuit(w, parts[0], supply, made)
        physics.roll(w, parts[0], torque, 0.0, 0.0, 0.0, made)
    wanted = physics.plate_of(0.5, parts[0], made.cold, made) * made.pump / made.small
    assert w[physics.TURN] == pytest.approx(wanted, rel=0.1)


def test_warm_oil_takes_of_the_gain_and_directions_differ(machine: ModuleType, physics: ModuleType) -> None:
    made, parts = machine.build(501)
    cold, warm = (physics.plate_of(0.5, parts[0], made.cold + k * made.warming, made) for k in (0, 1))
    assert warm == pytest.approx((1 - made.fade) * cold)
    assert physics.plate_of(0.9 * parts[0, physics.DEAD], parts[0], made.cold, made) == 0.0
    back = physics.plate_of(-0.5, parts[0], made.cold, made)
    assert back / cold == pytest.approx(-parts[0, physics.MINUS] / parts[0, physics.PLUS])


def test_frames_come_late_and_some_never(machine: ModuleType) -> None:
    every = machine.build(501)[0].frame // 2
    for frame in machine.frames_of(501, 75.0).T:
        gaps = np.diff(np.flatnonzero(frame))
        assert np.median(gaps) == pytest.approx(every, abs=2)
        assert gaps.max() >= 2 * every - 8
        assert gaps.std() > 1.0


def test_a_recorder_has_what_the_level_of_evidence_says(machine: ModuleType) -> None:
    names = {tier: set(machine.signals(501, (), LENGTH, tier).items) for tier in ("base", "spool", "direct")}
    assert {"wheel.FR.v", "wheel.FR.u", "steer.front.u", "steer.rear.phi"} <= names["base"]
    assert {n.split(".", 2)[2] for n in names["spool"] - names["base"]} == {"u_applied"}
    assert {n.split(".", 2)[2] for n in names["direct"] - names["spool"]} == {"v_true", "phi_true"}
    for one in machine.signals(501, (), LENGTH, "direct").items.values():
        assert (np.diff(one.stamps) > 0).all()
        assert np.isfinite(one.values).all()


def test_a_dead_valve_is_no_all_clear(machine: ModuleType) -> None:
    import all_clear

    names = [t.name for t in all_clear.troubles(60.0)]
    found = all_clear.run(
        all_clear.Task(machine.NAME, names.index("FR valve dead, whole"), 501, 60.0, ("base", "direct"))
    )
    assert [o.tier for o in found] == ["base", "direct"]
    assert not any(o.outcome in ("cleared", "crashed") for o in found)
