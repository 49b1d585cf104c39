"""A steering angle jumps where it changes quicker than any axle turns for a while: not where it is noisy, rare, held, or late."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.estimation.angle_jumps import Jumps, jumps_of, quickest_of, readings

DT, N = 0.01, 6_000
T = np.arange(N) * DT
FRESH = np.ones(N, dtype=np.bool_)


def turned(seed: int = 1, noise: float = 5e-4) -> np.ndarray:
    """An axle that is turned to and fro at 0.3 rad/s at most."""
    target = 0.4 * np.sign(np.sin(2 * np.pi * T / 20.0))
    angle = np.zeros(N)
    for k in range(1, N):
        angle[k] = angle[k - 1] + np.clip(target[k] - angle[k - 1], -0.3 * DT, 0.3 * DT)
    return angle + noise * np.random.default_rng(seed).standard_normal(N)


def found(angle: np.ndarray, fresh: np.ndarray = FRESH, dt: float = DT) -> Jumps:
    quickest = quickest_of(readings(angle, fresh, dt))
    assert quickest is not None
    return jumps_of(readings(angle, fresh, dt), quickest)


def test_a_loss_jumps_where_it_begins_and_ends() -> None:
    angle = turned()
    angle[3500:3900] *= 0.6
    jumps = found(angle)
    assert {round(t, 1) for t in jumps.at_s} == {35.0, 39.0}
    assert jumps.size.max() == pytest.approx(0.16, rel=0.1)
    assert (jumps.of == 0.24).all()


@pytest.mark.parametrize("noise", [0.0, 5e-4, 5e-3])
def test_an_axle_that_turns_does_not(noise: float) -> None:
    assert found(turned(noise=noise)).size.size == 0


def test_single_wild_readings_are_none() -> None:
    angle = turned()
    angle[[1000, 2500, 4000]] += 0.3
    assert found(angle).size.size == 0


def test_held_and_rounded_readings_are_none() -> None:
    angle = np.round(turned(noise=0.0)[np.arange(N) // 2 * 2] / 0.002) * 0.002
    assert found(angle).size.size == 0


def test_what_happened_in_a_gap_is_not_known() -> None:
    angle, fresh = turned(), FRESH.copy()
    fresh[3450:3500] = False
    angle[3500:] += 0.2
    assert found(angle, fresh).size.size == 0


def test_a_whole_turn_is_the_same_angle() -> None:
    angle = turned()
    angle[3500:] += 2 * np.pi
    assert found(angle).size.size == 0


def test_rare_readings_show_nothing() -> None:
    assert quickest_of(readings(turned(), FRESH, 0.1)) is None


def recorded_at_20_hz(angle: np.ndarray, seed: int = 4) -> tuple[np.ndarray, np.ndarray]:
    """What a recorder that is up to 20 ms late keeps of an angle, and when, on the steps of `DT`."""
    rng, out, fresh = np.random.default_rng(seed), np.full(N, np.nan), np.zeros(N, dtype=np.bool_)
    for k in range(0, N - 5, 5):
        late = k + int(rng.integers(0, 3))
        out[late], fresh[late] = angle[k], True
    return out, fresh


def test_a_loss_jumps_at_20_hz_too() -> None:
    angle = turned()
    angle[3500:3900] *= 0.6
    jumps = found(*recorded_at_20_hz(angle))
    assert {round(t, 1) for t in jumps.at_s} == {35.0, 39.0}


@pytest.mark.parametrize("noise", [0.0, 5e-4, 5e-3])
def test_an_axle_that_turns_does_not_at_20_hz_either(noise: float) -> None:
    angle = turned(noise=noise)
    angle[[1000, 2500, 4000]] += 0.3
    assert found(*recorded_at_20_hz(angle)).size.size == 0


def test_blocks_do_not_hide_a_jump(monkeypatch: pytest.MonkeyPatch) -> None:
    angle = turned()
    angle[3000:3300] *= 0.6
    whole = found(angle)
    monkeypatch.setattr("replay.arrays.blocks.BLOCK", 1500)
    assert {round(t, 2) for t in found(angle).at_s} == {round(t, 2) for t in whole.at_s}


def test_readings_that_repeat_now_and_then_show_a_jump() -> None:
    angle = turned(noise=0.0)[::2]
    angle[1700:2300] += 0.15
    late = np.random.default_rng(3).random(angle.size) < 0.15
    at = np.maximum.accumulate(np.where(late, 0, np.arange(angle.size)))
    jumps = found(np.round(angle[at], 3), np.ones(angle.size, np.bool_), 2 * DT)
    assert {round(t) for t in jumps.at_s} == {34, 46}


def test_a_servo_that_makes_its_step_in_few_readings_far_apart_does_not_jump_and_one_reading_does() -> None:
    coarse = slice(None, None, 5)
    angle = turned()
    at = 2_500
    step = np.interp(np.arange(N) * DT, [at * DT, at * DT + 0.16], [0.0, -0.4])
    servo = np.where(np.arange(N) < at, 0.2, 0.2 + step) + 5e-4 * np.random.default_rng(3).standard_normal(N)
    slow = np.where(np.arange(N) > 4_000, angle - angle[4_000] + servo[4_000], servo)[coarse]
    fresh = np.ones(slow.size, dtype=np.bool_)
    assert found(slow, fresh, 5 * DT).at_s.size == 0
    slow[at // 5 :] = slow[at // 5 - 1] - 0.4
    assert found(slow, fresh, 5 * DT).at_s.size > 0
