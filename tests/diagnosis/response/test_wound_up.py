"""A drive that pulls nothing soon after another fault of its wheel is less sure."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.response.spells import Spell
from diagnosis.response.wound_up import after_a_fault
from diagnosis.results.assessment import Finding
from diagnosis.results.result import Epsilon, Hypothesis
from diagnosis.results.vocabulary import Tier
from replay.faults import FaultMode, Side

BLOCK_S, WIDTH = 0.25, 5


def idle(start_s: float, stop_s: float) -> Finding:
    at = [round(s / BLOCK_S) * WIDTH for s in (start_s, stop_s)]
    said = (
        Hypothesis("actuator", "no_signal", 0.94),
        Hypothesis("actuator", "inefficient", 0.03),
        Hypothesis("none", "healthy", 0.03),
    )
    return Finding(
        *at, Side.ACTUATOR, FaultMode.NO_SIGNAL, 0.94, said, Epsilon(1.0, 1.0, 1.0), None, ("idle",), Tier.RESPONSE
    )


def wheel(*faults: tuple[float, float, float]) -> Any:
    spells = [Spell(round(a / BLOCK_S), round(b / BLOCK_S), FaultMode.INEFFICIENT, p) for a, b, p in faults]
    return SimpleNamespace(
        spells=spells, wheel=SimpleNamespace(dt=BLOCK_S / WIDTH, blocks=SimpleNamespace(start=np.arange(800) * WIDTH))
    )


@pytest.mark.parametrize(
    ("fault", "sure"),
    [
        ((40.0, 80.0, 0.9), False),
        ((10.0, 30.0, 0.9), True),
        ((40.0, 80.0, 0.4), True),
        ((77.0, 80.0, 0.9), True),
        ((90.0, 99.0, 0.9), True),
    ],
)
def test_what_the_loops_wound_up_makes_it_less_sure(fault: tuple[float, float, float], sure: bool) -> None:
    effort = np.ones(800)
    (found,) = after_a_fault([idle(98.0, 102.0)], wheel(fault), effort, BLOCK_S)
    assert (found.probability > 0.9) is sure
    assert sum(h.p for h in found.hypotheses) == pytest.approx(1.0)


def test_a_drive_that_pulled_nothing_before_is_as_sure() -> None:
    effort = np.ones(800)
    effort[160:320] = 0.0
    (found,) = after_a_fault([idle(98.0, 102.0)], wheel((40.0, 80.0, 0.9)), effort, BLOCK_S)
    assert found.probability == 0.94
    assert after_a_fault([idle(98.0, 102.0)], wheel((40.0, 80.0, 0.9)), None, BLOCK_S)[0].probability == 0.94
