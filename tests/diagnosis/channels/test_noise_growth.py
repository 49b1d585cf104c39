"""Noise that grows with the speed is found, whatever half of the mission is faulty."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.channels.noise_growth import noise_growth

DT, N = 0.001, 60_000


def power_and_size(share: float) -> tuple[np.ndarray, np.ndarray]:
    size = np.abs(0.4 * np.sin(np.arange(N) * DT * 0.7))
    noise = np.sqrt(0.002**2 + (share * size) ** 2)
    return (noise * np.random.default_rng(3).normal(size=N)) ** 2, size


@pytest.mark.parametrize("share", [0.0, 0.015])
@pytest.mark.parametrize("faulty", [False, True])
def test_floor_and_share(share: float, faulty: bool) -> None:
    power, size = power_and_size(share)
    if faulty:
        power[: int(0.35 * N)] *= 100.0
    found = noise_growth(power, size, DT)
    assert found is not None
    assert found.floor == pytest.approx(0.002, rel=0.35)
    assert found.share == pytest.approx(share, rel=0.4, abs=0.003)
    assert found.variance(np.array([0.0]))[0] == pytest.approx(found.floor**2)


def test_too_little_says_nothing() -> None:
    assert noise_growth(np.ones(100), np.ones(100), DT) is None
