"""Efforts of four wheels in one mission: what one of them comes to take more keeps it from being cleared."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.clearing.efforts import effort_checks
from replay.machine.config import haulotte

DT, N = 0.1, 1200
WHEELS = ("FR", "FL", "RR", "RL")


def cells_of(wheels: tuple[str, ...] = WHEELS, lost: float = 0.0) -> Any:
    """A mission whose FL wheel gives less torque for the same effort from its middle on, of all wheels on slopes."""
    rng = np.random.default_rng(2)
    v = 0.2 * np.repeat(rng.uniform(0.5, 1.0, N // 60) * rng.choice([-1, 1], N // 60), 60)
    slope = np.repeat(rng.normal(0.0, 1.0, N // 120), 120)
    signals = {}
    for w in wheels:
        e = 5.0 * np.sign(v) + 8.0 * v + slope + rng.normal(0.0, 0.2, N)
        if w == "FL":
            e[N // 2 :] /= 1.0 - lost
        signals[f"wheel.{w}.v"], signals[f"wheel.{w}.effort"] = v + rng.normal(0.0, 0.001, N), e
    timeline = SimpleNamespace(get=signals.get, size=N, dt=DT)
    return SimpleNamespace(
        timeline=timeline, machine=haulotte(), once=lambda _, found: found(), mostly_explained=lambda name: False
    )


def test_healthy_efforts_pass() -> None:
    found = effort_checks(cells_of())
    assert set(found) == set(WHEELS)
    assert all(c.passed for c in found.values())


@pytest.mark.parametrize("lost", [0.4, 0.6])
def test_a_wheel_that_comes_to_take_more_is_not_cleared(lost: float) -> None:
    found = effort_checks(cells_of(lost=lost))
    assert {w for w, c in found.items() if not c.passed} == {"FL"}
    assert "the effort of FL is off what its motion takes" in found["FL"].text


def test_two_wheels_are_each_others_measure() -> None:
    assert effort_checks(cells_of(("FR", "FL"), lost=0.6)) == {}


def test_a_wheel_that_hardly_drives_is_not_said_to_pass() -> None:
    cells = cells_of()
    cells.timeline.get("wheel.FL.effort")[: N - 10 * 10] = np.nan  # ten driven seconds are left
    assert "FL" not in effort_checks(cells)
