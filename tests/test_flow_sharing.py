"""Whether the flow-sharing carrier of `all_clear.py` and its faults do what they say."""

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
SEEDS, LENGTH = (500, 502, 503), 40.0
_A, _B = 12.0, 36.0
_SPAN = slice(13_000, 36_000)


@pytest.fixture(scope="module")
def machine() -> Iterator[ModuleType]:
    sys.path.insert(0, str(BENCHMARKS))
    import flow_sharing

    yield flow_sharing
    sys.path.remove(str(BENCHMARKS))


@pytest.fixture(scope="module")
def physics(machine: ModuleType) -> ModuleType:
    import flow_sharing_physics

    return flow_sharing_physics


def fault(
    part: str, side: Side, mode: FaultMode, epsilon: float = 1.0, sat: float = 0.0, std: float = 0.0
) -> FaultSpec:
    return FaultSpec(part, side, mode, _A, _B, epsilon, sat, std, 0.05 if std else 0.0, 0.0)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_healthy_carrier_follows_its_commands_and_nothing_hunts(machine: ModuleType, seed: int) -> None:
    ref, true, read, given, done, _, _ = machine.driven(seed, (), LENGTH)
    top = machine.build(seed)[0].top
    assert np.abs(ref[:, :4]).max() > 0.3 * top
    assert np.abs(true[:, :4] - ref[:, :4]).mean() < 0.07 * top
    assert np.abs(true[:, :4] - read[:, :4]).mean() < 0.04 * top
    assert np.abs(true[:, 4:] - ref[:, 4:]).mean() < 0.02
    assert np.abs(np.diff(read[::40, :4], 2, axis=0)).mean() < 0.01 * top
    assert (np.abs(given[:, :4]) > 0.999).mean() < 0.2
    assert np.abs(given - done).mean() < 0.03


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
    given, done = (machine.driven(502, (fault("FR", Side.ACTUATOR, mode, epsilon, sat),), LENGTH)[k] for k in (3, 4))
    assert np.abs(done[_SPAN, 0] - share * given[_SPAN, 0] - own).mean() < 0.03
    assert np.abs(done[_SPAN, 1:4] - given[_SPAN, 1:4]).mean() < 0.04
    assert np.array_equal(done[:11_900], machine.driven(502, (), LENGTH)[4][:11_900])


def test_a_noisy_valve_shakes(machine: ModuleType) -> None:
    given, done = (
        machine.driven(502, (fault("RL", Side.ACTUATOR, FaultMode.NOISY, 0.4, 0.0, 0.4),), LENGTH)[k] for k in (3, 4)
    )
    wrong = (done - given)[_SPAN, :4]
    assert wrong[:, 3].std() > 2 * wrong[:, :3].std()


def test_a_wheel_whose_valve_is_dead_pushes_no_more_and_drags(machine: ModuleType) -> None:
    ref, true, *_ = machine.driven(502, (fault("FR", Side.ACTUATOR, FaultMode.NO_SIGNAL),), LENGTH)
    driven = np.abs(ref[_SPAN, 0]) > 0.2 * machine.build(502)[0].top
    gap = np.abs(true - ref)[_SPAN][driven].mean(axis=0)
    healthy, sound, *_ = machine.driven(502, (), LENGTH)
    assert gap[0] > 1.2 * gap[1:4].max()
    assert gap[0] > 3 * np.abs(sound - healthy)[_SPAN][driven].mean(axis=0)[0]


def test_a_speed_sensor_that_fails_reads_what_its_fault_says_and_the_wheel_turns_on(machine: ModuleType) -> None:
    _, true, read, *_ = machine.driven(502, (fault("FL", Side.SENSOR, FaultMode.NO_SIGNAL),), LENGTH)
    assert not read[_SPAN, 1].any()
    assert np.abs(true[_SPAN, 1]).max() > 0.1
    _, _, read, *_ = machine.driven(502, (fault("FL", Side.SENSOR, FaultMode.STUCK, 1.0, np.nan),), LENGTH)
    assert np.ptp(read[_SPAN, 1]) == 0.0
    _, true, read, given, *_ = machine.driven(502, (fault("FL", Side.SENSOR, FaultMode.INEFFICIENT, 0.3),), LENGTH)
    assert np.abs(read[_SPAN, 1] - 0.7 * true[_SPAN, 1]).mean() < 0.05 * machine.build(502)[0].top
    healthy = machine.driven(502, (), LENGTH)[3]  # the ground holds the wheel's speed, its valve opens more
    assert np.abs(given[_SPAN, 1]).mean() > np.abs(healthy[_SPAN, 1]).mean() + 0.05


