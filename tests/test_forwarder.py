"""Whether the forwarder of `all_clear.py` and its faults do what they say."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

import numpy as np
import pytest

from replay.faults import FaultMode, FaultSpec, Side

BENCHMARKS = Path(__file__).parent / "benchmarks"
pytestmark = pytest.mark.long  # of the campaigns alone: what every run needs of them is in test_all_clear.py
SEEDS, LENGTH = (501, 504, 508), 40.0
_A, _B = 8.0, 36.0
_SPAN = slice(9_000, 36_000)


@pytest.fixture(scope="module")
def machine() -> Iterator[ModuleType]:
    sys.path.insert(0, str(BENCHMARKS))
    import forwarder

    yield forwarder
    sys.path.remove(str(BENCHMARKS))


@pytest.fixture(scope="module")
def physics(machine: ModuleType) -> ModuleType:
    import forwarder_physics

    return forwarder_physics


def fault(part: str, side: Side, mode: FaultMode, epsilon: float = 1.0, sat: float = 0.0) -> FaultSpec:
    return FaultSpec(part, side, mode, _A, _B, epsilon, sat, 0.0, 0.0, 0.0)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_healthy_forwarder_follows_its_commands_and_nothing_hunts(machine: ModuleType, seed: int) -> None:
    ref, true, read, given, done, _, source = machine.driven(seed, (), LENGTH)
    made = machine.build(seed)[0]
    assert np.abs(ref[:, :4]).max() > 0.3 * made.top
    assert np.abs(true[:, :4] - ref[:, :4]).mean() < 0.05 * made.top
    assert np.abs(true[:, :4] - read[:, :4]).mean() < 0.02 * made.top
    assert np.abs(true[:, 4:] - ref[:, 4:]).mean() < 0.02
    assert np.abs(np.diff(read[::40, :4], 2, axis=0)).mean() < 0.01 * made.top
    assert (np.abs(given[:, :4]) > 0.99).mean() < 0.05
    assert np.abs(given - done).mean() < 0.03
    assert 0.45 < source[:, 0].min() <= source[:, 0].max() < 1.1
    assert source[:, 2:4].max() < made.cut + made.margin + 20e5
    assert source[-1, 1] > source[0, 1]


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
    given, done = (machine.driven(504, (fault("FR", Side.ACTUATOR, mode, epsilon, sat),), LENGTH)[k] for k in (3, 4))
    assert np.abs(done[_SPAN, 0] - share * given[_SPAN, 0] - own).mean() < 0.03
    assert np.abs(done[_SPAN, 1:4] - given[_SPAN, 1:4]).mean() < 0.04
    assert np.array_equal(done[:7_900], machine.driven(504, (), LENGTH)[4][:7_900])


def test_a_speed_sensor_that_fails_reads_what_its_fault_says_and_the_wheel_turns_on(machine: ModuleType) -> None:
    _, true, read, *_ = machine.driven(504, (fault("FL", Side.SENSOR, FaultMode.NO_SIGNAL),), LENGTH)
    assert not read[_SPAN, 1].any()
    assert np.abs(true[_SPAN, 1]).max() > 0.3
    _, _, read, *_ = machine.driven(504, (fault("FL", Side.SENSOR, FaultMode.STUCK, 1.0, np.nan),), LENGTH)
    assert np.ptp(read[_SPAN, 1]) == 0.0
    _, true, read, *_ = machine.driven(504, (fault("FL", Side.SENSOR, FaultMode.INEFFICIENT, 0.3),), LENGTH)
    assert np.abs(read[_SPAN, 1] - 0.7 * true[_SPAN, 1]).mean() < 0.02 * machine.build(504)[0].top


def test_a_dead_steering_valve_leaves_its_axle_where_it_is(machine: ModuleType) -> None:
    angle = machine.driven(504, (fault("front", Side.ACTUATOR, FaultMode.NO_SIGNAL),), LENGTH)[1]
    assert np.ptp(angle[_SPAN, 4]) < 0.01
    assert np.ptp(angle[_SPAN, 5]) > 0.05


def _turned(
    physics: ModuleType,
    individual: tuple[NamedTuple, np.ndarray],
    loads: tuple[float, float],
    oil: float,
    opening: float,
) -> list[float]:
    """Speeds [rad/s] of an axle's two wheels whose valves open alike, each against a torque of its own [of the greatest]."""
    made, parts = individual[0]._replace(ripple=0.0), individual[1][0]
    w, c, thick = np.zeros((2, 11)), np.zeros(3), physics.thickness(oil, made)
    w[:, physics.PA] = w[:, physics.PB] = c[physics.P] = physics.TANK
    w[:, physics.SPOOL] = opening
    for _ in range(8000):
        moved = [physics.motor(one, parts, c[physics.P], thick, made) for one in w]
        for one, (torque, *_), load in zip(w, moved, loads, strict=True):
            one[physics.TURN] += physics.H / made.inertia * (torque - load * made.motor * made.most)
        _, taken, growth, asked = np.array(moved).T
        physics.pump(c, asked.max(), made.pump, taken.sum(), growth.sum(), thick, made)
    return list(w[:, physics.TURN])


