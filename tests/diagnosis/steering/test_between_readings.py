"""A command that jumps between two of its readings, beside an opening that is read more often."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.results.assessment import Finding
from diagnosis.results.vocabulary import Tier
from diagnosis.steering.between_readings import between_readings
from replay.faults import FaultMode, Side

N, EVERY = 2_000, 10


def inputs(noise: float, every: int = EVERY) -> Any:
    """A valve that is opened and shut by a command that changes at any time, and is read every so many samples."""
    rng = np.random.default_rng(3)
    told = np.repeat(rng.integers(-1, 2, N // 25).astype(float), 25)
    told = np.roll(told, 4)  # it changes between two readings
    fresh = np.arange(N) % every == 0
    held = told[np.flatnonzero(fresh)[np.cumsum(fresh) - 1]]
    values = {"u": held, "u_applied": told + noise * rng.standard_normal(N)}
    return SimpleNamespace(
        valve_redundant=True,
        channel=lambda leaf: leaf,
        values=values.__getitem__,
        timeline=SimpleNamespace(fresh={"u": fresh, "u_applied": np.ones(N, np.bool_)}),
    )


def finding(mode: FaultMode = FaultMode.NOISY) -> Finding:
    return Finding(200, 1_800, Side.ACTUATOR, mode, 0.96, (), None, None, (), Tier.MODEL)


@pytest.mark.parametrize(("noise", "between"), [(0.0, True), (0.02, True), (0.3, False)])
def test_what_lies_between_two_readings_is_no_noise(noise: float, *, between: bool) -> None:
    assert between_readings(finding(), inputs(noise)) is between


def test_other_rows_and_single_measurements_are_left_alone() -> None:
    assert not between_readings(finding(FaultMode.STUCK), inputs(0.0))
    once = inputs(0.0)
    once.valve_redundant = False
    assert not between_readings(finding(), once)
    slow = inputs(0.0)
    slow.timeline.fresh["u_applied"] = np.arange(N) % (2 * EVERY) == 0
    assert not between_readings(finding(), slow)
