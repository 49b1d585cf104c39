"""Angles of two axles off their second measurements by the same share: the machine's linkages, and no fault of one sensor."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.results.assessment import Finding
from diagnosis.results.vocabulary import Tier
from diagnosis.steering.alike_angles import not_scaled_together
from diagnosis.steering.side_findings import SideFindings
from replay.faults import FaultMode, Side

SIZE, LENGTH = 2000, 4
T = np.arange(SIZE) * 0.01
ANGLE = 0.3 * np.sin(0.8 * T)


def axle(name: str, gain: float, *, noise: float = 0.0, redundant: bool = True) -> Any:
    second = ANGLE * (1.0 if name == "front" else -1.0)
    first = gain * second + np.random.default_rng(1).normal(0.0, noise + 1e-4, SIZE)
    values = {"phi": first, "phi_true": second}
    return SimpleNamespace(name=name, angle_redundant=redundant, values=values.__getitem__)


def sensor(mode: FaultMode) -> dict[Side, SideFindings]:
    found = Finding(400, 800, Side.SENSOR, mode, 0.95, (), None, None, (), Tier.DIRECT)
    return {Side.SENSOR: SideFindings((found,), ()), Side.ACTUATOR: SideFindings((), ())}


@pytest.mark.parametrize(
    ("mode", "own", "other", "noise", "kept"),
    [
        (FaultMode.NOISY, 1.12, 1.10, 0.0, False),
        (FaultMode.INEFFICIENT, 0.85, 0.88, 0.0, False),
        (FaultMode.OUTSIDE_TABLE, 1.12, 1.02, 0.0, True),  # of one alone
        (FaultMode.OUTSIDE_TABLE, 1.12, 0.9, 0.0, True),
        (FaultMode.INEFFICIENT, 0.7, 0.7, 0.0, True),  # both lose as much as counts
        (FaultMode.NOISY, 1.05, 1.05, 0.2, True),  # noise
        (FaultMode.STUCK, 1.12, 1.12, 0.0, True),
    ],
)
def test_a_share_that_both_axles_are_off_is_no_fault(
    mode: FaultMode, own: float, other: float, noise: float, *, kept: bool
) -> None:
    found = {"front": sensor(mode), "rear": {side: SideFindings((), ()) for side in Side}}
    axles = [axle("front", own, noise=noise), axle("rear", other)]
    out = not_scaled_together(found, axles, LENGTH, 0.25)["front"][Side.SENSOR]
    assert bool(out.findings) is kept
    assert out.unexplained == (() if kept else ((100, 200),))


def test_without_a_second_angle_of_the_other_axle_it_stays() -> None:
    found = {"front": sensor(FaultMode.NOISY), "rear": sensor(FaultMode.NOISY)}
    out = not_scaled_together(found, [axle("front", 1.1), axle("rear", 1.1, redundant=False)], LENGTH, 0.25)
    assert out["front"][Side.SENSOR].findings
    assert out["rear"][Side.SENSOR].findings
