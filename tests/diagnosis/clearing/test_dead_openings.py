"""Openings that move no drive: found where wheels agree better beyond them, left alone where not, and no fault hides in them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from diagnosis.clearing.dead_openings import beyond, dead_opening
from diagnosis.clearing.responses import _nearer

WINDOWS, CELLS = 80, 30.0


class _Cells:
    """A mission that keeps what was found of it."""

    def __init__(self) -> None:
        self.kept: dict[str, Any] = {}

    def once(self, what: str, found: Any) -> Any:
        if what not in self.kept:
            self.kept[what] = found()
        return self.kept[what]


def mission(dead: float, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Mean speeds and openings of four wheels whose sides differ in turns, of valves that move nothing up to `dead`."""
    rng, t = np.random.default_rng(seed), np.arange(WINDOWS)
    turn = 0.3 * np.sin(t / 4.0)[:, np.newaxis] * np.array([-1.0, 1.0, -1.0, 1.0])
    speed = (0.6 + 0.1 * np.sin(t / 9.0))[:, np.newaxis] * (1.0 + turn)
    return speed, dead + (1.0 - dead) * speed * (1.0 + 0.01 * rng.standard_normal((WINDOWS, 4)))


def found(speed: np.ndarray, opening: np.ndarray, ahead: np.ndarray | None = None) -> float:
    cells: Any = _Cells()
    count = np.full(speed.shape, CELLS)
    ahead = np.ones(speed.shape, np.bool_) if ahead is None else ahead
    return dead_opening(cells, CELLS * speed, CELLS * opening, count, ahead)


@pytest.mark.parametrize("dead", [0.15, 0.3])
def test_what_moves_no_drive_is_found_where_wheels_differ_in_turns(dead: float) -> None:
    assert found(*mission(dead)) == pytest.approx(dead, abs=0.05)


def test_valves_that_answer_from_the_first_on_have_none() -> None:
    assert found(*mission(0.0)) == 0.0


def test_wheels_that_agree_anyway_need_none() -> None:
    speed, opening = mission(0.3)
    speed, opening = np.repeat(speed[:, :1], 4, axis=1), np.repeat(opening[:, :1], 4, axis=1)
    assert found(speed, opening) == 0.0


def test_few_windows_and_two_wheels_tell_nothing() -> None:
    speed, opening = mission(0.3)
    assert found(speed[:10], opening[:10]) == 0.0
    assert found(speed[:, :2], opening[:, :2]) == 0.0
    assert found(np.full_like(speed, np.nan), opening) == 0.0


@pytest.mark.parametrize("lost", [0.3, 0.6])
def test_the_loss_of_one_wheel_makes_none_and_shows_beyond_what_is_found(lost: float) -> None:
    speed, opening = mission(0.0)
    opening[40:, 2] /= 1.0 - lost  # its loop asks for more
    assert found(speed, opening) == 0.0
    speed, opening = mission(0.3)
    opening[40:, 2] = opening[40:, 2] / (1.0 - lost)
    dead = found(speed, opening)
    assert dead == pytest.approx(0.3, abs=0.05)
    count = np.full(speed.shape, CELLS)
    own = np.log(CELLS * speed / beyond(CELLS * opening, count, dead))
    apart = own[:, 2] - np.median(own[:, [0, 1, 3]], axis=1)
    assert np.median(apart[40:]) - np.median(apart[:40]) < np.log(1.0 - lost) + 0.02


def test_it_is_found_once_for_a_mission() -> None:
    cells: Any = _Cells()
    count = np.full((WINDOWS, 4), CELLS)
    ahead = np.ones((WINDOWS, 4), np.bool_)
    speed, opening = mission(0.3)
    first = dead_opening(cells, CELLS * speed, CELLS * opening, count, ahead)
    plain = mission(0.0)
    assert dead_opening(cells, CELLS * plain[0], CELLS * plain[1], count, ahead) == first


def test_a_part_of_an_opening_below_what_moves_counts_all_the_same() -> None:
    count = np.full((1, 2), CELLS)
    opened = CELLS * np.array([[0.2, 0.6]])
    assert beyond(opened, count, 0.3) == pytest.approx(CELLS * np.array([[0.2 / 3.0, 0.3]]))
    assert beyond(opened, count, 0.0) is opened


def test_what_either_way_of_counting_explains_is_no_deviation() -> None:
    plain, further = np.array([0.3, 0.1, -0.2, np.nan]), np.array([0.1, 0.4, 0.1, np.nan])
    assert _nearer(plain, further) == pytest.approx([0.1, 0.1, 0.0, np.nan], nan_ok=True)
