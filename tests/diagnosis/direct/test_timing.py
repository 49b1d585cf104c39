"""What the timing and rounding of a channel explain is no fault."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.channels.relation import Relation
from diagnosis.channels.sample_status import PAIR
from diagnosis.direct.identification import IdentifiedPair
from diagnosis.direct.inputs import Pair
from diagnosis.direct.timing import timing_explains
from diagnosis.estimation.fault_models import ModeModel
from diagnosis.estimation.samples import Samples
from diagnosis.estimation.segments import Run
from replay.faults import FaultMode, Side
from replay.machine.config import Noise

N, DT = 20_000, 0.001
Array = np.ndarray
MODEL = ModeModel(noise=0.003, constant_noise=0.003, tolerance=0.005, span=0.8, switch_cost=13.0, dt=DT)
A, B = 10_000, 10_021


def pair(side: Side, y: Array, x: Array) -> Pair:
    every = np.ones(y.size, dtype=np.bool_)
    return Pair(side, y, x, np.isfinite(y), every, ~every, DT, "m/s", 0.8, "y", "x", Noise())


def explained(p: Pair, mode: FaultMode, start: int = A, stop: int = B, share: float = 0.0, lag: float = 0.0) -> bool:
    samples = Samples.even(p.y, p.x, np.full(N, PAIR, dtype=np.int8), p.quiet)
    found = IdentifiedPair(p, Relation(lag=lag), samples, MODEL, 0.0015, ~p.alive, share)
    return timing_explains(found, Run(start, stop, 1), mode)


def speeds(noise: float, lsb: float = 0.0015) -> tuple[Array, Array]:
    """A slow speed measured twice; the first sensor rests between `A` and `B`."""
    rng = np.random.default_rng(5)
    true = 0.1206 + 0.05 * np.sin(np.linspace(-1.0, 1.0, N))
    true[A - 500 : B + 500] = true[A]
    y, x = (np.round((true + noise * rng.normal(size=N)) / lsb) * lsb for _ in range(2))
    y[A:B] = y[A]
    return y, x


@pytest.mark.parametrize(("noise", "expected"), [(0.0008, True), (0.0013, True), (0.004, False)])
def test_constant_reading_counts_where_noise_would_have_changed_it(noise: float, expected: bool) -> None:
    y, x = speeds(noise)
    assert explained(pair(Side.SENSOR, y, x), FaultMode.STUCK) is expected


def test_reading_between_two_steps_of_rounding_is_as_good_as_any() -> None:
    y, x = speeds(0.0013)
    y[A:B:2] += 0.0015
    assert explained(pair(Side.SENSOR, y, x), FaultMode.STUCK)


def test_reference_that_moves_shows_that_a_reading_rests() -> None:
    y, x = speeds(0.0008)
    x[A:B] += 0.01
    assert not explained(pair(Side.SENSOR, y, x), FaultMode.STUCK)


def test_silent_channel_does_not_rest() -> None:
    y, x = speeds(0.0008)
    y[A + 1 : B] = np.nan
    assert not explained(pair(Side.SENSOR, y, x), FaultMode.NO_SIGNAL)


def test_silent_valve_position_is_not_explained() -> None:
    x = 0.2 * np.sin(np.linspace(0.0, 30.0, N))
    y = x.copy()
    y[A : A + 300] = np.nan
    assert not explained(pair(Side.ACTUATOR, y, x), FaultMode.NO_SIGNAL, stop=A + 300, share=1.0)


@pytest.mark.parametrize("mode", [FaultMode.NOISY, FaultMode.INEFFICIENT, FaultMode.OUTSIDE_TABLE])
@pytest.mark.parametrize(("rest", "expected"), [(0.0, True), (0.1, False)])
def test_lagging_answer_to_a_command_of_jumps_alone_is_no_fault(mode: FaultMode, rest: float, expected: bool) -> None:
    rng = np.random.default_rng(6)
    x = rest + 0.012 * rng.normal(size=N)
    y = 0.4 * x + 0.4 * np.r_[0.0, x[:-1]] + 0.003 * rng.normal(size=N)
    if rest:
        y *= 0.9
    assert explained(pair(Side.ACTUATOR, y, x), mode, stop=A + 600) is expected


@pytest.mark.parametrize(("share", "expected"), [(0.7, False), (1.0, True)])
def test_a_share_of_a_command_that_flips_between_its_ends_is_no_timing(share: float, expected: bool) -> None:
    """Whatever a reading sooner or later has lies between both ends; a share leaves nothing, which no other moment does."""
    x = np.where(np.random.default_rng(8).random(N) < 0.5, 0.9, -0.9)
    late = 0.5 * (x + np.r_[0.0, x[:-1]]) if expected else x
    y = share * late + 0.003 * np.random.default_rng(9).normal(size=N)
    assert explained(pair(Side.ACTUATOR, y, x), FaultMode.INEFFICIENT, stop=A + 3000) is expected


def test_disturbance_beside_a_command_of_jumps_alone_is_a_fault() -> None:
    x = 0.012 * np.random.default_rng(7).normal(size=N)
    assert not explained(pair(Side.ACTUATOR, x + 0.05, x), FaultMode.NOISY, stop=A + 600)


@pytest.mark.parametrize(("swing", "expected"), [(0.02, True), (0.06, False)])
def test_overshoot_after_a_move_of_the_command_settles(swing: float, expected: bool) -> None:
    x = np.where(np.arange(N) < A, 0.1, 0.2)
    y, t = x.copy(), np.arange(20) * DT
    y[A : A + 20] += swing * np.exp(-t / 0.02) * np.cos(300.0 * t)
    assert explained(pair(Side.ACTUATOR, y, x), FaultMode.NOISY, stop=A + 20, lag=0.005) is expected


def test_swing_beside_a_command_at_rest_does_not_settle() -> None:
    x = np.full(N, 0.2)
    y = x + 0.02 * np.sin(np.arange(N) * 0.3) * ((np.arange(N) >= A) & (np.arange(N) < A + 40))
    assert not explained(pair(Side.ACTUATOR, y, x), FaultMode.NOISY, stop=A + 40, lag=0.005)


@pytest.mark.parametrize(("late", "disturbed", "expected"), [(1, 0.0, True), (0, 0.3, False)])
def test_an_opening_read_late_beside_a_restless_command_is_not_noisy(
    late: int, disturbed: float, expected: bool
) -> None:
    rng = np.random.default_rng(6)
    x = 0.3 + 0.1 * rng.normal(size=N)
    y = np.roll(x, late) + disturbed * rng.normal(size=N)
    assert explained(pair(Side.ACTUATOR, y, x), FaultMode.NOISY, stop=A + 2000) is expected


@pytest.mark.parametrize(("noise", "expected"), [(0.0, True), (0.15, False)])
def test_what_a_sensors_own_lag_damps_of_a_wheel_that_swings_is_no_noise(noise: float, expected: bool) -> None:
    true = 0.4 * np.sin(2 * np.pi * 5.0 * np.arange(N) * DT)
    late = np.r_[np.zeros(45), true[:-45]]
    y = late + 0.03 * np.cos(2 * np.pi * 5.0 * np.arange(N) * DT) + noise * np.random.default_rng(2).standard_normal(N)
    p = pair(Side.SENSOR, y, true)
    samples = Samples.even(y, late, np.full(N, PAIR, dtype=np.int8), p.quiet)
    found = IdentifiedPair(p, Relation(delay=45.0), samples, MODEL, 0.0015, ~p.alive, 0.0)
    assert timing_explains(found, Run(A, A + 2000, 1), FaultMode.NOISY) is expected


@pytest.mark.parametrize(("faster", "expected"), [(1.0, True), (1.8, False)])
def test_a_coarse_reading_is_repeated_at_its_own_speed_alone(faster: float, expected: bool) -> None:
    """At steady speed a sensor that counts repeats its reading for long; beside a wheel at another speed it does not."""
    t = np.arange(N) * DT
    true = 0.4 + 0.15 * np.sin(0.9 * t)
    steady = (t % 4.0) < 1.2
    true[steady] = 0.4
    y = np.round(true / 0.02) * 0.02
    start, stop = 12_050, 13_150  # of a steady second
    true[start:stop] *= faster
    assert explained(pair(Side.SENSOR, y, true), FaultMode.STUCK, start, stop) is expected


def test_noise_beside_a_command_that_flips_now_and_then_is_none_of_timing() -> None:
    """The command's few jumps are as large as the noise, but the valve is off where it rests, too."""
    x = np.full(N, 0.8)
    x[::37] = -0.8
    slow = np.convolve(np.random.default_rng(2).normal(size=N), np.ones(800) / 30.0, mode="same")
    y = np.roll(x, 2) * 0.6 + 0.05 * slow
    assert not explained(pair(Side.ACTUATOR, y, np.roll(x, 2)), FaultMode.NOISY, 2000, 12_000)
    assert not explained(pair(Side.ACTUATOR, 0.6 * np.roll(x, 2), np.roll(x, 2)), FaultMode.INEFFICIENT, 2000, 12_000)


def test_an_opening_read_a_reading_late_is_of_timing() -> None:
    x = np.where(np.arange(N) // 3 % 2 == 0, 0.5, -0.5)
    assert explained(pair(Side.ACTUATOR, np.roll(x, 1), x), FaultMode.NOISY, 2000, 12_000)


def test_a_valve_that_never_rests_between_flips_is_not_told_by_its_lag() -> None:
    x = np.where(np.arange(N) % 2, 0.8, -0.8)
    assert explained(pair(Side.ACTUATOR, 0.6 * x, x), FaultMode.INEFFICIENT, 2000, 12_000)
