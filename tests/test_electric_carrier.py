"""Whether the electric carrier of `all_clear.py` and its faults do what they say."""

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
SEEDS, LENGTH = (512, 526), 40.0
_A, _B = 15.0, 30.0
_SPAN = slice(16_000, 30_000)


@pytest.fixture(scope="module")
def electric() -> Iterator[ModuleType]:
    sys.path.insert(0, str(BENCHMARKS))
    import electric

    yield electric
    sys.path.remove(str(BENCHMARKS))


@pytest.fixture(scope="module")
def physics(electric: ModuleType) -> ModuleType:
    import electric_physics

    return electric_physics


def fault(
    part: str, side: Side, mode: FaultMode, epsilon: float = 1.0, sat: float = 0.0, std: float = 0.0
) -> FaultSpec:
    return FaultSpec(part, side, mode, _A, _B, epsilon, sat, std, 0.05 if std else 0.0, 0.0)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_healthy_carrier_follows_its_commands_and_nothing_hunts(electric: ModuleType, seed: int) -> None:
    ref, true, read, second, given, done, _ = electric.driven(seed, (), LENGTH)
    top = electric.build(seed)[0].top
    assert np.abs(ref[:, :4]).max() > 0.1 * top
    assert np.abs(read[:, :4] - ref[:, :4]).mean() < 0.04 * top
    assert np.abs(true[:, :4] - read[:, :4]).mean() < 0.008 * top
    assert np.abs(true[:, :4] - second[:, :4]).mean() < 0.008 * top
    assert np.abs(read[:, 4:] - ref[:, 4:]).mean() < 0.01
    assert np.abs(np.diff(read[::40, :4], 2, axis=0)).mean() < 0.01 * top
    assert np.abs(given[:, :4] - done[:, :4]).mean() < 0.02


@pytest.mark.parametrize(
    ("mode", "epsilon", "sat", "share", "own"),
    [
        (FaultMode.NO_SIGNAL, 1.0, 0.0, 0.0, 0.0),
        (FaultMode.STUCK, 1.0, 0.3, 0.0, 0.3),
        (FaultMode.INEFFICIENT, 0.5, 0.0, 0.5, 0.0),
    ],
)
def test_a_motor_that_fails_gives_the_torque_of_its_fault(
    electric: ModuleType, mode: FaultMode, epsilon: float, sat: float, share: float, own: float
) -> None:
    done, given = (
        electric.driven(SEEDS[0], (fault("FR", Side.ACTUATOR, mode, epsilon, sat),), LENGTH)[k] for k in (5, 4)
    )
    assert np.abs(done[_SPAN, 0] - share * given[_SPAN, 0] - own).mean() < 0.02
    assert np.abs(done[_SPAN, 1:4] - given[_SPAN, 1:4]).mean() < 0.02
    healthy = electric.driven(SEEDS[0], (), LENGTH)[5]
    assert np.array_equal(done[:14_000], healthy[:14_000])


def test_a_noisy_motor_shakes(electric: ModuleType) -> None:
    done, given = (
        electric.driven(SEEDS[0], (fault("RL", Side.ACTUATOR, FaultMode.NOISY, 0.4, 0.0, 0.3),), LENGTH)[k]
        for k in (5, 4)
    )
    wrong = (done - given)[_SPAN, :4]
    assert wrong[:, 3].std() > 4 * wrong[:, :3].std()


def test_a_speed_sensor_that_fails_reads_what_its_fault_says_and_the_wheel_turns_on(electric: ModuleType) -> None:
    _, true, read, second, *_ = electric.driven(SEEDS[0], (fault("FL", Side.SENSOR, FaultMode.NO_SIGNAL),), LENGTH)
    assert not read[_SPAN, 1].any()
    assert np.abs(true[_SPAN, 1]).max() > 0.1
    assert np.abs(second[_SPAN, 1] - true[_SPAN, 1]).mean() < 0.02 * electric.build(SEEDS[0])[0].top
    _, _, read, *_ = electric.driven(SEEDS[0], (fault("FL", Side.SENSOR, FaultMode.STUCK, 1.0, np.nan),), LENGTH)
    assert np.ptp(read[_SPAN, 1]) == 0.0


def test_a_dead_steering_motor_leaves_its_axle_where_it_is_and_a_stuck_one_runs_to_the_end(
    electric: ModuleType,
) -> None:
    dead = electric.driven(SEEDS[0], (fault("front", Side.ACTUATOR, FaultMode.NO_SIGNAL),), LENGTH)[1]
    assert np.ptp(dead[_SPAN, 4]) < 0.002
    assert np.ptp(dead[_SPAN, 5]) > 0.05
    stuck = electric.driven(SEEDS[0], (fault("front", Side.ACTUATOR, FaultMode.STUCK, 1.0, 0.5),), LENGTH)[1]
    assert stuck[29_900, 4] > 0.5


