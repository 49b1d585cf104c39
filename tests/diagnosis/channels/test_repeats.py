"""Constant readings that the noise does not explain."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.channels.repeats import FALSE_SPELLS, constant_spells, shortest_spell

DT, LSB, NOISE = 0.001, 0.0015, 0.004
Array = np.ndarray


def readings(n: int = 20_000, seed: int = 1, noise: float = NOISE, lsb: float = LSB, rest: bool = False) -> Array:
    """A speed, at rest in the middle of a rounding step or moving, with noise, rounded."""
    t = np.arange(n) * DT
    value = np.full(n, 140 * lsb) if rest else 0.2 * np.sin(t)
    noisy = value + noise * np.random.default_rng(seed).normal(size=n)
    return np.round(noisy / lsb) * lsb if lsb else noisy


def found(y: Array, **changed: object) -> list[tuple[int, int, float]]:
    given = {"fresh": np.isfinite(y), "noise": NOISE, "lsb": LSB, "dt": DT, "moving": np.ones(y.size, dtype=np.bool_)}
    return constant_spells(y, **(given | changed))


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("rest", [False, True])
def test_noise_alone_makes_no_spell(seed: int, rest: bool) -> None:
    assert found(readings(100_000, seed, rest=rest)) == []


@pytest.mark.parametrize("start", [3000, 11_400])
def test_20_ms_are_found_to_the_sample(start: int) -> None:
    y = readings()
    y[start : start + 20] = level = y[start]
    y[start - 1], y[start + 20] = level + LSB, level - LSB  # what stood there by chance is not the question
    assert found(y) == [(start, start + 20, level)]


def test_the_shortest_spell_is_the_one_that_noise_does_not_make() -> None:
    n = 240_000
    least = shortest_spell(NOISE, LSB, n)
    assert least is not None
    same = 0.1488  # of a normal law within ±0.1875 standard deviations
    assert n * same ** (least - 1) <= FALSE_SPELLS < n * same ** (least - 2)
    y = readings()
    expected = shortest_spell(NOISE, LSB, y.size)
    assert expected is not None
    for length in (expected - 1, expected):
        spell = y.copy()
        spell[5000 : 5000 + length] = spell[5000]
        spell[4999], spell[5000 + length] = 9.0, 9.0
        assert len(found(spell)) == (length == expected)


@pytest.mark.parametrize(("noise", "lsb"), [(0.001, 0.0015), (0.0015, 0.0015), (0.0, 0.0)])
def test_noise_below_the_rounding_step_tells_nothing(noise: float, lsb: float) -> None:
    assert shortest_spell(noise, lsb, 1000) is None
    y = readings(noise=noise, lsb=lsb)
    y[3000:9000] = y[3000]
    assert found(y, noise=noise, lsb=lsb) == []


def test_without_rounding_five_equal_readings_are_enough() -> None:
    y = readings(lsb=0.0)
    y[100:104] = y[100]
    y[200:205] = y[200]
    assert found(y, lsb=0.0) == [(200, 205, y[200])]


def test_a_machine_at_rest_may_read_zero() -> None:
    y = readings()
    moving = np.ones(y.size, dtype=np.bool_)
    y[4000:6000], moving[4000:6000] = 0.0, False
    assert found(y, moving=moving) == []
    y[5990:6050] = 0.0  # the machine moves and the sensor does not
    (start, stop, level) = found(y, moving=moving)[0]
    assert (start, level) == (6000, 0.0)
    assert 6050 <= stop <= 6052


def test_a_sensor_slower_than_its_log_needs_as_many_updates() -> None:
    y = np.repeat(readings(2000), 10)  # 100 Hz, logged at 1 kHz
    assert found(y) == []
    y[5000:5020] = y[5000]
    assert found(y) == []  # two updates
    y[8000:8500] = y[8000]
    assert [(a, b) for a, b, _ in found(y)] == [(8000, 8500)]


def test_only_new_readings_count() -> None:
    y = readings()
    fresh = np.zeros(y.size, dtype=np.bool_)
    fresh[::5] = True
    held = np.repeat(y[::5], 5)  # a 200 Hz channel on a 1 kHz axis
    assert found(held, fresh=fresh) == []
    held[6000:6100] = held[6000]
    held[6100:6105] = held[6000] + 0.1
    assert [(a, b) for a, b, _ in found(held, fresh=fresh)] == [(6000, 6100)]


def test_silence_ends_a_spell() -> None:
    y = readings()
    y[3000:3040] = y[3000]
    y[3040:3200] = np.nan
    y[3200:3240] = y[3000]
    assert [(a, b) for a, b, _ in found(y)] == [(3000, 3040), (3200, 3240)]
    assert found(np.full(500, np.nan)) == []
    assert found(np.zeros(0)) == []


def test_wrong_input_is_refused() -> None:
    y = readings(100)
    with pytest.raises(ValueError, match="shapes"):
        found(y, moving=np.ones(3, dtype=np.bool_))
    with pytest.raises(ValueError, match="finite"):
        found(y, noise=float("nan"))
