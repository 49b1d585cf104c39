"""A speed is late where it is more alike its command at another delay than at that of the others."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from diagnosis.clearing import measure
from diagnosis.clearing.measure import late

Array = NDArray[np.float64]
DT = 0.1


def delays(of_last: int, noise: float, seed: int) -> list[float | None]:
    """Of four wheels whose slow command each answers after 0.3 s, the last one later by some cells."""
    rng = np.random.default_rng(seed)
    command = np.cumsum(np.repeat(rng.choice([-0.09, 0.0, 0.0, 0.09], 40), 30)) * DT
    speed = np.column_stack([np.roll(command, 3 + (of_last if w == 3 else 0)) for w in range(4)])
    speed += noise * rng.normal(size=speed.shape)
    return late(speed, np.column_stack([command] * 4), DT)


@pytest.mark.parametrize("seed", range(4))
def test_slow_changes_in_noise_tell_no_delay_of_one_wheel(seed: int) -> None:
    assert all(x is not None and x < 0.2 for x in delays(0, 0.003, seed))


@pytest.mark.parametrize("seed", range(4))
def test_a_wheel_that_comes_later_is_told(seed: int) -> None:
    *others, last = delays(5, 0.003, seed)
    assert last == pytest.approx(0.5, abs=0.11)
    assert all(x is not None and x < 0.2 for x in others)


def test_delays_lie_between_the_cells_in_which_they_are_looked_for() -> None:
    t = np.arange(0.0, 120.0, DT)
    command = np.cumsum(np.sin(2.9 * t) * np.sin(0.23 * t)) * DT
    speed = np.column_stack([np.interp(t - lag, t, command) for lag in (0.3, 0.3, 0.3, 0.55)])
    *_, last = late(speed, np.column_stack([command] * 4), DT)
    assert last == pytest.approx(0.25, abs=0.02)


@pytest.mark.parametrize(("at_others", "delay"), [(0.878, 0.0), (0.70, 0.3)])
def test_a_correlation_that_is_hardly_larger_tells_no_delay(
    monkeypatch: pytest.MonkeyPatch, at_others: float, delay: float
) -> None:
    def alike(x: Array, y: Array, cells: int) -> float:
        if x[0] == 0.0:
            return 0.86 if cells == 4 else 0.7
        return {1: 0.88, 4: at_others}.get(cells, 0.6)

    monkeypatch.setattr(measure, "_alike", alike)
    speed = np.outer(np.arange(50.0), [0.0, 0.0, 0.0, 1.0])
    assert late(speed, speed, DT)[3] == pytest.approx(delay, abs=0.05)


@pytest.mark.parametrize("wheel", [0, 1])
def test_of_two_wheels_the_later_one_is_late_by_all_of_it(wheel: int) -> None:
    """Each had been "later" by half of it, the sound one too."""
    rng = np.random.default_rng(4)
    command = np.repeat(rng.uniform(-1.0, 1.0, 40), round(2.0 / DT))
    speed = np.column_stack([command, command])
    delay = round(0.5 / DT)
    speed[:, wheel] = np.r_[np.zeros(delay), command[:-delay]]
    assert late(speed, np.column_stack([command] * 2), DT) == [
        pytest.approx(0.5 if i == wheel else 0.0, abs=DT) for i in range(2)
    ]
