"""Angles of two axles that repeat one value where nobody asks them to turn: how they read at rest."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.results.assessment import Finding
from diagnosis.results.vocabulary import Tier
from diagnosis.steering.rests_together import not_resting_together
from diagnosis.steering.side_findings import SideFindings
from replay.faults import FaultMode, Side

SIZE, LENGTH = 2000, 2


def sides(mode: FaultMode) -> dict[Side, SideFindings]:
    found = Finding(200, 800, Side.SENSOR, mode, 0.96, (), None, None, (), Tier.SIGNAL)
    return {Side.SENSOR: SideFindings((found,), ()), Side.ACTUATOR: SideFindings((), ())}


def inputs(name: str, *, trembles: bool) -> Any:
    angle = np.random.default_rng(2).normal(0.0, 1e-3, SIZE) if trembles else np.zeros(SIZE)
    return SimpleNamespace(name=name, angle=angle, fresh=np.arange(SIZE) % 4 == 0)


def under(asked: float) -> Any:
    command = np.zeros(SIZE // LENGTH)
    command[200:300] = asked
    return SimpleNamespace(
        blocks=SimpleNamespace(dt=0.02, count=np.ones(command.size), mean=np.zeros(command.size), length=LENGTH),
        driven=SimpleNamespace(command=command),
        model=SimpleNamespace(noise=SimpleNamespace(white=1e-8, lsb=2e-4), rate_error=0.01, stop=0.6),
    )


@pytest.mark.parametrize(
    ("mode", "trembles", "asked", "kept"),
    [
        (FaultMode.NO_SIGNAL, False, 0.0, False),
        (FaultMode.STUCK, False, 0.0, False),
        (FaultMode.NO_SIGNAL, True, 0.0, True),  # the other one lives
        (FaultMode.NO_SIGNAL, False, 0.3, True),  # it is asked to turn
        (FaultMode.NOISY, False, 0.0, True),
    ],
)
def test_what_two_angles_do_at_rest_is_no_dead_sensor(
    mode: FaultMode, asked: float, *, trembles: bool, kept: bool
) -> None:
    found = {"front": sides(mode), "rear": {side: SideFindings((), ()) for side in Side}}
    axles = [inputs("front", trembles=False), inputs("rear", trembles=trembles)]
    out = not_resting_together(found, axles, dict.fromkeys(found, under(asked)))["front"][Side.SENSOR]
    assert bool(out.findings) is kept
    assert out.unexplained == (() if kept else ((100, 400),))
