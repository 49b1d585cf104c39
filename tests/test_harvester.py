"""Whether the harvester of `all_clear.py` and its faults do what they say."""

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
SEEDS, LENGTH = (1, 3, 6), 40.0
_A, _B = 8.0, 36.0
_SPAN = slice(9_000, 36_000)


@pytest.fixture(scope="module")
def machine() -> Iterator[ModuleType]:
    sys.path.insert(0, str(BENCHMARKS))
    import harvester

    yield harvester
    sys.path.remove(str(BENCHMARKS))


def fault(part: str, side: Side, mode: FaultMode, epsilon: float = 1.0, sat: float = 0.0) -> FaultSpec:
    return FaultSpec(part, side, mode, _A, _B, epsilon, sat, 0.0, 0.0, 0.0)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_healthy_harvester_follows_its_commands(machine: ModuleType, seed: int) -> None:
    ref, true, read, given, done, body, source = machine.driven(seed, (), 75.0)
    made = machine.build(seed)[0]
    told = np.abs(ref[:, :4]) > 0.05 * made.top
    assert np.abs(ref[:, :4]).max() > 0.3 * made.top
    assert np.abs(true[:, :4] - ref[:, :4])[told].mean() < 0.08 * made.top
    assert np.abs(true[:, :4] - read[:, :4]).mean() < 0.03 * made.top
    assert np.abs(true[:, 4:] - ref[:, 4:]).mean() < 0.03
    assert np.abs((given - done).mean(axis=0)).max() < 0.02
    assert 0.35 < source[:, 2].min() <= source[:, 2].max() < 1.15
    assert source[:, :2].max() <= 1.2 * made.most
    assert np.abs(true[:, :4].mean(axis=1) - body[:, 0]).max() < 0.15 * made.top  # none spins


def test_a_section_gives_less_under_load_and_hands_on_what_it_is_given(machine: ModuleType) -> None:
    import harvester_physics as physics

    made = machine.build(4)[0]
    light, heavy, slow = (
        np.array([physics.section(x, 0.1, flow, load * 1e5, made.rest_drop, made) for x in np.linspace(0.0, 1.0, 40)])
        for flow, load in ((1.0, 10.0), (1.0, 60.0), (0.6, 60.0))
    )
    for got in (light, heavy, slow):
        assert (np.diff(got[:, 0]) >= -1e-9).all()
        assert got[0, 0] == 0.0
        assert got[-1, 0] > 0.55
    moves = [int(np.flatnonzero(got[:, 0] > 0.02)[0]) for got in (light, heavy, slow)]
    assert moves[0] < moves[1] < moves[2]  # the opening at which a wheel begins to move goes by load and by flow
    past = (1.0 - 0.3 / made.closes) ** 2 / np.sqrt(made.rest_drop)
    got, drop = physics.section(0.3, 0.1, 1.0, 5e5, made.rest_drop, made)
    through = (0.2 / 0.9) ** made.curve * np.sqrt(max(drop - 5e5, 0.0) / made.in_drop)
    assert got + past * np.sqrt(drop) == pytest.approx(1.0)
    assert got == pytest.approx(through, abs=1e-6)


def test_the_map_of_the_law_inverts_a_section(machine: ModuleType) -> None:
    import harvester_physics as physics

    made = machine.build(4)[0]
    for share in (0.05, 0.3, 0.7):
        x = physics.opening_for(share, 0.1, 0.9, 2e6, made)
        assert physics.section(x, 0.1, 0.9, 2e6, made.known_drop, made)[0] == pytest.approx(share, abs=0.01)


def test_a_counter_tells_the_direction_late_and_the_speed_of_its_last_windows(machine: ModuleType) -> None:
    import harvester_physics as physics

    made, parts = machine.build(4)
    w, counts = np.zeros(17), np.zeros(physics.COUNTS)
    w[physics.BIT] = 1.0
    seen = []
    for k in range(400):
        w[physics.ROLLED] += 0.01 * (0.5 if k < 200 else -0.5) / made.radius
        physics.count(w, parts[0], counts, k, made)
        seen.append(w[physics.READ])
    step = made.pitch / (0.01 * made.windows)
    assert np.mean(seen[100:200]) == pytest.approx(0.5 * parts[0, physics.SCALE], rel=0.02)
    assert np.mean(seen[300:]) == pytest.approx(-0.5 * parts[0, physics.SCALE], rel=0.02)
    assert seen[200] > -step  # its bit has not turned yet


def test_a_wheel_that_blocks_takes_its_neighbours_pressure(machine: ModuleType) -> None:
    import harvester_physics as physics

    made = machine.build(4)[0]
    s, drops = np.zeros(6), np.array([0.9 * made.most, 1e6, 0.5 * made.most, 1e6])
    s[physics.ENGINE] = 1.0
    for _ in range(2000):
        physics.supply_of(s, drops, 0.0, 1.0, made)
    assert s[physics.SPILL_R] > 0.3
    assert s[physics.SPILL_L] == pytest.approx(0.0, abs=1e-6)
    assert s[physics.P_R] > made.most


def test_brakes_are_shut_where_it_rests_and_it_does_not_roll_there(machine: ModuleType) -> None:
    for seed in range(1, 9):
        ref, true, *_, body, source = machine.driven(seed, (), 75.0)
        made = machine.build(seed)[0]
        shut = source[:, 4] == 1.0
        rests = np.convolve((np.abs(ref[:, :4]).max(axis=1) > 0.0) | ~shut, np.ones(1500))[: shut.size] == 0.0
        assert np.abs(body[rests, 0]).max(initial=0.0) < 0.02 * made.top
        assert np.abs(true[rests, :4]).max(initial=0.0) < 0.02 * made.top


def test_ranges_locks_and_the_relief_occur(machine: ModuleType) -> None:
    asks = [machine.commands(seed, 75.0) for seed in range(1, 13)]
    assert sum(bool(a[4].any()) for a in asks) >= 2
    assert sum(bool(a[5].any()) for a in asks) >= 2
    assert max(float(np.ptp(a[2])) for a in asks) > 0.02
    for _, angle, *_ in asks:
        assert np.abs(angle).max() <= 0.61
    assert max(float(machine.driven(seed, (), 75.0)[-1][:, 3].max()) for seed in range(1, 9)) > 0.01


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


def test_a_recorder_has_what_its_level_of_evidence_says_in_whole_milliseconds(machine: ModuleType) -> None:
    base, spool, direct = (machine.signals(1, (), LENGTH, tier).items for tier in ("base", "spool", "direct"))
    assert not any(name.endswith(("u_applied", "_true")) for name in base)
    assert "wheel.FR.u_applied" in spool
    assert {"wheel.FR.v_true", "steer.rear.phi_true"} <= direct.keys()
    for seed in range(1, 7):
        items = machine.signals(seed, (), LENGTH, "direct").items
        for name, rate in (("wheel.FR.v", 50.0), ("steer.front.phi", 25.0), ("wheel.FR.v_true", 20.0)):
            assert 1e9 / float(np.median(np.diff(items[name].stamps))) == pytest.approx(rate, rel=0.06)
        for one in items.values():
            assert (np.diff(one.stamps) > 0).all(), (seed, one.name)
            assert (one.stamps % 1_000_000 == 0).all()
        assert np.array_equal(items["wheel.FR.v"].stamps, items["wheel.FL.v"].stamps)
