"""A second angle that shows what the first one does leaves no fault of the sensor, whatever a model says."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.results.assessment import Finding
from diagnosis.results.vocabulary import Tier
from diagnosis.steering.agreed import without_agreed
from diagnosis.steering.side_findings import SideFindings
from replay.faults import FaultMode, Side

DT, SIZE = 0.01, 4000
NOTHING = SideFindings((), ())


def noisy(mode: FaultMode = FaultMode.NOISY) -> SideFindings:
    return SideFindings((Finding(1000, 1150, Side.SENSOR, mode, 0.85, (), None, None, (), Tier.MODEL),), ())


def inputs(second: np.ndarray | None, first: np.ndarray, *, valve: bool) -> Any:
    values = {"phi": first, "phi_true": second}
    return SimpleNamespace(
        angle_redundant=second is not None,
        valve_redundant=valve,
        blocks=SimpleNamespace(length=10),
        values=values.__getitem__,
        channel=lambda leaf: leaf,
        timeline=SimpleNamespace(dt=DT, fresh={"phi": np.ones(SIZE, np.bool_)}),
    )


@pytest.mark.parametrize("valve", [True, False])
def test_what_a_second_angle_shows_too_is_no_fault_of_the_sensor(*, valve: bool) -> None:
    rng = np.random.default_rng(3)
    truth = 0.2 * np.sin(np.arange(SIZE) * DT)
    first, second = truth + rng.normal(0.0, 1e-3, SIZE), truth + 0.03 + rng.normal(0.0, 1e-3, SIZE)
    found = {Side.SENSOR: noisy(), Side.ACTUATOR: NOTHING}
    out = without_agreed(found, inputs(second, first, valve=valve))
    assert not out[Side.SENSOR].findings
    assert out[Side.ACTUATOR].unexplained == (() if valve else ((100, 115),))
    assert out[Side.SENSOR].refuted == ((100, 115),)  # it reads what the second one does: healthy
    assert out[Side.SENSOR].unexplained == ()

    shaken = first.copy()
    shaken[1000:1150] += rng.normal(0.0, 0.02, 150)
    assert without_agreed(found, inputs(second, shaken, valve=valve)) == found


def test_what_tells_nothing_denies_nothing() -> None:
    rng = np.random.default_rng(3)
    truth = 0.2 * np.sin(np.arange(SIZE) * DT)
    apart = truth + rng.normal(0.0, 0.1, SIZE)
    lost = {Side.SENSOR: noisy(FaultMode.NO_SIGNAL), Side.ACTUATOR: NOTHING}
    found = {Side.SENSOR: noisy(), Side.ACTUATOR: NOTHING}
    assert without_agreed(found, inputs(truth.copy(), truth, valve=True)) == found  # a copy
    assert without_agreed(found, inputs(apart, truth, valve=True)) == found  # two angles that never agree
    assert without_agreed(found, inputs(None, truth, valve=True)) == found
    assert without_agreed(lost, inputs(truth + rng.normal(0.0, 1e-3, SIZE), truth, valve=True)) == lost


@pytest.mark.parametrize(("mode", "stays"), [(FaultMode.NOISY, False), (FaultMode.STUCK, True)])
def test_play_between_both_angles_is_no_noise(mode: FaultMode, *, stays: bool) -> None:
    rng = np.random.default_rng(3)
    truth = 0.2 * np.sin(np.arange(SIZE) * DT)
    first, second = truth + rng.normal(0.0, 1e-3, SIZE), truth + rng.normal(0.0, 1e-3, SIZE)
    first[1000:1150] -= 0.01
    found = {Side.SENSOR: noisy(mode), Side.ACTUATOR: NOTHING}
    out = without_agreed(found, inputs(second, first, valve=True))[Side.SENSOR]
    assert bool(out.findings) is stays
    assert out.refuted == ()
    assert bool(out.unexplained) is not stays
