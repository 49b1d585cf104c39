"""Second speeds that come later, or earlier, on all wheels alike are the machine's instruments; one wheel's lag, or loss, is its own."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.clearing.cells import Frame
from diagnosis.clearing.measure import behind
from diagnosis.clearing.seconds import off_second

SIZE, DT, FLOOR = 900, 0.1, 0.1
TRUE = 0.8 * np.sign(np.sin(0.5 * np.arange(SIZE) * DT))[:, np.newaxis] * np.ones(4)
CELLS: Any = SimpleNamespace(frame=Frame(SIZE, 30, 5), dt=DT)


def largest(speed: np.ndarray, second: np.ndarray) -> np.ndarray:
    return np.asarray(np.nanmax(off_second(CELLS, speed, second, FLOOR), axis=0))


@pytest.mark.parametrize("earlier", [False, True])
def test_a_lag_that_all_wheels_share_is_no_fault(*, earlier: bool) -> None:
    late = behind(TRUE, DT, 0.2)
    assert (largest(*((TRUE, late) if earlier else (late, TRUE))) < 0.08).all()


def test_a_wheel_that_is_later_than_the_others_or_loses_is_off() -> None:
    speed = behind(TRUE, DT, 0.2)
    speed[:, 1] = behind(TRUE[:, [1]], DT, 0.8)[:, 0]
    speed[400:440, 2] *= 0.6
    off = largest(speed, TRUE)
    assert (off[[0, 3]] < 0.08).all()
    assert off[1] > 0.3
    assert off[2] == pytest.approx(0.4, abs=0.05)


def test_what_all_lose_stays() -> None:
    assert (largest(0.7 * behind(TRUE, DT, 0.2), TRUE) > 0.28).all()


def test_of_one_wheel_the_lag_is_its_own_and_without_wheels_there_is_nothing() -> None:
    second = np.full(TRUE.shape, np.nan)
    second[:, 0] = TRUE[:, 0]
    assert np.nanmax(off_second(CELLS, behind(TRUE, DT, 0.3), second, FLOOR)[:, 0]) > 0.15
    assert off_second(CELLS, TRUE[:, :0], TRUE[:, :0], FLOOR).shape == (len(CELLS.frame.starts), 0)
