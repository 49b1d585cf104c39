"""What stays where it is beside a reference that does is stuck, or off by a constant."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.results.alike import SHIFTED_SENTENCE, hardly_moves, is_held, or_shifted
from diagnosis.results.assessment import Finding
from diagnosis.results.result import Hypothesis
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side

T = np.linspace(0.0, 10.0, 400)


@pytest.mark.parametrize(
    ("y", "x", "alike"),
    [
        (0.3, 0.0 * T, True),
        (0.3, 0.01 * np.sin(T), True),
        (0.3, 0.1 * np.sin(T), False),
        (0.3, np.full(T.size, 0.3), False),
    ],
    ids=["at rest", "nearly", "moving", "as it should be"],
)
def test_a_reference_that_moves_tells_stuck_from_shifted(y: float, x: np.ndarray, alike: bool) -> None:
    assert hardly_moves(np.full(T.size, y), x) is alike


def test_what_is_far_off_is_not_shifted() -> None:
    assert hardly_moves(np.full(T.size, 0.9), 0.0 * T)
    assert not hardly_moves(np.full(T.size, 0.9), 0.0 * T, 0.4)


def test_it_takes_some_readings() -> None:
    assert not hardly_moves(np.full(3, 0.3), np.zeros(3))


@pytest.mark.parametrize(
    ("kind", "held"), [("held", True), ("shifted", False), ("at rest", False), ("always so", False)]
)
def test_a_held_channel_shows_no_noise_where_one_that_is_off_goes_on_to(kind: str, held: bool) -> None:
    x = np.full(2000, 1.0)
    x[:200], span = 0.0, (1000, 1500)
    y = x + np.random.default_rng(1).normal(0.0, 0.004, x.size)
    if kind == "always so":
        y = np.round(y, 1)
    if kind == "at rest":
        x[slice(*span)] = 0.0
    y[slice(*span)] = y[slice(*span)] - 0.4 if kind == "shifted" else 0.6
    assert is_held(y, x, span) is held


def test_both_are_named() -> None:
    rows = (Hypothesis("sensor", "stuck", 0.9), Hypothesis("none", "healthy", 0.1))
    told = or_shifted(Finding(0, 9, Side.SENSOR, FaultMode.STUCK, 0.9, rows, None, None, ("why",), Tier.DIRECT))
    assert (told.mode, told.probability) == (FaultMode.STUCK, pytest.approx(0.54))
    assert {h.mode: h.p for h in told.hypotheses} == pytest.approx(
        {"stuck": 0.54, "outside_table": 0.36, "healthy": 0.1}
    )
    assert told.evidence == ("why", SHIFTED_SENTENCE)


def test_no_other_row_comes_before_the_one_it_is_called() -> None:
    rows = tuple(Hypothesis("actuator", mode, 0.25) for mode in ("stuck", "noisy", "inefficient", "no_signal"))
    told = or_shifted(Finding(0, 9, Side.ACTUATOR, FaultMode.STUCK, 0.25, rows, None, None, (), Tier.DIRECT))
    assert told.probability == max(h.p for h in told.hypotheses)
