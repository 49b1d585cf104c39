"""Whether the loader of `all_clear.py` and its faults do what they say."""

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
_EVEN = np.array([8.0, 4.0, 2.0, 1.0, 1.0])


@pytest.fixture(scope="module")
def machine() -> Iterator[ModuleType]:
    sys.path.insert(0, str(BENCHMARKS))
    import loader

    yield loader
    sys.path.remove(str(BENCHMARKS))


def fault(part: str, side: Side, mode: FaultMode, epsilon: float = 1.0, sat: float = 0.0) -> FaultSpec:
    return FaultSpec(part, side, mode, _A, _B, epsilon, sat, 0.0, 0.0, 0.0)


def opened(machine: ModuleType, want: float, oil: float, seconds: float, start: float = 0.0) -> np.ndarray:
    """Openings of a bank, per half millisecond, told `want` from `start` on."""
    import loader_physics

    made, x = machine.build(1)[0], np.zeros(19)
    x[:2] = 1.0
    for k in range(2000 if start else 0):
        loader_physics.bank(x, start, k * 0.0005, oil, _EVEN, made)
    return np.array(
        [loader_physics.bank(x, want, k * 0.0005, oil, _EVEN, made) for k in range(round(seconds / 0.0005))]
    )


@pytest.mark.parametrize("steps", [1, 5, 8, 15, 16])
def test_a_bank_opens_in_sixteenths_and_late_the_more_so_in_cold_oil(machine: ModuleType, steps: int) -> None:
    warm, cold = (opened(machine, steps / 16, oil, 0.2) for oil in (60.0, 5.0))
    assert warm[-1] == cold[-1] == steps / 16
    starts = [float(np.flatnonzero(x)[0]) * 0.0005 for x in (warm, cold)]
    assert 0.014 <= starts[0] < starts[1] <= 0.041


def test_what_lies_between_two_sixteenths_is_modulated(machine: ModuleType) -> None:
    period = machine.build(1)[0].period
    x = opened(machine, 5.5 / 16, 60.0, 10 * period + 0.2)[400:]
    assert set(np.unique(x)) == {5 / 16, 6 / 16}
    assert x[: round(8 * period / 0.0005)].mean() == pytest.approx(5.5 / 16, abs=0.1 / 16)


def test_a_bank_is_shut_while_its_direction_changes(machine: ModuleType) -> None:
    x = opened(machine, -0.5, 60.0, 0.3, start=0.5)
    assert x[0] == 0.5
    assert x[-1] == -0.5
    assert (x == 0.0).sum() * 0.0005 > 0.01
    assert (np.diff(x) <= 0.0).all()


@pytest.mark.parametrize("compensated", [True, False])
def test_a_wheel_turns_steadily_by_its_opening_its_motor_s_size_and_what_pressure_is_left(
    machine: ModuleType, compensated: bool
) -> None:
    import loader_physics as physics

    made, parts = machine.build(4)
    made = made._replace(compensated=compensated, friction=1e-3 * made.friction, leakage=1e-4 * made.leakage)
    part = np.where(np.arange(8) == physics.PLUS, 1.0, parts[0])

    def speed(edge: float, size: float, spare: float) -> float:
        w, s = np.zeros(15), np.array([spare * made.margin, 0.0, 1.0, 50.0])
        w[physics.SIZE] = size
        for _ in range(8000):
            torque, _, _ = physics.motor(w, part, edge, s, size, made)
            physics.turn_wheel(w, part, torque, 0.0, made.radius, 0.0, 0.0, 0.0, made)
        return float(w[physics.TURN])

    full = made.flow / made.motor
    for steps in (2, 6, 12):
        assert speed(steps / 16, 1.0, 1.0) == pytest.approx(steps / 16 * full, rel=0.06)
    assert speed(0.5, made.small, 1.0) == pytest.approx(0.5 * full / made.small, rel=0.06)
    assert speed(0.5, 1.0, 4.0) == pytest.approx(0.5 * full * (np.sqrt(1.12) if compensated else 2.0), rel=0.06)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_healthy_loader_follows_its_commands(machine: ModuleType, seed: int) -> None:
    ref, true, read, given, done, _, source = machine.driven(seed, (), LENGTH)
    made = machine.build(seed)[0]
    free = source[:, 4] == 0.0
    assert np.abs(ref[:, :4]).max() > 0.3 * made.top
    assert np.abs(true[:, :4] - ref[:, :4])[free].mean() < 0.08 * made.top
    assert np.abs(true[:, :4] - read[:, :4]).mean() < 0.04 * made.top
    assert np.abs(true[:, 4:] - ref[:, 4:]).mean() < 0.03
    assert np.abs((given - done).mean(axis=0)).max() < 0.02
    assert 0.3 < source[1000:, 1].min() <= source[:, 1].max() < 1.15
    assert source[:, 0].max() < 1.05 * (made.most + made.margin)


