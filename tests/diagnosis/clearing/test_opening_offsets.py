"""Openings that a wheel needs for its speed beside the other wheels: a valve that is off by a constant, and wheels that merely differ."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.clearing.cells import Frame
from diagnosis.clearing.opening_offsets import opening_offsets

N = 750


def cells_of(command: np.ndarray) -> Any:
    """Cells of .1 s in which all wheels are told the same speed [m/s], 3 s and .5 s for its windows."""
    reference = command[:, np.newaxis] * np.ones(4)
    return SimpleNamespace(dt=0.1, frame=Frame(N, 30, 5), machine=SimpleNamespace(max_speed=2.0), reference=reference)


def driven() -> np.ndarray:
    """Speeds that stay for 12.5 s, forward and back [m/s]."""
    return np.repeat([0.5, 1.5, -0.8, 1.0, -1.4, 0.7], N // 6)


def openings(speed: np.ndarray, dead: float = 0.1) -> np.ndarray:
    """Of four valves with a dead band, whose gains differ by 2 %, shape (n, 4)."""
    noise = 0.003 * np.random.default_rng(1).standard_normal((N, 4))
    return speed[:, np.newaxis] * np.array([0.40, 0.404, 0.396, 0.4]) + dead * np.sign(speed)[:, np.newaxis] + noise


@pytest.mark.parametrize(("start", "stop", "once", "usual"), [(250, 400, 0.12, 0.0), (0, N, 0.0, 0.12)])
def test_a_valve_that_is_off_by_a_constant_asks_for_as_much_more(
    start: int, stop: int, once: float, usual: float
) -> None:
    """Forward and in reverse alike, for a while or always."""
    speed = driven()
    u = openings(speed)
    u[start:stop, 2] -= 0.12
    windows, lasting = opening_offsets(cells_of(speed), speed[:, np.newaxis] * np.ones(4), u)
    assert np.nanmax(windows[:, 2]) == pytest.approx(once, abs=0.02)
    assert lasting[2] == pytest.approx(usual, abs=0.02)
    assert np.nanmax(np.delete(windows, 2, axis=1)) < 0.03
    assert np.max(np.delete(lasting, 2)) < 0.03


def test_where_nothing_drives_there_is_nothing_to_compare() -> None:
    speed = np.zeros(N)
    windows, lasting = opening_offsets(cells_of(speed), np.zeros((N, 4)), openings(speed))
    assert np.isnan(windows).all()
    assert np.isnan(lasting).all()


def test_unknown_openings_are_left_out() -> None:
    speed = driven()
    u = openings(speed)
    u[:, 1] = np.nan
    windows, lasting = opening_offsets(cells_of(speed), speed[:, np.newaxis] * np.ones(4), u)
    assert np.isnan(lasting[1])
    assert np.nanmax(windows) < 0.03