def test_the_less_loaded_wheel_of_an_axle_turns_faster_and_the_more_loaded_one_as_its_valve_says(
    machine: ModuleType, physics: ModuleType
) -> None:
    made, parts = individual = machine.build(501)
    heavy, light = _turned(physics, individual, (0.5, 0.25), 45.0, 0.5)
    size = ((0.5 - parts[0, physics.OVERLAP]) / (1 - parts[0, physics.OVERLAP])) ** made.curve
    assert heavy == pytest.approx(made.flow * size * parts[0, physics.PLUS] / made.motor, rel=0.2)
    assert light > 1.3 * heavy


def test_cold_oil_makes_small_openings_slow_and_warm_oil_leaks(machine: ModuleType, physics: ModuleType) -> None:
    made = machine.build(501)[0]
    thin, thick = (physics.thickness(oil, made) for oil in (60.0, 5.0))
    assert thin < 1.0 < thick
    assert physics.orifice(1e-7, 2e5, thick, made)[0] < 0.95 * physics.orifice(1e-7, 2e5, thin, made)[0]
    assert physics.orifice(1e-7, 200e5, thick, made)[0] > 0.98 * physics.orifice(1e-7, 200e5, thin, made)[0]


def test_a_vent_takes_the_pressure_off_and_gives_it_back_below_a_lower_limit(
    machine: ModuleType, physics: ModuleType
) -> None:
    made, c = machine.build(501)[0], np.zeros(3)
    held = {}
    for step, asked in enumerate((0.9, 1.05, 1.0 * (1 + made.back) / 2, 0.9 * made.back)):
        for _ in range(2000):
            physics.pump(c, asked * made.cut, made.pump, 0.0, 0.0, 1.0, made)
        held[step] = c[physics.P]
    assert held[0] == pytest.approx(0.9 * made.cut + made.margin, abs=8e5)
    assert held[1] < 50e5
    assert held[2] < 50e5
    assert held[3] > 0.85 * made.back * made.cut


def test_the_engine_idles_where_nothing_moves_and_the_crane_adds_what_it_takes(machine: ModuleType) -> None:
    idles = [machine.driven(seed, (), LENGTH)[6][:, 0].min() for seed in SEEDS]
    assert min(idles) < 0.75
    gained = []
    for seed in range(500, 510):
        speed, _, mass, ahead, _, crane = machine.commands(seed, 75.0)
        slow = np.abs(speed) < 0.2 * machine.build(seed)[0].top
        gained.append(mass[-1] / mass[0])
        assert (np.diff(mass) >= -1e-6).all()
        assert (ahead <= 0.0).all()
        assert (slow | (crane == 0.0)).mean() > 0.97
    assert max(gained) > 1.1


def test_messages_come_at_their_rate_late_by_channel_and_rounded(machine: ModuleType) -> None:
    for seed in SEEDS:
        made, items = machine.build(seed)[0], machine.signals(seed, (), LENGTH, "direct").items
        one = items["wheel.FR.v"]
        gaps = np.diff(one.stamps) * 1e-6
        assert gaps.mean() == pytest.approx(5.0, rel=0.05)
        assert gaps.std() > 0.3
        steps = one.values / (made.step / 2048)
        assert np.abs(steps - np.round(steps)).max() < 1e-6
        firsts = [items[f"wheel.{w}.v"].stamps[0] for w in ("FR", "FL", "RR", "RL")]
        assert np.ptp(firsts) > 500_000


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
        all_clear.Task(machine.NAME, names.index("FR valve dead, whole"), 504, 60.0, ("base", "direct"))
    )
    assert [o.tier for o in found] == ["base", "direct"]
    assert not any(o.outcome in ("cleared", "crashed") for o in found)
