"""Wheels that slow down to zero and come back in the same moments may be held by what is under them."""

from __future__ import annotations

import pytest

from diagnosis.results.assessment import Finding
from diagnosis.results.result import Hypothesis
from diagnosis.results.vocabulary import Tier
from diagnosis.wheels.slowing import _PASSED, or_held_together
from replay.faults import FaultMode, Side

DT = 0.01


def held(start: int, stop: int, why: str = _PASSED) -> Finding:
    rows = (
        Hypothesis("actuator", FaultMode.NO_SIGNAL, 0.4),
        Hypothesis("sensor", FaultMode.NO_SIGNAL, 0.35),
        Hypothesis("actuator", FaultMode.STUCK, 0.2),
        Hypothesis("none", "healthy", 0.05),
    )
    return Finding(
        start, stop, Side.SENSOR_OR_ACTUATOR, FaultMode.NO_SIGNAL, 0.75, rows, None, None, (why,), Tier.MODEL
    )


def test_wheels_that_are_held_from_one_moment_to_another_are_hardly_faulty() -> None:
    first, second, third = or_held_together([[held(1_000, 1_250)], [held(1_010, 1_245)], [held(1_000, 1_600)]], DT)
    for (one,) in (first, second):
        assert one.probability == pytest.approx(0.45)
        assert sum(h.p for h in one.hypotheses if h.mode != "healthy") == pytest.approx(0.57)
    assert third == [held(1_000, 1_600)]


def test_what_is_cut_off_is_left_as_it_is() -> None:
    cut = held(1_000, 1_250, "what decided")
    assert or_held_together([[cut], [held(1_000, 1_250)]], DT) == [[cut], [held(1_000, 1_250)]]
