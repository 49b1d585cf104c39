"""Noise that all wheels share is no wheel's fault; noise of one stays its own."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.wheels.findings import WheelFindings
from diagnosis.wheels.shared_swings import without_shared
from replay.faults import FaultMode, Side

DT, WIDTH, N = 0.01, 2, 6_000
PART = slice(2_000, 4_000)


def judged(swings: dict[int, np.ndarray], mode: FaultMode = FaultMode.NOISY, noisy: tuple[int, ...] = (0,)) -> Any:
    rng = np.random.default_rng(1)
    paths: Any = {
        i: SimpleNamespace(y=s + 0.002 * rng.standard_normal(N), dt=DT, width=WIDTH, expected=np.zeros(N // WIDTH))
        for i, s in swings.items()
    }
    finding = SimpleNamespace(start=PART.start, stop=PART.stop, mode=mode, side=Side.SENSOR)
    found = {
        i: WheelFindings(
            [finding] if i in noisy else [],  # type: ignore[list-item]
            {side: np.zeros(N, dtype=np.bool_) for side in (Side.SENSOR, Side.ACTUATOR)},
            {side: np.zeros(N, dtype=np.bool_) for side in (Side.SENSOR, Side.ACTUATOR)},
        )
        for i in swings
    }
    return without_shared(paths, found)


def swing(phase: float, size: float = 0.05) -> np.ndarray:
    out = np.zeros(N)
    t = np.arange(N) * DT
    out[PART] = size * np.sin(2 * np.pi * 0.7 * t[PART] + phase)
    return out


def test_what_all_wheels_do_is_nobodys_noise() -> None:
    got = judged({i: swing(0.2 * i) for i in range(4)})
    assert got.found[0].findings == []
    assert got.found[0].opened[Side.SENSOR][PART].all()
    assert got.found[0].unexplained[Side.ACTUATOR][PART].all()
    assert got.spans == ((20.0, 40.0),)
    assert got.sentence.startswith("Between 20.0 and 40.0 s several {wheels} swing")


@pytest.mark.parametrize("others", [0.0, 0.2])
def test_noise_of_one_wheel_stays_its_own(others: float) -> None:
    """Others that do nothing, or the same much less: the noise of one wheel shakes its machine."""
    got = judged({0: swing(0.0)} | {i: others * swing(0.1) for i in (1, 2, 3)})
    assert len(got.found[0].findings) == 1
    assert not got.found[0].opened[Side.SENSOR].any()
    assert got.sentence == ""


def test_wheels_that_hunt_each_by_itself_are_not_blamed_either() -> None:
    rng = np.random.default_rng(2)
    noise = {i: np.repeat(rng.standard_normal(N // 20), 20) * 0.05 for i in range(4)}
    assert judged(noise).found[0].findings == []


def test_two_wheels_that_begin_and_end_together_share_a_cause() -> None:
    swings = {i: swing(2.0 * i, 0.05 if i < 2 else 0.002) for i in range(4)}
    assert [len(w.findings) for w in judged(swings, noisy=(0, 1)).found.values()] == [0, 0, 0, 0]
    assert len(judged(swings, noisy=(0,)).found[0].findings) == 1


def test_other_rows_and_machines_of_two_wheels_are_left_alone() -> None:
    assert len(judged({i: swing(0.0) for i in range(4)}, FaultMode.INEFFICIENT).found[0].findings) == 1
    assert len(judged({i: swing(0.0) for i in range(2)}).found[0].findings) == 1


def noises(coherent: bool) -> dict[int, np.ndarray]:
    """Two noisy wheels, the second of them later, and two quiet ones."""
    rng = np.random.default_rng(5)
    slow = [np.convolve(rng.standard_normal(N), np.exp(-np.arange(500) / 80.0))[:N] / 10.0 for _ in range(2)]
    out = {i: np.zeros(N) for i in range(3)}
    out[0][PART] = 0.05 * slow[0][PART]
    out[1][2_400:5_600] = 0.05 * slow[0 if coherent else 1][2_400:5_600]
    out[2][PART] = 0.03 * slow[0][PART]
    return out


@pytest.mark.parametrize("coherent", [False, True])
def test_noise_of_another_wheel_at_another_time_is_no_swing_of_both_unless_both_move_alike(coherent: bool) -> None:
    swings = noises(coherent)
    rng = np.random.default_rng(1)
    paths: Any = {
        i: SimpleNamespace(y=s + 0.002 * rng.standard_normal(N), dt=DT, width=WIDTH, expected=np.zeros(N // WIDTH))
        for i, s in swings.items()
    }
    spans = {0: [PART], 1: [slice(2_400, 5_600)], 2: []}
    found = {
        i: WheelFindings(
            [
                SimpleNamespace(start=p.start, stop=p.stop, mode=FaultMode.NOISY, side=Side.SENSOR)  # type: ignore[misc]
                for p in spans[i]
            ],
            {side: np.zeros(N, dtype=np.bool_) for side in (Side.SENSOR, Side.ACTUATOR)},
            {side: np.zeros(N, dtype=np.bool_) for side in (Side.SENSOR, Side.ACTUATOR)},
        )
        for i in swings
    }
    got = without_shared(paths, found)
    assert bool(got.found[0].findings) is not coherent
