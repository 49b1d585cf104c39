"""Whether the transporter of `all_clear.py` and its faults do what they say."""

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
SEEDS, LENGTH = (2, 4, 6), 40.0
_A, _B = 8.0, 36.0
_SPAN = slice(9_000, 36_000)


@pytest.fixture(scope="module")
def machine() -> Iterator[ModuleType]:
    sys.path.insert(0, str(BENCHMARKS))
    import transporter

    yield transporter
    sys.path.remove(str(BENCHMARKS))


def fault(part: str, side: Side, mode: FaultMode, epsilon: float = 1.0, sat: float = 0.0) -> FaultSpec:
    return FaultSpec(part, side, mode, _A, _B, epsilon, sat, 0.0, 0.0, 0.0)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_healthy_transporter_follows_its_commands(machine: ModuleType, seed: int) -> None:
    ref, true, read, given, done, body, source = machine.driven(seed, (), 75.0)
    made = machine.build(seed)[0]
    told = np.abs(ref[:, :4]) > 0.05 * made.top
    assert np.abs(ref[:, :4]).max() > 0.3 * made.top
    assert np.abs(true[:, :4] - ref[:, :4])[told].mean() < 0.08 * made.top
    assert np.abs(true[:, :4] - read[:, :4]).mean() < 0.03 * made.top
    assert np.abs(true[:, 4:] - ref[:, 4:]).mean() < 0.03
    assert np.abs((given - done).mean(axis=0)).max() < 0.02
    assert 0.35 <= source[:, 1].min() <= source[:, 1].max() < 1.15
    assert source[:, 0].max() <= made.most + 2.0 * made.margin
    assert np.abs(true[:, :4].mean(axis=1) - body[:, 0]).max() < 0.1 * made.top  # none spins


@pytest.mark.parametrize("load", [0.1, 0.45, 0.95])
def test_a_motor_that_pulls_takes_more_flow_for_the_same_speed(machine: ModuleType, load: float) -> None:
    import transporter_physics as physics

    made, parts = machine.build(4)
    made = made._replace(friction=1e-3 * made.friction, leakage=1e-4 * made.leakage, slope=0.0, begins=0.3 * made.most)
    made = made._replace(span=0.3 * made.most)
    part, w = np.where(np.arange(9) == physics.PLUS, 1.0, parts[0]), np.zeros(17)
    part[physics.RUB], s = 0.0, np.array([made.most + made.margin, 0.0, 1.0, 1.0])
    w[physics.SIZE] = made.small
    for _ in range(12_000):
        torque, _, _ = physics.motor(w, part, 0.5, s, False, made)
        pull = load * made.most * made.motor * w[physics.SIZE]
        physics.turn_wheel(w, part, torque, pull / made.radius, made.radius, 0.0, 0.0, made)
    grown = min(max((load - 0.3) / 0.3, 0.0), 1.0)
    size = made.small + (1.0 - made.small) * grown
    assert w[physics.SIZE] == pytest.approx(size, abs=0.1)
    assert w[physics.TURN] * made.radius == pytest.approx(0.5 * made.full * made.small / w[physics.SIZE], rel=0.06)


def test_an_accumulator_holds_the_pressure_that_a_load_has_left(machine: ModuleType) -> None:
    import transporter_physics as physics

    made = machine.build(4)[0]
    s = np.array([0.7 * made.most, 0.0, 1.0, 1.0])
    for _ in range(round(1.0 / physics.H)):
        physics.supply_of(s, 0.0, 0.0, 1.0, made)
    kept = s[physics.P]
    for _ in range(round(1.0 / physics.H)):
        physics.supply_of(s, 0.5 * made.pump, 0.0, 1.0, made)
    assert kept > 0.6 * made.most
    assert s[physics.P] < 0.5 * made.most


def test_a_coil_tells_nothing_of_slow_teeth(machine: ModuleType) -> None:
    import transporter_physics as physics

    made, parts = machine.build(4)
    for share, says in ((0.8, False), (1.5, True), (-3.0, True)):
        w, speed = np.zeros(17), share * parts[0, physics.DEAF]
        w[physics.FORE] = -1.0
        for k in range(round(2.0 / physics.H)):
            w[physics.TURN] = speed / made.radius
            w[physics.ROLLED] += physics.H * w[physics.TURN]
            physics.coil(w, parts[0], k * physics.H, made)
            if k % made.gate == 0:
                physics.gated(w, parts[0], k * physics.H, made)
        assert w[physics.READ] == pytest.approx(speed * parts[0, physics.SCALE] if says else 0.0, rel=0.02)