def test_tyres_slip_past_a_peak_and_soft_or_slick_ground_holds_less(electric: ModuleType, physics: ModuleType) -> None:
    made = electric.build(SEEDS[0])[0]
    slips = np.linspace(0.0, 1.0, 101)
    hard, soft, slick = (
        np.array([physics.grip_of(s, *ground, made) for s in slips]) for ground in ((0.0, 0.0), (0.8, 0.0), (0.0, 0.8))
    )
    assert 0.05 < slips[hard.argmax()] < 0.5
    assert hard[-1] < 0.95 * hard.max()
    assert soft[5] < hard[5]
    assert slick.max() < 0.7 * hard.max()


def test_a_shaft_carries_nothing_within_its_gears_play_and_dry_friction_stops(
    electric: ModuleType, physics: ModuleType
) -> None:
    made, parts = electric.build(SEEDS[0])
    w = np.zeros(12)
    assert physics.drive_line(w, parts[0], 0.0, 0.0, made) == 0.0
    w[physics.TWIST] = made.play + 0.01
    assert physics.drive_line(w, parts[0], 0.0, 0.0, made) == pytest.approx(0.01 * made.shaft)
    assert physics.dry(0.001, 0.0, 0.002) == 0.0
    assert physics.dry(0.5, -0.1, 0.05) == pytest.approx(0.35)


def test_an_encoder_shows_a_steady_speed_without_glitches(electric: ModuleType) -> None:
    import electric_control as control

    made = electric.build(SEEDS[0])[0]._replace(uneven=0.06, tick=1e-6)
    teeth = np.random.default_rng(5).uniform(-0.5, 0.5, 64)
    for speed, pitch in ((0.8, 0.003), (-0.46, 0.005), (0.05, 0.0015)):
        e, shown = np.zeros(6), []
        for k in range(1, 8001):
            control.edges(e, speed * k * 0.0005, speed, k * 0.0005, pitch, teeth, made)
            if k % 20 == 0:
                shown.append(control.timed(e, k * 0.0005, pitch))
        assert np.abs(np.array(shown[20:]) / speed - 1).max() < 0.07


def test_a_fast_or_hot_motor_gives_less(electric: ModuleType, physics: ModuleType) -> None:
    made, parts = electric.build(SEEDS[0])

    def torque(rotor: float, heat: float) -> float:
        w = np.zeros(12)
        for _ in range(2000):
            w[physics.ROTOR], w[physics.HEAT] = rotor, heat
            physics.motor(w, parts[0], 1.0, 1.0, made)
        return float(w[physics.IQ])

    assert torque(0.5 * made.knee, 0.3) == pytest.approx(1.0)
    assert torque(1.5 * made.knee, 0.3) == pytest.approx(1 / 1.5, rel=0.02)
    assert torque(0.5 * made.knee, 1.05) == pytest.approx(0.4, rel=0.02)
    assert torque(1.01 * made.fastest, 0.3) == 0.0


def test_its_users_know_its_type_plate_and_a_tape_measure(electric: ModuleType) -> None:
    for seed in SEEDS:
        made, parts = electric.build(seed)
        machine = electric.machine_of((made, parts))
        assert abs(machine.max_speed / made.top - 1) < 0.15
        assert machine.max_speed != made.top


def test_a_recorder_has_what_the_level_of_evidence_says(electric: ModuleType) -> None:
    names = {tier: set(electric.signals(SEEDS[0], (), LENGTH, tier).items) for tier in ("base", "spool", "direct")}
    assert {"wheel.FR.v", "wheel.FR.u", "steer.front.u", "steer.rear.phi"} <= names["base"]
    assert {n.split(".", 2)[2] for n in names["spool"] - names["base"]} == {"u_applied"}
    assert {n.split(".", 2)[2] for n in names["direct"] - names["spool"]} == {"v_true", "phi_true"}
    for one in electric.signals(SEEDS[0], (), LENGTH, "direct").items.values():
        assert (np.diff(one.stamps) > 0).all()
        assert np.isfinite(one.values).all()


def test_a_dead_motor_is_no_all_clear(electric: ModuleType) -> None:
    import all_clear

    names = [t.name for t in all_clear.troubles(60.0)]
    found = all_clear.run(
        all_clear.Task("electric", names.index("FR valve dead, whole"), SEEDS[1], 60.0, ("base", "direct"))
    )
    assert [o.tier for o in found] == ["base", "direct"]
    assert not any(o.outcome in ("cleared", "crashed") for o in found)