def test_a_dead_steering_valve_leaves_its_axle_where_it_is_and_a_stuck_one_runs_to_the_end(
    machine: ModuleType,
) -> None:
    dead = machine.driven(502, (fault("front", Side.ACTUATOR, FaultMode.NO_SIGNAL),), LENGTH)[1]
    assert np.ptp(dead[_SPAN, 4]) < 0.01
    assert np.ptp(dead[_SPAN, 5]) > 0.05
    stuck = machine.driven(502, (fault("front", Side.ACTUATOR, FaultMode.STUCK, 1.0, 0.5),), LENGTH)[1]
    assert stuck[35_000, 4] > 0.55


def test_too_little_flow_is_shared_in_proportion(machine: ModuleType, physics: ModuleType) -> None:
    made, parts = machine.build(502)
    part = parts[0].copy()
    part[physics.LEAK] = 0.0
    flows = []
    for share in (1.0, 0.5):
        supply = np.array([0.0, 0.0, share, 1.0, 45.0, 1.0])
        flows.append([physics.motor(np.zeros(12), part, area, supply, made)[1] for area in (0.3, -0.6)])
    assert np.allclose(flows[1], np.array(flows[0]) / 2)
    assert flows[0][1] == pytest.approx(2 * flows[0][0])


def test_a_brake_valve_holds_a_load_that_pulls(machine: ModuleType, physics: ModuleType) -> None:
    made, parts = machine.build(502)
    w = np.zeros(12)
    w[physics.TURN] = 1.0  # turned by the ground; the valve feeds half of what it takes
    supply = np.array([0.0, 0.0, 1.0, 1.0, 45.0, 1.0])
    area = 0.5 * made.small / made.flow
    torque = [physics.motor(w, parts[0], area, supply, made)[0] for _ in range(2000)][-1]
    assert w[physics.PA] < made.pilot
    assert torque < -0.3 * made.small * made.relief


def test_the_edges_of_a_valve_and_the_two_ways_of_a_cylinder_differ(machine: ModuleType, physics: ModuleType) -> None:
    made, parts = machine.build(502)
    right, left = physics.edge_of(0.5, parts[0], made), physics.edge_of(-0.5, parts[0], made)
    assert right > -1.02 * left > 0
    assert physics.edge_of(0.9 * parts[0, physics.OVERLAP], parts[0], made) == 0.0
    ways = []
    for want in (1.0, -1.0):
        x = np.zeros(6)
        for _ in range(1000):
            physics.steer(x, 0, want, 1.0, 1.0, made)
        ways.append(abs(x[physics.ROD]))
    assert ways[0] > (1 + made.asymmetry) * ways[1]


def test_hot_oil_leaks_more(machine: ModuleType, physics: ModuleType) -> None:
    made, parts = machine.build(502)
    left = []
    for oil in (20.0, 70.0):
        w, supply = np.zeros(12), np.array([0.0, 0.0, 1.0, 1.0, oil, 1.0])
        w[physics.PA] = 0.5 * made.most
        for _ in range(200):
            physics.motor(w, parts[0], 0.0, supply, made)
        left.append(w[physics.PA])
    assert left[1] < 0.95 * left[0]


def test_a_pole_wheel_shows_a_steady_speed_and_learns_a_new_direction_late(machine: ModuleType) -> None:
    import flow_sharing_control as control

    made = machine.build(502)[0]
    e, turned, shown = np.zeros(8), 0.0, []
    e[control.PERIOD], e[control.AT] = 1e3, -10.0
    speed = 0.5 * made.top / made.radius
    for k in range(8000):
        rate = speed if k < 4000 else -speed
        turned += rate * 0.0005
        control.pole(e, turned, rate, k * 0.0005, made)
        shown.append(control.shown(e, k * 0.0005, made))
    assert np.abs(np.array(shown[1000:4000]) / (0.5 * made.top) - 1).max() < 0.06
    assert shown[4001] > 0
    assert np.abs(np.array(shown[5000:]) / (-0.5 * made.top) - 1).max() < 0.06


def test_a_recorder_has_what_the_level_of_evidence_says(machine: ModuleType) -> None:
    names = {tier: set(machine.signals(502, (), LENGTH, tier).items) for tier in ("base", "spool", "direct")}
    assert {"wheel.FR.v", "wheel.FR.u", "steer.front.u", "steer.rear.phi"} <= names["base"]
    assert {n.split(".", 2)[2] for n in names["spool"] - names["base"]} == {"u_applied"}
    assert {n.split(".", 2)[2] for n in names["direct"] - names["spool"]} == {"v_true", "phi_true"}
    for one in machine.signals(502, (), LENGTH, "direct").items.values():
        assert (np.diff(one.stamps) > 0).all()
        assert np.isfinite(one.values).all()


def test_a_dead_valve_is_no_all_clear(machine: ModuleType) -> None:
    import all_clear

    names = [t.name for t in all_clear.troubles(60.0)]
    found = all_clear.run(
        all_clear.Task(machine.NAME, names.index("FR valve dead, whole"), 502, 60.0, ("base", "direct"))
    )
    assert [o.tier for o in found] == ["base", "direct"]
    assert not any(o.outcome in ("cleared", "crashed") for o in found)
