"""A lone drive without an answer to a command, beside sensors of the body."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.response.body import BodySpeed
from diagnosis.response.by_body import beside_the_body
from diagnosis.response.inputs import FollowerData, cell_of, cells
from diagnosis.response.models import BLOCK_S
from replay.faults import FaultMode, Side

Array = NDArray[np.float64]

DT, N = 0.05, 1600  # 80 s at 20 Hz
WIDTH = round(BLOCK_S / DT)
PART = slice(600, 800)
DRIVEN = 0.5 + 0.2 * np.sin(0.3 * DT * np.arange(N))


def noisy(x: Array, seed: int) -> Array:
    return np.asarray(x + 0.01 * np.random.default_rng(seed).normal(size=N))


def stated(y: Array, body: Array = DRIVEN) -> list[tuple[Side, FaultMode, float]]:
    silent = np.full(N, np.nan)
    data = FollowerData(y, np.isfinite(y), cells(silent, cell_of(DT))[:, None], silent, "wheel.D.v")
    found = beside_the_body(data, [BodySpeed("odometry", cells(noisy(body, 9), WIDTH), False, 2)], DT)
    assert all(abs(f.start - PART.start) < 2 * WIDTH and abs(f.stop - PART.stop) < 2 * WIDTH for f in found)
    return [(f.side, f.mode, 0.0 if f.epsilon is None else round(f.epsilon.value, 1)) for f in found]


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("gain", [1.0, 0.8])
def test_a_speed_that_agrees_with_the_body_shows_nothing(seed: int, gain: float) -> None:
    assert stated(noisy(gain * DRIVEN, seed)) == []


@pytest.mark.parametrize("left", [0.0, 0.5])
def test_a_speed_that_is_a_share_of_the_bodys_at_once_is_the_sensors(left: float) -> None:
    y = noisy(DRIVEN, 1)
    y[PART] *= left
    mode = FaultMode.INEFFICIENT if left else FaultMode.NO_SIGNAL
    assert stated(y) == [(Side.SENSOR, mode, 1.0 - left)]


def test_a_position_that_stays_is_not_the_speeds_fault() -> None:
    body = DRIVEN.copy()
    body[PART] = 0.0
    assert stated(noisy(DRIVEN, 1), body) == []


def test_a_share_that_comes_slowly_is_slip() -> None:
    slips = np.ones(N)
    slips[PART] = 1.0 - 0.5 * np.sin(np.linspace(0.0, np.pi, PART.stop - PART.start)) ** 2
    assert stated(noisy(DRIVEN * slips, 1)) == []


def test_a_sensor_of_another_motion_says_nothing() -> None:
    y = noisy(DRIVEN, 1)
    y[PART] = 0.0
    assert stated(y, np.abs(np.random.default_rng(3).normal(size=N))) == []
