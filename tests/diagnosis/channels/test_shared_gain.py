"""A gain that falls of all valves alike is of all of them; a valve's own loss stays, and so does a large one."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.channels.shared_gain import gain_by_window, shared_gain, without_shared_gain
from replay.machine.config import haulotte
from replay.signals.timeline import Timeline

MS = 1_000_000
N, DT = 6000, 0.01
WARM = np.linspace(1.0, 0.88, N)
WHEELS = ("FR", "FL", "RR", "RL")


def timeline(*gains: np.ndarray) -> Timeline:
    """A minute of driving at changing openings; a gain for every valve."""
    command = 0.3 + 0.1 * np.sin(np.arange(N) * DT)
    signals = {f"wheel.{w}.u": command for w in WHEELS}
    signals |= {f"wheel.{w}.u_applied": g * command for w, g in zip(WHEELS, gains, strict=True)}
    fresh = dict.fromkeys(signals, np.ones(N, np.bool_))
    return Timeline(0, 10 * MS, N, signals, fresh, dict.fromkeys(signals, "a.mcap"), dict.fromkeys(signals, 10 * MS))


def gains_of(found: Timeline) -> np.ndarray:
    return np.array([found.signals[f"wheel.{w}.u_applied"] / found.signals[f"wheel.{w}.u"] for w in WHEELS])


def test_coils_that_warm_alike_are_no_valves_fault() -> None:
    found = without_shared_gain(timeline(WARM, WARM, 1.01 * WARM, 0.99 * WARM), haulotte())
    assert np.abs(gains_of(found) - 1.0).max() < 0.03
    assert "no valve's fault" in found.notes[0]


@pytest.mark.parametrize("lost", [0.3, 0.5, 1.0])
def test_a_valves_own_loss_stays(lost: float) -> None:
    found = without_shared_gain(timeline(WARM, (1 - lost) * WARM, WARM, WARM), haulotte())
    gains = gains_of(found)
    assert np.abs(gains[1] - (1 - lost)).max() < 0.03
    assert np.abs(gains[[0, 2, 3]] - 1.0).max() < 0.03


@pytest.mark.parametrize(
    "gains",
    [
        (1.0, 1.0, 0.85, 0.85),
        (0.75, 0.75, 0.75, 0.75),
        (1.0, 0.5, 0.5, 0.5),
        (1.0, 1.0, 1.0, 0.7),
        (1.06, 1.06, 1.06, 1.06),
    ],
    ids=["two of four", "as much as a fault", "three of four", "one", "more than asked for"],
)
def test_what_is_no_shared_loss_of_health_stays(gains: tuple[float, ...]) -> None:
    given = timeline(*(np.full(N, g) for g in gains))
    assert without_shared_gain(given, haulotte()) is given


def test_a_gain_that_jumps_is_no_warmth() -> None:
    jump = np.where(np.arange(N) < N // 2, 1.0, 0.88)
    given = timeline(jump, jump, jump, jump)
    assert without_shared_gain(given, haulotte()) is given


def test_a_valve_that_hardly_opens_shows_no_gain() -> None:
    small = np.full(2000, 0.05)
    assert np.isnan(gain_by_window(small, small, 500, DT, 1.0)).all()
    assert shared_gain(np.full((12, 4), np.nan)) is None
