"""A wheel that stands while the other wheels fall behind as well is held by what holds the machine."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from diagnosis.results.assessment import Finding
from diagnosis.results.result import Hypothesis
from diagnosis.results.vocabulary import Tier
from diagnosis.wheels.findings import WheelFindings
from diagnosis.wheels.inputs import WheelsData
from diagnosis.wheels.machine_held import or_machine_held
from replay.faults import FaultMode, Side

DT, SIZE = 0.01, 2000
START, STOP = 500, 900


def claim(mode: FaultMode = FaultMode.NO_SIGNAL) -> Finding:
    rows = (Hypothesis("actuator", mode.value, 0.7), Hypothesis("actuator", "stuck", 0.25))
    return Finding(
        START, STOP, Side.ACTUATOR, mode, 0.7, (*rows, Hypothesis("none", "healthy", 0.05)), None, None, (), Tier.MODEL
    )


def judged(
    others: float,
    seconds: float,
    *,
    own: float = 0.0,
    measured: bool = False,
    mode: FaultMode = FaultMode.NO_SIGNAL,
    failed: tuple[int, ...] = (),
    after: float = 0.0,
) -> Finding:
    """The claim of wheel 0 whose others make a share of their commands for the last seconds of it."""
    y = np.full((SIZE, 4), 1.0)
    y[START:STOP, 0] = own
    y[STOP - round(seconds / DT) : STOP + round(after / DT), 1:] = others
    data = SimpleNamespace(y=y, reference=np.ones((SIZE, 4)), measured=[measured] * 4, span=2.2, dt=DT)
    found = {0: WheelFindings([claim(mode)])} | {j: WheelFindings([claim()] if j in failed else []) for j in (1, 2, 3)}
    return or_machine_held(cast(WheelsData, data), found)[0].findings[0]


def test_a_wheel_that_is_held_with_the_machine_is_hardly_faulty() -> None:
    f = judged(0.1, 1.5, failed=(3,))
    assert sum(h.p for h in f.hypotheses if h.mode != "healthy") == pytest.approx(0.55)
    assert any("what holds the machine" in e for e in f.evidence)


def test_wheels_that_stand_in_turn_are_held() -> None:
    assert judged(0.1, 0.5, after=1.6).probability < 0.7
    assert judged(0.1, 0.5, after=1.0).probability == 0.7


@pytest.mark.parametrize(
    "other",
    [
        {"others": 0.9},
        {"seconds": 0.5},
        {"own": 0.9},
        {"measured": True},
        {"mode": FaultMode.INEFFICIENT},
        {"failed": (1, 2)},
    ],
)
def test_others_that_drive_on_or_fail_a_measured_valve_and_a_wheel_that_turns_change_nothing(
    other: dict[str, float],
) -> None:
    f = judged(**{"others": 0.1, "seconds": 1.5} | other)  # type: ignore[arg-type]
    assert f.probability == 0.7