def test_brakes_are_shut_where_it_rests_and_it_does_not_roll_there(machine: ModuleType) -> None:
    for seed in range(1, 9):
        ref, true, *_, body, source = machine.driven(seed, (), 75.0)
        made = machine.build(seed)[0]
        shut = source[:, 5] == 1.0
        rests = np.convolve((np.abs(ref[:, :4]).max(axis=1) > 0.0) | ~shut, np.ones(1500))[: shut.size] == 0.0
        assert np.abs(body[rests, 0]).max(initial=0.0) < 0.02 * made.top
        assert np.abs(true[rests, :4]).max(initial=0.0) < 0.02 * made.top


def test_some_coast_and_some_are_limited_by_their_engines(machine: ModuleType) -> None:
    sources = [machine.driven(seed, (), 75.0)[-1] for seed in range(1, 9)]
    assert sum(bool(s[:, 4].any()) for s in sources) >= 2
    assert min(float(s[:, 2].min()) for s in sources) < 0.8
    assert max(float(s[:, 3].max()) for s in sources) > 0.95  # motors that grow to their largest


def test_it_crabs_and_counter_steers(machine: ModuleType) -> None:
    same, against = 0, 0
    for seed in range(1, 13):
        _, angle, _, _ = machine.commands(seed, 75.0)
        assert np.abs(angle).max() < 0.5
        bent = np.abs(angle[:, 0]) > 0.1
        same += int((bent & (np.abs(angle[:, 0] - angle[:, 1]) < 1e-3)).sum())
        against += int((bent & (np.abs(angle[:, 0] + angle[:, 1]) < 1e-3)).sum())
    assert same > 20_000
    assert against > 20_000


def test_a_seed_gives_the_same_mission_again_and_another_seed_another(machine: ModuleType) -> None:
    first = machine.signals(3, (), LENGTH, "direct").items
    machine.driven.cache_clear()
    machine.build.cache_clear()
    again, other = (machine.signals(seed, (), LENGTH, "direct").items for seed in (3, 5))
    for name, one in first.items():
        assert np.array_equal(one.values, again[name].values), name
        assert np.array_equal(one.stamps, again[name].stamps), name
    assert not np.array_equal(first["steer.front.phi"].values[:500], other["steer.front.phi"].values[:500])


@pytest.mark.parametrize(
    ("mode", "epsilon", "sat", "share", "own"),
    [
        (FaultMode.NO_SIGNAL, 1.0, 0.0, 0.0, 0.0),
        (FaultMode.STUCK, 1.0, 0.3, 0.0, 0.3),
        (FaultMode.INEFFICIENT, 0.5, 0.0, 0.5, 0.0),
    ],
)
def test_a_valve_that_fails_follows_what_its_fault_says(
    machine: ModuleType, mode: FaultMode, epsilon: float, sat: float, share: float, own: float
) -> None:
    given, done = (machine.driven(4, (fault("FR", Side.ACTUATOR, mode, epsilon, sat),), LENGTH)[k] for k in (3, 4))
    assert np.abs(done[_SPAN, 0] - share * given[_SPAN, 0] - own).mean() < 0.03
    assert np.array_equal(done[:7_900], machine.driven(4, (), LENGTH)[4][:7_900])


def test_a_speed_sensor_that_fails_reads_what_its_fault_says_and_the_wheel_turns_on(machine: ModuleType) -> None:
    _, true, read, *_ = machine.driven(4, (fault("FL", Side.SENSOR, FaultMode.NO_SIGNAL),), LENGTH)
    assert not read[_SPAN, 1].any()
    assert np.abs(true[_SPAN, 1]).max() > 0.3


def test_a_recorder_has_what_its_level_of_evidence_says_at_rates_of_their_own(machine: ModuleType) -> None:
    base, spool, direct = (machine.signals(1, (), LENGTH, tier).items for tier in ("base", "spool", "direct"))
    assert not any(name.endswith(("u_applied", "_true")) for name in base)
    assert "wheel.FR.u_applied" in spool
    assert {"wheel.FR.v_true", "steer.rear.phi_true"} <= direct.keys()
    twice = 0
    for seed in range(1, 7):
        items = machine.signals(seed, (), LENGTH, "direct").items
        for name, rate in (("wheel.FR.v", 50.0), ("wheel.FR.u", 100.0), ("steer.front.phi", 20.0)):
            gaps = np.diff(items[name].stamps)
            assert 1e9 / float(np.median(gaps)) == pytest.approx(rate, rel=0.05)
            twice += int((gaps < 6e5).sum())
        for one in items.values():
            assert (np.diff(one.stamps) > 0).all(), (seed, one.name)
        assert not np.array_equal(items["wheel.FR.v"].stamps[:50], items["wheel.FL.v"].stamps[:50])
    assert twice > 5