def test_at_a_pile_the_body_stands_and_wheels_spin_or_stand_though_told_to_drive(machine: ModuleType) -> None:
    spins, stands = 0, 0
    for seed in range(1, 11):
        ref, true, _, given, _, body, source = machine.driven(seed, (), 75.0)
        top = machine.build(seed)[0].top
        digs = (source[:, 4] > 0.3) & (ref[:, :4] > 0.05 * top).all(axis=1) & (body[:, 0] < 0.02 * top)
        rim = true[digs, :4]
        assert (rim.mean(axis=1) - body[digs, 0]).mean() > 0.0 if digs.any() else True  # they slip forward, never back
        spins += int((rim > 0.08 * top).sum())
        stands += int(((rim < 0.02 * top) & (given[digs, :4] > 0.05)).sum())
    assert spins > 2000
    assert stands > 2000


def test_below_what_teeth_tell_the_direction_is_that_of_the_command(machine: ModuleType) -> None:
    import loader_control
    import loader_physics as physics

    w = np.zeros(15)
    w[physics.RATE], w[physics.TURN], w[physics.SIGN] = 0.1, -0.2, 1.0
    assert loader_control.signed(w, 0.3) == 0.1
    assert loader_control.signed(w, 0.0) == 0.1
    assert loader_control.signed(w, -0.3) == -0.1
    w[physics.RATE] = 0.2
    assert loader_control.signed(w, 0.3) == -0.2


def test_frames_fold_against_each_other_and_the_machine_turns_by_them(machine: ModuleType) -> None:
    for seed in SEEDS:
        _, true, _, _, _, body, source = machine.driven(seed, (), 75.0)
        made = machine.build(seed)[0]
        rolls = (np.abs(body[:, 0]) > 0.15 * made.top) & (source[:, 4] == 0.0) & (np.abs(true[:, 4]) > 0.08)
        bend = (np.tan(true[rolls, 4]) - np.tan(true[rolls, 5])) / made.base
        assert np.corrcoef(true[:, 4], true[:, 5])[0, 1] < -0.95
        assert np.median(body[rolls, 2] / (body[rolls, 0] * bend)) == pytest.approx(1.0, abs=0.15)


def test_tyres_differ_by_no_more_than_four_percent_and_by_much_on_some(machine: ModuleType) -> None:
    spread = [np.ptp(machine.build(seed)[1][:, 0]) / machine.build(seed)[0].radius for seed in range(60)]
    assert 0.02 < max(spread) <= 0.04


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
def test_a_bank_that_fails_follows_what_its_fault_says(
    machine: ModuleType, mode: FaultMode, epsilon: float, sat: float, share: float, own: float
) -> None:
    given, done = (machine.driven(4, (fault("FR", Side.ACTUATOR, mode, epsilon, sat),), LENGTH)[k] for k in (3, 4))
    assert abs((done[_SPAN, 0] - share * given[_SPAN, 0] - own).mean()) < 0.02
    assert np.abs(done[_SPAN, 0] - share * given[_SPAN, 0] - own).mean() < 0.05
    assert np.array_equal(done[:7_900], machine.driven(4, (), LENGTH)[4][:7_900])


def test_a_speed_sensor_that_fails_reads_what_its_fault_says_and_the_wheel_turns_on(machine: ModuleType) -> None:
    _, true, read, *_ = machine.driven(4, (fault("FL", Side.SENSOR, FaultMode.NO_SIGNAL),), LENGTH)
    assert not read[_SPAN, 1].any()
    assert np.abs(true[_SPAN, 1]).max() > 0.3


def test_a_recorder_has_what_its_level_of_evidence_says_by_two_clocks(machine: ModuleType) -> None:
    base, spool, direct = (machine.signals(1, (), LENGTH, tier).items for tier in ("base", "spool", "direct"))
    assert not any(name.endswith(("u_applied", "_true")) for name in base)
    assert "wheel.FR.u_applied" in spool
    assert {"wheel.FR.v_true", "steer.rear.phi_true"} <= direct.keys()
    rates = set()
    for seed in range(1, 7):
        items = machine.signals(seed, (), LENGTH, "direct").items
        rates.add(round(1e9 / float(np.median(np.diff(items["wheel.FR.v"].stamps)))))
        for one in items.values():
            assert (np.diff(one.stamps) > 0).all(), (seed, one.name)
    assert all(any(abs(r - x) < 3 for x in (100, 250)) for r in rates)
